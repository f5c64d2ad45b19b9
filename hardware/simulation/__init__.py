"""Simulated bench: plant (MuJoCo arm, air, sensor), encoders with drift, sensor specimens with spread, lag and noise.

May import: `oio`. May not import: `hardware.sensors`, the filter's models, a device, a clock.
"""
