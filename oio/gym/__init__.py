"""Gymnasium environments over the simulated bench: `OIO/Search-v0` and `OIO/Calibrate-v0`; importing this room registers them.

May import: every other room of `oio`, and gymnasium. May not import: `pipelines` or `hardware`; no room may import this one.
"""

from oio.gym.registration import register_environments

register_environments()
