"""Surfaces: emissivity maps that follow the material."""

from chipglow.surface.surface import EmissivityField, Surface, UniformSurface

__all__ = ["EmissivityField", "Surface", "UniformSurface"]
