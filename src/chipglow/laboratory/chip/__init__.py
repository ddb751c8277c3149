"""The chip: rake face, shear band and segments, in scenes and in measurements."""

from chipglow.laboratory.chip.band_profile import BandProfile, Stage, band_profile
from chipglow.laboratory.chip.band_ridge import ThermalImage, find_band
from chipglow.laboratory.chip.chosen_tool import ChosenTool, chosen_tool
from chipglow.laboratory.chip.contact import NoContactError, contact_length, contact_temperatures
from chipglow.laboratory.chip.curve_file import read_curve
from chipglow.laboratory.chip.find_tool import FoundTool, find_tool
from chipglow.laboratory.chip.inertia import Inertia, inertia
from chipglow.laboratory.chip.metrics import ChipMetrics, ChipScan, chip_metrics
from chipglow.laboratory.chip.rake_grid import RakeGrid, rake_grid
from chipglow.laboratory.chip.resolution import resolution_warnings
from chipglow.laboratory.chip.ridge import NoShearBandError
from chipglow.laboratory.chip.segment import Instant, Segment
from chipglow.laboratory.chip.segmentation import Segmentation, segmentation
from chipglow.laboratory.chip.shear_band import ShearBand, find_shear_band
from chipglow.laboratory.chip.tool_description import load_tool, tool_of
from chipglow.laboratory.chip.tool_position import ToolUncertainty

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
