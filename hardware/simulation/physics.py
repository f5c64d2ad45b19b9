"""The arm as MuJoCo simulates it: its model file compiled with a backlash joint beside every unlocked hinge."""

import math

import mujoco

from oio.kinematics.arm import Arm


def compiled(arm: Arm) -> tuple[mujoco.MjModel, str]:
    """The compiled model, and its XML for the log."""
    spec = mujoco.MjSpec.from_file(str(arm.path))
    half_rad = math.radians(arm.backlash_deg) / 2
    for body in spec.bodies:
        for joint in list(body.joints):
            if half_rad > 0 and joint.name in arm.names and joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                body.add_joint(
                    name=f"{joint.name}_play", axis=joint.axis, range=[-half_rad, half_rad], limited=True,
                    damping=[0.01, 0, 0], armature=0.002, frictionloss=0.0,
                )  # fmt: skip
    return spec.compile(), spec.to_xml()
