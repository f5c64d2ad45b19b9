"""Checks of serial ports for `python -m oio.doctor`, without opening one: that resets an Arduino. conf/doctor.yaml lists them.

May import: `oio.doctor`, `hardware.transport` and below. May not import: drivers, worlds, emulators.
"""
