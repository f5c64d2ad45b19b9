"""Layer between driver and device: port discovery and opening, clocks, request and reply, bounded sample queues, reconnection.

May import: `oio.core`, `hardware.codecs`. May not import: a driver or a world.
"""
