"""Readers of other people's fields: meshes, grids, point clouds and movies."""

from chipglow.io.sources.conventions import COMMON_NAMES, Placement, Units, match_names
from chipglow.io.sources.source import Source, SourceError, Survey

__all__ = ["COMMON_NAMES", "Placement", "Source", "SourceError", "Survey", "Units", "match_names"]
