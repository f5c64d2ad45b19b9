"""MuJoCo model of the arm: its model file plus a nose site, a backlash joint per unlocked hinge, and a position servo per joint."""

import math
from typing import Any

import mujoco
import numpy as np

from oio.core.errors import BadInput
from oio.kinematics.arm import Arm
from oio.kinematics.model_loading import name_joints

NOSE = "nose"  # name of the site added to a model without one
SERVO_RAD_S, SERVO_DAMPING = 40.0, 1.0  # natural frequency and damping ratio of added servos, and the error [rad, m] that
SERVO_ERROR = 0.005  # the joint's dry friction may leave: assumptions


def compile_model(arm: Arm) -> tuple[mujoco.MjModel, str]:
    """Compile the model; return it and its XML for the log. Raises BadInput with MuJoCo's message for a file that cannot be simulated."""
    try:
        spec = mujoco.MjSpec.from_file(str(arm.path))
        name_joints(spec)
        spec.compiler.fusestatic = False  # else the URDF body that carries the nose may be merged into its parent
        if arm.nose_body is not None:
            spec.body(arm.nose_body).add_site(name=NOSE, pos=list(arm.nose_offset_m))
        _add_servos(spec, arm)
        _add_backlash(spec, arm)
        return spec.compile(), spec.to_xml()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise BadInput(f"{arm.mjcf} cannot be simulated. MuJoCo says: {reason}") from None


def nose_site(arm: Arm) -> str:
    """Return the name of the nose site in the compiled model."""
    return arm.nose_site if arm.nose_body is None else NOSE


def servo_of(model: mujoco.MjModel, joint: str) -> int:
    """Return the actuator index of a joint in the compiled model."""
    at_joint = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    return int(np.flatnonzero(at_joint & (model.actuator_trnid[:, 0] == model.joint(joint).id))[0])


def _add_backlash(spec: Any, arm: Arm) -> None:
    half_rad = math.radians(arm.backlash_deg) / 2
    for body in spec.bodies:
        for joint in list(body.joints):
            if half_rad > 0 and joint.name in arm.names and joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                body.add_joint(
                    name=f"{joint.name}_play", axis=joint.axis, range=[-half_rad, half_rad], limited=True,
                    damping=[0.01, 0, 0], armature=0.002, frictionloss=0.0,
                )  # fmt: skip


def _add_servos(spec: Any, arm: Arm) -> None:
    """Add a position servo to every joint without one: URDF files have no actuators. Gravity is then compensated, as such arms do it."""
    missing = [name for name in arm.all_names if not _has_servo(spec, name)]
    if not missing:
        return
    for name in missing:
        for actuator in [a for a in spec.actuators if a.target == name]:
            spec.delete(actuator)
    model = spec.copy().compile()
    inertia = _inertia(model, arm)
    for name in missing:
        dof = model.joint(name).dofadr[0]
        kp = inertia[name] * SERVO_RAD_S**2 + model.dof_damping[dof] * SERVO_RAD_S + model.dof_frictionloss[dof] / SERVO_ERROR
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=kp, kv=2.0 * SERVO_DAMPING * inertia[name] * SERVO_RAD_S)
    for body in spec.bodies[1:]:
        body.gravcomp = 1.0
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # the arm itself is the only thing to touch


def _has_servo(spec: Any, joint: str) -> bool:
    """Whether the joint has one actuator that holds a position, force = kp (ctrl - q) - kv dq."""
    actuators = [a for a in spec.actuators if a.target == joint]
    return len(actuators) == 1 and actuators[0].gainprm[0] > 0 and actuators[0].biasprm[1] == -actuators[0].gainprm[0]


def _inertia(model: mujoco.MjModel, arm: Arm) -> dict[str, float]:
    """Inertia of each joint [kg m^2, or kg] with the arm at home."""
    data = mujoco.MjData(model)
    for name, q in zip(arm.all_names, arm.home_rad, strict=True):
        data.joint(name).qpos = q
    mujoco.mj_forward(model, data)
    inertia = {}
    for name in arm.all_names:
        unit, column, i = np.zeros(model.nv), np.zeros(model.nv), model.joint(name).dofadr[0]
        unit[i] = 1.0
        mujoco.mj_mulM(model, data, column, unit)
        inertia[name] = float(column[i])
    return inertia
