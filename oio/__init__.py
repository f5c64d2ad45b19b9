"""Olfactory inertial odometry: calibrate a gas sensor on a robot arm, and find a smell to the centimetre."""

__version__ = "0.1.0"
