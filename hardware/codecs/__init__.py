"""Pure codecs of the wire protocols: bytes in, values out, faulty frames counted.

May import: the standard library. May not import: `oio`, a port, a clock or a thread.
"""
