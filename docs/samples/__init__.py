"""Scenes and images that the samples, the examples and the pictures of the pages share."""
