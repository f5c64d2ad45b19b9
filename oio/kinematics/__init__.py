"""The arm as geometry: model loading (MJCF, URDF), forward and inverse kinematics, Jacobians, adjoints, homing of encoders.

May import: `oio.core`. May not import: anything that moves, smells or estimates. MuJoCo is used by `model_loading` alone.
"""
