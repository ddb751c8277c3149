"""The chip in measured images: rake face, shear band, and the place of the tool."""

from chipglow.laboratory.chip.band_profile import (
    BandProfile as BandProfile,
    band_profile as band_profile,
)
from chipglow.laboratory.chip.band_ridge import ThermalImage as ThermalImage, find_band as find_band
from chipglow.laboratory.chip.find_tool import FoundTool as FoundTool, find_tool as find_tool
from chipglow.laboratory.chip.rake_grid import RakeGrid as RakeGrid, rake_grid as rake_grid
from chipglow.laboratory.chip.stage import Stage as Stage
from chipglow.laboratory.chip.tool_position import (
    ToolUncertainty as ToolUncertainty,
    tool_of as tool_of,
)
