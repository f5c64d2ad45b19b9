"""Pure codecs of the wires: bytes in, values out; no port, no time, no threads."""
