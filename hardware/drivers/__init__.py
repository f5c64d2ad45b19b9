"""Drivers of real devices: `noses` (gas sensors), `valves`; arms of `servos`, arms that others command (`robots`), both on `arms`.

Each family has its protocol and its settings, in `port.py` or, for all arms, `arm_port.py`.

May import: `hardware.transport`, `hardware.codecs`, `oio`. May not import: worlds, simulation, emulators.
"""
