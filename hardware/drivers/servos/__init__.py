"""Drivers of servo arms: one bus per maker, one arm over any bus; `port.ArmPort` selects the driver and its port.

May import: `hardware.transport`, `hardware.codecs`, `oio`. May not import: noses, valves, worlds.
"""
