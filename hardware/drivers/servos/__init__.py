"""Drivers of servo arms: one bus per maker, one arm over any bus.

May import: `hardware.drivers.arms`, `hardware.transport`, `hardware.codecs`, `oio`. May not import: robots, noses, valves, worlds.
"""
