"""The chip: rake face, shear band and segments, in scenes and in measurements."""

from chipglow.laboratory.chip.band_profile import BandProfile, Stage, band_profile
from chipglow.laboratory.chip.band_ridge import ThermalImage, find_band
from chipglow.laboratory.chip.command_inputs import ChosenTool, chosen_tool, load_tool, read_curve
from chipglow.laboratory.chip.find_tool import FoundTool, find_tool
from chipglow.laboratory.chip.inertia import Inertia, inertia, resolution_warnings
from chipglow.laboratory.chip.metrics import ChipMetrics, ChipScan, chip_metrics
from chipglow.laboratory.chip.rake_grid import RakeGrid, rake_grid
from chipglow.laboratory.chip.ridge import NoShearBandError
from chipglow.laboratory.chip.segment import (
    Instant,
    NoContactError,
    Segment,
    contact_length,
    contact_temperatures,
)
from chipglow.laboratory.chip.segmentation import Segmentation, segmentation
from chipglow.laboratory.chip.shear_band import ShearBand, find_shear_band
from chipglow.laboratory.chip.tool_position import ToolUncertainty, tool_of

__all__ = [
    "BandProfile",
    "ChipMetrics",
    "ChipScan",
    "ChosenTool",
    "FoundTool",
    "Inertia",
    "Instant",
    "NoContactError",
    "NoShearBandError",
    "RakeGrid",
    "Segment",
    "Segmentation",
    "ShearBand",
    "Stage",
    "ThermalImage",
    "ToolUncertainty",
    "band_profile",
    "chip_metrics",
    "chosen_tool",
    "contact_length",
    "contact_temperatures",
    "find_band",
    "find_shear_band",
    "find_tool",
    "inertia",
    "load_tool",
    "rake_grid",
    "read_curve",
    "resolution_warnings",
    "segmentation",
    "tool_of",
]
