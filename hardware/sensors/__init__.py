"""Gas sensor models, one transduction principle per file: raw to ppm and back, timing, noise.

May import: `oio.core`, `hardware.simulation.specimen`. May not import: drivers, worlds, the filter's models.
"""
