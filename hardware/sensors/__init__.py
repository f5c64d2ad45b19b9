"""One transduction principle per file: frame to raw, raw to ppm and back, lag, noise, drift."""
