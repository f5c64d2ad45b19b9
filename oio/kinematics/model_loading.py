"""Reads the chain that carries the nose from an MJCF file: bodies (`pos`, `quat`), at most one hinge or slide joint each, the site.

What MuJoCo would heed beyond that is refused, so that the chain is MuJoCo's or none.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.forward import HINGE, SLIDE


@dataclass(frozen=True, eq=False)
class KinematicChain:
    """m joints from the world to the nose: names, poses (m, 4, 4), axes (m, 3), kinds (m,), limits (m,), nose_offset (3,)."""

    names: tuple[str, ...]
    poses: Array
    axes: Array
    kinds: NDArray[np.int64]
    low: Array
    high: Array
    nose_offset: Array


def load_chain(path: Path) -> KinematicChain:
    """The chain of bodies that ends in the site `nose` of an MJCF; a body without a joint only carries its children.

    Raises BadInput if the file is no MJCF with a moving nose, or describes the chain in words that are not read here.
    """
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        raise BadInput(f"{path} is not XML ({error}). Give an MJCF file with a site named 'nose'.") from None
    bodies, pose, poses, joints = _bodies_to_nose(root.find("worldbody"), path), np.eye(4), [], []
    for unread in _unread(root, bodies[:-1], bodies[-1]):
        raise BadInput(f"{path} has {unread}")
    for body in bodies[:-1]:
        pose = pose @ _pose(body)
        joint = body.find("joint")
        if joint is not None:
            poses.append(pose)
            joints.append(joint)
            pose = np.eye(4)
    axes = np.array([_numbers(j, "axis", "0 0 1") for j in joints])
    ranges = np.array([_numbers(j, "range", "-3.14159265 3.14159265") for j in joints])
    return KinematicChain(
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
    if found is None or not any(body.find("joint") is not None for body in found[:-1]):
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


def _unread(root: ET.Element, bodies: list[ET.Element], nose: ET.Element) -> Iterator[str]:
    """What would make MuJoCo's chain another one than ours: what is given, what is read, what to write instead."""
    if root.find(".//include") is not None:
        yield "an <include>, but only one file is read. Write what it includes into the file itself."
    if any([nose.get("fromto"), *(site.get(key) for site in root.iterfind(".//default/site") for key in ("pos", "fromto"))]):
        yield "fromto= at the site 'nose' or a place for sites in a <default>, but the site's own pos is read. Write pos=\"x y z\" at it."
    for body in bodies:
        yield from _unread_body(body)
    joints = [joint for body in bodies for joint in body.findall("joint")]
    for joint in joints:
        yield from _unread_joint(joint)
    yield from _unread_unit(root, joints)
    yield from _unread_defaults(root, joints)


def _unread_body(body: ET.Element) -> Iterator[str]:
    name, count = body.get("name", ""), len(body.findall("joint"))
    for key in ("euler", "axisangle", "xyaxes", "zaxis"):
        if body.get(key) is not None:
            yield f'{key}="{body.get(key)}" at body \'{name}\', but bodies are turned by quat only. Write quat="w x y z" instead.'
    if count > 1:
        yield f"{count} joints in body '{name}', but a body may have one. Put each further joint into a body of its own inside it."
    if body.find("freejoint") is not None or body.find("frame//joint") is not None:
        yield f"a <freejoint> or a joint in a <frame> in body '{name}', but a joint is a <joint> of its body. Write it as one."


def _unread_joint(joint: ET.Element) -> Iterator[str]:
    name, kind = joint.get("name", ""), joint.get("type", "hinge")
    if kind not in ("hinge", "slide"):
        yield f'type="{kind}" at joint \'{name}\', but a joint can be a hinge or a slide. Write type="hinge" or type="slide".'
    if np.any(_numbers(joint, "pos", "0 0 0")):
        yield f"pos=\"{joint.get('pos')}\" at joint '{name}', but it must sit where its body does. Move the body there and leave pos out."
    if np.any(_numbers(joint, "ref", "0")):
        yield f"ref=\"{joint.get('ref')}\" at joint '{name}', but 0 must be where the body is drawn. Leave ref out and turn the body."


def _unread_unit(root: ET.Element, joints: list[ET.Element]) -> Iterator[str]:
    unit = [c.get("angle") for c in root.findall("compiler") if c.get("angle") is not None][-1:]  # MuJoCo: the last one counts
    hinge = next((j for j in joints if j.get("type", "hinge") == "hinge" and j.get("range") is not None), None)
    if hinge is not None and unit != ["radian"]:
        given = f'<compiler angle="{unit[0]}">' if unit else "no <compiler angle=...>"
        yield (
            f"{given}, so that range=\"{hinge.get('range')}\" of hinge '{hinge.get('name', '')}' is in degrees, but radians are read. "
            f'Write <compiler angle="radian"/> and every range in radians.'
        )


def _unread_defaults(root: ET.Element, joints: list[ET.Element]) -> Iterator[str]:
    """A default does no harm where every joint of the chain writes the attribute itself."""
    for default in root.iterfind(".//default/joint"):
        for key in ("type", "axis", "range", "pos", "ref"):
            without = [joint.get("name", "") for joint in joints if joint.get(key) is None]
            if default.get(key) is not None and without:
                given = f'{key}="{default.get(key)}" for joints in a <default>'
                yield f"{given}, but it is read at the joint itself only. Write {key}= at {', '.join(without)}."
