"""Numbers that sentences and captions of a report state, and summary.json does not; in SI."""

from collections.abc import Mapping
from math import nan
from typing import Final, NamedTuple

import numpy as np

from chipglow.analysis import Analysis, Cut, image_error, line_change, line_error, line_steepest
from chipglow.scene import Material

_WEAK_SEGMENTATION: Final = 0.15
"""Degree of segmentation below which the report calls a chip weakly segmented."""

_SQUARE: Final = 3
"""Pixels along the side of a square whose mean a profile at the rake face shows."""


class Range(NamedTuple):
    """The smallest and the largest of some values."""

    lowest: float
    highest: float


class Sides(NamedTuple):
    """A number on either side of the shear band."""

    workpiece: float
    chip: float


class Quoted:
    """An analysis as texts quote it, by the names that they use."""

    def __init__(self, analysis: Analysis) -> None:
        self._analysis, self._data = analysis, analysis.data

    @property
    def _cut(self) -> Cut:
        assert self._analysis.cut is not None
        return self._analysis.cut

    # The images

    @property
    def hottest(self) -> float:
        """Highest temperature of the scene's material in K."""
        there = self._data.material != Material.VOID
        return float(self._data.temperature.where(there).max())

    @property
    def hottest_measured(self) -> float:
        """Highest radiance temperature in the shown exposure in K."""
        shown = self._data.isel(instant=self._data.attrs["shown_instant"])
        return float(shown.radiance_temperature.max())

    @property
    def flagged_fraction(self) -> float:
        """Fraction of the pixels that are outside the range of the camera."""
        return float(self._data.flagged.mean())

    @property
    def lowest_errors(self) -> Mapping[str, float]:
        """The most negative error in K of a pixel that is not flagged, by the surface."""
        errors = image_error(self._data).where(self._data.flagged == 0)
        return {
            str(name): float(errors.sel(surface=name).min()) for name in self._data.surface.values
        }

    def set_emissivity(self, surface: str) -> float:
        """Return the emissivity of a surface that a user sets in the camera."""
        return float(self._data.set_emissivity.sel(surface=surface))

    # The rake face

    @property
    def rake_square(self) -> float:
        """Side in m of a square of pixels whose mean is shown along the rake face."""
        return _SQUARE * self._analysis.camera.pitch

    @property
    def change_across_rake(self) -> float:
        """Change of the radiance temperature in K from a pixel in the chip to one in the tool."""
        pitch = self._analysis.camera.pitch
        return line_change(self._data, "rake", pitch, -pitch)

    @property
    def contact_error(self) -> Range:
        """Range of the error in K along the contact in the first draw."""
        error = line_error(self._data, "contact")[0, 0, 0]
        return Range(float(error.min()), float(error.max()))

    @property
    def heated_tool_emissivity(self) -> float:
        """Mean emissivity that is found of the heated tool."""
        return self._cut.heated[-1].rows[0].found.mean

    # The shear band

    @property
    def band_travel(self) -> float:
        """Mean travel in m of the segments' bands across the ridge; NaN if one is unknown."""
        return float(np.mean([segment.sweep for segment in self._cut.segments]))

    @property
    def band_width_over_psf(self) -> float:
        """Width of the band over that of the PSF; NaN without a PSF or a known width."""
        psf = self._analysis.camera.psf
        return nan if psf is None else self._cut.band_width / psf.fwhm

    @property
    def middle_rate(self) -> float:
        """Median over the segments in 1/s of the strain rate on the middle half of the band."""
        return float(np.median([segment.moment.middle_rate for segment in self._cut.segments]))

    @property
    def beside_band(self) -> Sides:
        """Mean over the draws of the most negative error in K on either side of the ridge."""
        error = line_error(self._data, "band")
        workpiece = error.where(error.distance <= 0).min("point")
        chip = error.where(error.distance >= 0).min("point")
        return Sides(float(workpiece.mean()), float(chip.mean()))

    @property
    def steepest_at_band(self) -> float:
        """Largest change of the radiance temperature in K over one pixel across the band."""
        return line_steepest(self._data, "band", self._analysis.camera.pitch)

    @property
    def is_weakly_segmented(self) -> bool:
        """Whether the degree of segmentation over the cut is small."""
        forces = self._cut.forces
        return forces is not None and forces.history.segmentation.degree < _WEAK_SEGMENTATION
