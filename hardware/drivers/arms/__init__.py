"""What every arm that is commanded in real time has, whatever commands it: guard, tracking error, control cycle, the fixed mount.

May import: `hardware.transport`, `oio`. May not import: a driver of servos, robots, noses or valves, worlds.
"""
