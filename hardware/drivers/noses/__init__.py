"""Drivers of gas sensors, one per file; `port.NosePort` selects the driver and its port.

May import: `hardware.transport`, `hardware.codecs`, `oio.core`. May not import: servos, valves, worlds.
"""
