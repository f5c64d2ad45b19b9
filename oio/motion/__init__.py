"""Moving safely: path planning in joint space, the trajectory with its clock, the guard in front of every arm, load limits of servos.

May import: `oio.core`, `oio.kinematics`. May not import: gas, inference, a device or a clock of its own.
"""
