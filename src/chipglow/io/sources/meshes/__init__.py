"""Meshes: files of finite elements, and their fields on the samples of a raster."""
