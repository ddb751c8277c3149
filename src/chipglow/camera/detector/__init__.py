"""Effects of the detector: electrons, noise, counts, non-uniformity, and its range."""
