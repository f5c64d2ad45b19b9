"""Drivers of servo arms: a bus per maker, one arm over any bus; `port.ArmPort` says which one is at which port.

May import: `hardware.transport`, `hardware.codecs`, `oio`. May not import: noses, valves, worlds.
"""
