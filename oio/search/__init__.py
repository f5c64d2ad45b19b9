"""Where to move the nose next: one strategy per file. A strategy is frozen; all it may know is in a `View`."""
