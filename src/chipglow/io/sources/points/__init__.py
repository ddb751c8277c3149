"""Scattered points: their files, and their fields on the samples of a raster."""
