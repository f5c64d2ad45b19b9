"""Things: sensors, arms, air, recordings, and the backends that join them into a world."""
