"""Pure codecs of the wires: bytes in, values out, faults counted.

May import: the standard library. May not import: `oio`, a port, a clock or a thread.
"""
