"""Readers of other people's fields: meshes, grids, point clouds and movies."""

from chipglow.io.sources.conventions import (
    CELSIUS,
    COMMON_NAMES,
    SI,
    Placement,
    Unit,
    Units,
    match_names,
)
from chipglow.io.sources.source import Source, SourceError, Survey

__all__ = [
    "CELSIUS",
    "COMMON_NAMES",
    "SI",
    "Placement",
    "Source",
    "SourceError",
    "Survey",
    "Unit",
    "Units",
    "match_names",
]
