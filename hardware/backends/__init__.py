"""Worlds: each backend joins sensor, arm and air, and only `open()` makes it live."""
