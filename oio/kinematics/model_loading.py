"""A robot model file, MJCF or URDF, compiled by MuJoCo for kinematics alone: without geometry, so no mesh has to be there."""

import itertools
import warnings
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput

UNKNOWN_MASS_KG, UNKNOWN_INERTIA_KG_M2 = 1e-3, 1e-6  # of bodies whose mass lay in the geometry that is left out; kinematics need none


def kinematics_mjcf(path: Path) -> bytes:
    """The model as one MJCF file without includes and geometry, from which `load_chain` reads the same chain; for logs.

    A file that stands alone is given as it is. Raises BadInput as `load_chain` does.
    """
    text = path.read_bytes()
    if b"<mujoco" in text and not any(word in text for word in (b"<include", b"file=", b"<robot")):
        return text
    spec = _kinematic_spec(path)
    spec.compile()
    return str(spec.to_xml()).encode()


def compile_kinematics(path: Path) -> Any:
    """The MjModel of an MJCF or URDF file without its geometry; fixed links stay bodies. Raises BadInput with what MuJoCo says."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about dynamics, which are not computed here
            return _kinematic_spec(path).compile()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise BadInput(
            f"{path} is no model that MuJoCo compiles: {reason} Give an MJCF with a site, or a URDF and arm.nose_body."
        ) from None


def name_joints(spec: Any) -> None:
    """Name the joints that have no name, which MuJoCo allows: joint0, joint1, ... in the order of the file."""
    taken = {joint.name for joint in spec.joints}
    for i, joint in enumerate(spec.joints):
        if not joint.name:
            joint.name = next(name for k in itertools.count(i) if (name := f"joint{k}") not in taken)
            taken.add(joint.name)


def _kinematic_spec(path: Path) -> Any:
    import mujoco

    known = path.suffix.lower() in (".xml", ".urdf")  # MuJoCo goes by the name
    spec = mujoco.MjSpec.from_file(str(path)) if known else mujoco.MjSpec.from_string(path.read_text(encoding="utf-8"))
    for element in [*spec.geoms, *spec.meshes, *spec.materials, *spec.textures]:
        spec.delete(element)
    name_joints(spec)
    spec.compiler.fusestatic = False
    spec.compiler.boundmass = max(spec.compiler.boundmass, UNKNOWN_MASS_KG)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, UNKNOWN_INERTIA_KG_M2)
    return spec
