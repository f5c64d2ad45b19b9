"""Emulated devices: they answer on the real wire protocols, with the simulated bench behind them, and need no change to a driver.

May import: `hardware.codecs`, `hardware.backends.mujoco_sim`, `hardware.simulation`, `oio`. May not import: drivers, transport.
"""
