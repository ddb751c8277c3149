"""The chip of a simulation: its shear band, its segments and the metrics of a cut."""

from chipglow.chip.metrics import (
    ChipMetrics as ChipMetrics,
    ChipScan as ChipScan,
    chip_metrics as chip_metrics,
)
from chipglow.chip.ridge import NoShearBandError as NoShearBandError
from chipglow.chip.segment import (
    Instant as Instant,
    NoContactError as NoContactError,
    Segment as Segment,
    contact_length as contact_length,
)
from chipglow.chip.segmentation import (
    CutHistory as CutHistory,
    Inertia as Inertia,
    Segmentation as Segmentation,
    cut_history as cut_history,
    inertia as inertia,
    resolution_warnings as resolution_warnings,
    segmentation as segmentation,
)
from chipglow.chip.shear_band import (
    ShearBand as ShearBand,
    find_shear_band as find_shear_band,
    first_crossing as first_crossing,
)
