"""Gas sensing models: bouts (eq. 1), whiffs, range law, fluctuation, censored readings, traces, source placement, stamp delay.

May import: `oio.core`, `oio.kinematics`. May not import: estimation (`oio.inference` and above) or motion.
"""
