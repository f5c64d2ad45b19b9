"""Drivers of gas valves: an operator who is prompted, relays of a microcontroller, or none; `port.ValvePort` selects one.

May import: `hardware.transport`, `hardware.codecs`, `oio.core`. May not import: noses, servos, worlds.
"""
