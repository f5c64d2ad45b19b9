"""What lies between a driver and its device: a port that is discovered and opened, a clock, requests, a bounded mailbox, reconnection.

May import: `oio.core`, `hardware.codecs`. May not import: a driver or a world.
"""
