"""Devices that speak the real wire with the simulated bench behind them: they fake the wire, never the driver.

May import: `hardware.codecs`, `hardware.backends.mujoco_sim`, `hardware.simulation`, `oio`. May not import: drivers, transport.
"""
