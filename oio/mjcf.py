"""Reads the chain that carries the nose from an MJCF file: bodies (`pos`, `quat`), at most one hinge or slide joint each, the site."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from oio.errors import BadInput
from oio.kinematics import HINGE, SLIDE
from oio.records import Array


@dataclass(frozen=True, eq=False)
class Chain:
    """m joints from the world to the nose: names, poses (m, 4, 4), axes (m, 3), kinds (m,), limits (m,), nose_offset (3,)."""

    names: tuple[str, ...]
    poses: Array
    axes: Array
    kinds: NDArray[np.int64]
    low: Array
    high: Array
    nose_offset: Array


def read_chain(path: Path) -> Chain:
    """The chain of bodies that ends in the site `nose` of an MJCF; raises BadInput if the file is none or has a jointless body."""
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        raise BadInput(f"{path} is not XML ({error}). Give an MJCF file with a site named 'nose'.") from None
    bodies, pose, poses, joints = _bodies_to_nose(root.find("worldbody"), path), np.eye(4), [], []
    for body in bodies[:-1]:
        pose = pose @ _pose(body)
        joint = body.find("joint")
        if joint is not None:  # a jointless body only carries its children further
            poses.append(pose)
            joints.append(joint)
            pose = np.eye(4)
    axes = np.array([_numbers(j, "axis", "0 0 1") for j in joints])
    ranges = np.array([_numbers(j, "range", "-3.14159265 3.14159265") for j in joints])
    return Chain(
        names=tuple(j.get("name", f"joint{i}") for i, j in enumerate(joints)),
        poses=np.array(poses),
        axes=axes / np.linalg.norm(axes, axis=1, keepdims=True),
        kinds=np.array([SLIDE if j.get("type") == "slide" else HINGE for j in joints]),
        low=ranges[:, 0],
        high=ranges[:, 1],
        nose_offset=(pose @ np.append(_numbers(bodies[-1], "pos", "0 0 0"), 1.0))[:3],
    )


def _bodies_to_nose(element: ET.Element | None, path: Path) -> list[ET.Element]:
    found = _descend(element) if element is not None else None
    if found is None or len(found) < 2:
        raise BadInput(f'{path} has no site named \'nose\' on a moving body. Add <site name="nose" pos="..."/> where the sensor sits.')
    return found


def _descend(element: ET.Element) -> list[ET.Element] | None:
    for site in element.findall("site"):
        if site.get("name") == "nose":
            return [site]
    for body in element.findall("body"):
        below = _descend(body)
        if below is not None:
            return [body, *below]
    return None


def _pose(body: ET.Element) -> Array:
    quat = _numbers(body, "quat", "1 0 0 0")
    w, x, y, z = quat / np.linalg.norm(quat)
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = _numbers(body, "pos", "0 0 0")
    return pose


def _numbers(element: ET.Element, key: str, default: str) -> Array:
    return np.array([float(word) for word in element.get(key, default).split()])
