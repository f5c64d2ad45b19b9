"""Drivers of gas valves: a person who is asked, relays of a microcontroller, or none; `port.ValvePort` chooses.

May import: `hardware.transport`, `hardware.codecs`, `oio.core`. May not import: noses, servos, worlds.
"""
