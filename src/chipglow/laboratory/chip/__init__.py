"""The chip: rake face, shear band and segments, in scenes and in measurements."""

from chipglow.laboratory.chip.band_profile import (
    BandProfile as BandProfile,
    Stage as Stage,
    band_profile as band_profile,
)
from chipglow.laboratory.chip.band_ridge import ThermalImage as ThermalImage, find_band as find_band
from chipglow.laboratory.chip.command_inputs import (
    chosen_tool as chosen_tool,
    load_tool as load_tool,
    read_curve as read_curve,
)
from chipglow.laboratory.chip.find_tool import FoundTool as FoundTool, find_tool as find_tool
from chipglow.laboratory.chip.metrics import (
    ChipMetrics as ChipMetrics,
    ChipScan as ChipScan,
    chip_metrics as chip_metrics,
)
from chipglow.laboratory.chip.rake_grid import RakeGrid as RakeGrid, rake_grid as rake_grid
from chipglow.laboratory.chip.ridge import NoShearBandError as NoShearBandError
from chipglow.laboratory.chip.segment import (
    Instant as Instant,
    NoContactError as NoContactError,
    Segment as Segment,
    contact_length as contact_length,
)
from chipglow.laboratory.chip.segmentation import (
    CutHistory as CutHistory,
    Inertia as Inertia,
    Segmentation as Segmentation,
    cut_history as cut_history,
    inertia as inertia,
    resolution_warnings as resolution_warnings,
    segmentation as segmentation,
)
from chipglow.laboratory.chip.shear_band import (
    ShearBand as ShearBand,
    find_shear_band as find_shear_band,
)
from chipglow.laboratory.chip.tool_position import (
    ToolUncertainty as ToolUncertainty,
    tool_of as tool_of,
)
