from .band import BandReading as BandReading, band_reading as band_reading
from .budgets import StudyBudget as StudyBudget, study_budget as study_budget
from .cache import (
    CachedScene as CachedScene,
    cache_folder as cache_folder,
    cached_scenes as cached_scenes,
    clear_cache as clear_cache,
)
from .corrected import (
    CorrectedTemperature as CorrectedTemperature,
    corrected_temperatures as corrected_temperatures,
)
from .corrections import correct_study as correct_study
from .cost import check_cost as check_cost, check_view as check_view, expected_cost as expected_cost
from .designs import Design as Design, design as design
from .files import load_study as load_study, study_text as study_text
from .fitting import Fitted as Fitted, fit as fit
from .preview import preview_raster as preview_raster
from .running import (
    Progress as Progress,
    cut as cut,
    errors as errors,
    is_cut as is_cut,
    is_damaged as is_damaged,
    kept_progress as kept_progress,
    run as run,
    wavelengths as wavelengths,
)
from .schema import Study as Study
from .sweeps import Method as Method, Sweep as Sweep, sweep as sweep
