"""The virtual camera's error against its scene: images, places, distributions, causes."""

from chipglow.analysis.attribution import AttributionPlan as AttributionPlan, attribute as attribute
from chipglow.analysis.corrected import (
    CorrectedPlace as CorrectedPlace,
    CorrectedWindow as CorrectedWindow,
    CorrectionPlan as CorrectionPlan,
)
from chipglow.analysis.cut import (
    Cut as Cut,
    CuttingForces as CuttingForces,
    Progress as Progress,
    lacking as lacking,
    spread_starts as spread_starts,
)
from chipglow.analysis.distribution import (
    Distribution as Distribution,
    VarianceComponent as VarianceComponent,
)
from chipglow.analysis.engine import Analysis as Analysis, analyse as analyse
from chipglow.analysis.heated import HeatedObject as HeatedObject, HeatedRow as HeatedRow
from chipglow.analysis.images import (
    ALL as ALL,
    CASES as CASES,
    error_images as error_images,
    error_parts as error_parts,
)
from chipglow.analysis.outside import (
    outside_texts as outside_texts,
    outside_warnings as outside_warnings,
)
from chipglow.analysis.places import (
    BandPlace as BandPlace,
    HottestPlace as HottestPlace,
    LinePlace as LinePlace,
    Place as Place,
    PointPlace as PointPlace,
    RakePlace as RakePlace,
    RegionPlace as RegionPlace,
)
from chipglow.analysis.plan import Plan as Plan
from chipglow.analysis.ratio import (
    CAUSES as CAUSES,
    RatioPair as RatioPair,
    ratio_errors as ratio_errors,
)
from chipglow.analysis.reductions import (
    Headline as Headline,
    ReadingErrors as ReadingErrors,
    headline as headline,
    headlines as headlines,
    image_error as image_error,
    image_psf_portion as image_psf_portion,
    line_change as line_change,
    line_error as line_error,
    line_psf_portion as line_psf_portion,
    line_steepest as line_steepest,
    one_draw as one_draw,
    readings_frame as readings_frame,
    sensitivity_error as sensitivity_error,
    sensitivity_psf_fraction as sensitivity_psf_fraction,
    with_errors as with_errors,
)
from chipglow.analysis.single import SingleReadings as SingleReadings
from chipglow.analysis.wavelengths import (
    Spot as Spot,
    WavelengthPlan as WavelengthPlan,
    cut_spots as cut_spots,
    point_spots as point_spots,
    wavelength_errors as wavelength_errors,
    wavelengths_frame as wavelengths_frame,
)
