"""What gas does to readings: bouts (eq. 1), detection of whiffs, the range law, fluctuation, censored readings, traces, sources, timing.

May import: `oio.core`, `oio.kinematics`. May not import: estimation (`oio.inference` and above) or motion.
"""
