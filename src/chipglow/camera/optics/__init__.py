"""Effects of the optics and the detector elements on a radiance image."""
