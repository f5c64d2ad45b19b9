"""Devices and worlds: sensors, arms, air, recordings, and the backends that combine them into a world.

May import: `oio`. May not import: `pipelines`. Commands: `python -m hardware.emulate`, `hardware.ports`, `hardware.home`.
"""
