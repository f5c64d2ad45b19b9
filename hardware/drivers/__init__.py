"""Drivers of real devices: `noses` (gas sensors), `servos` (arms), `valves`. Each family has its protocol and its settings in `port.py`.

May import: `hardware.transport`, `hardware.codecs`, `oio`. May not import: worlds, simulation, emulators.
"""
