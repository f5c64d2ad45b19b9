"""Drivers of gas sensors, one per file; `port.NosePort` says which one is at which port.

May import: `hardware.transport`, `hardware.codecs`, `oio.core`. May not import: servos, valves, worlds.
"""
