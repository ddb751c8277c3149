"""Pictures of measured and of corrected frames, whose true temperature is not known."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Final, Protocol, TypeAlias

import numpy as np
import xarray as xr

from chipglow.app.controls import (
    CORRECTING,
    PSF_FILE,
    REFERENCES,
    WHOLE,
    Controls,
    ShownStudy,
    State,
)
from chipglow.app.pictures import (
    Corrected,
    Panel,
    Picture,
    around_cursor,
    crossings_of,
    error_panel,
    error_title,
    lines_of,
    measured_panel,
    nearest_time,
    pixel_at,
    unflagged,
    values_at,
    with_correction,
)
from chipglow.camera import MeasuredPSFFile, Measurement, PSFChoice
from chipglow.camera.exposure_kernels import Check
from chipglow.correction import Correction
from chipglow.correction.zones import covers_a_pixel
from chipglow.laboratory.chip.tool_choice import with_chosen_tool
from chipglow.laboratory.emissivity import (
    EmissivityLine,
    PlacesDescription,
    StoredEmissivities,
    doubts,
    reflected_temperature,
)
from chipglow.laboratory.emissivity.places import ELSEWHERE, TOOL, KnownEmissivity
from chipglow.quantities import Array
from chipglow.quantities.units import COLDEST
from chipglow.scene import Raster, Region, Tool
from chipglow.scene.regions import named_value
from chipglow.study.measured_corrections import correct_measured, misfit_notes
from chipglow.text import Notes

REFERENCE: Final = "reference_temperature"
"""Variable of a measurement that the app saved: the reference of its pixels in K."""

_KEPT: Final = 8
"""Corrections that a page keeps."""

KnownRegions: TypeAlias = Mapping[Region, KnownEmissivity | None]
"""Regions of an image and their emissivities; None: not stated, or by a file."""


class _FramesModel(ABC):
    """Frames whose true temperature is not known."""

    coarse: ClassVar[None] = None

    @property
    @abstractmethod
    def images(self) -> tuple[str, ...]:
        """Names of the images."""

    def shown(self, state: State) -> tuple[str, ...]:
        """Return the names of the images at a state: always all."""
        return self.images

    def needs(self, state: State) -> str:
        """Return what a correction still needs, in words; empty if nothing."""
        return ""

    @property
    @abstractmethod
    def times(self) -> Array:
        """Times of the frames in s."""

    @property
    @abstractmethod
    def raster(self) -> Raster:
        """Grid of the pixels."""

    @abstractmethod
    def kelvins(self, index: int) -> Array:
        """Return the radiance temperature of a frame in K, shape (y, x); NaN out of range."""

    def frames(self, state: State) -> "_FramesModel":
        """Return the frames, which do not depend on the state."""
        return self

    def frame(self, state: State) -> int:
        """Return the index of the frame that began nearest to the state's start."""
        return nearest_time(self.times, state)

    def contributions(self, picture: Picture, check: Check) -> dict[str, float]:
        """Return nothing: an error is not known without the truth."""
        return {}


class MeasuredFrames(Protocol):
    """Frames of a measurement, each read when it is asked for."""

    first: Measurement
    times: Array

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""

    def measurement(self, index: int) -> Measurement:
        """Return one frame."""


@dataclass(eq=False)
class MeasurementModel(_FramesModel):
    """Frames of a measurement, their controls, and pictures; each session has a copy."""

    name: str
    measured: MeasuredFrames
    controls: Controls
    description: str = ""
    """YAML of a camera file's settings."""
    source: str = ""
    """The file as a session names it."""
    places: PlacesDescription | None = None
    """Places and view of the session that was opened."""
    regions: KnownRegions = field(default_factory=dict)
    """Regions of the page."""
    _last: dict[int, tuple[xr.Dataset, dict[str, Panel], str]] = field(
        init=False, default_factory=dict, repr=False
    )
    _corrected: dict[Hashable, Corrected] = field(init=False, default_factory=dict, repr=False)

    @property
    def times(self) -> Array:
        return self.measured.times

    @property
    def raster(self) -> Raster:
        return self.measured.first.raster

    @property
    def tool(self) -> Tool | None:
        return self.measured.first.tool

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""
        return self.measured.notes

    def kelvins(self, index: int) -> Array:
        return np.asarray(self.measured.measurement(index).radiance_temperature()[0])

    @property
    def images(self) -> tuple[str, ...]:
        """Names of the images."""
        error = ("error",) if REFERENCE in self.measured.first.data else ()
        return ("measured", "corrected", "half_width", *error)

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return the frame that began nearest to the state's start."""
        data, panels, label = self._shown(self.frame(state))
        raster = self.raster
        picture = Picture(
            state, raster, data, panels, lines_of(state, raster, data),
            crossings_of(state, self.tool), reference=label,
        )  # fmt: skip
        known = self._corrected.get(self._key(state))
        return with_correction(picture, known, ("corrected", "half_width"))

    def _shown(self, index: int) -> tuple[xr.Dataset, dict[str, Panel], str]:
        """Return data and images of a frame, the last one again, and the label of its reference."""
        if index in self._last:
            return self._last[index]
        measurement = self.measured.measurement(index)
        raster, reference = measurement.raster, measurement.data.get(REFERENCE)
        # The error is stated of pixels out of range too, as it is for a scene.
        measured = measurement.radiance_temperature(flagged=reference is not None)[0]
        images, label = {"measured": measured, "flagged": ~measurement.usable[0]}, ""
        if reference is not None:
            images["reference"] = reference[0].values
            images["case_1"] = measured - images["reference"]
            label = REFERENCES.get(str(reference.attrs.get("reference")), "reference")
        data = xr.Dataset({name: (("y", "x"), image) for name, image in images.items()})
        panels = {"measured": measured_panel(data, raster)}
        if reference is not None:
            values = unflagged(data, data["case_1"])
            panels["error"] = error_panel(error_title(label), values, raster)
        self._last = {index: (data, panels, label)}
        return self._last[index]

    def needs(self, state: State) -> str:
        """Return what a correction still needs, in words; empty if nothing."""
        study, band = state.study, "band_lower" in self.measured.first.data.attrs
        stored = self.controls.emissivities(study)
        emissivity = "the emissivity"
        if stored is not None:
            names = ", ".join(stored.lines)
            emissivity += f", a region or Elsewhere with a name of its file ({names})"
        unknown = study.emissivity is None and study.named_elsewhere is None
        missing = {
            emissivity: unknown and not self.zones(study),
            "the PSF file": study.psf_source == PSF_FILE and study.psf_file is None,
            "the point spread function (PSF)": study.psf_source != PSF_FILE
            and study.camera.psf is None,
            "the camera's band": not band,
        }
        return " and ".join(name for name, is_missing in missing.items() if is_missing)

    def zones(self, study: ShownStudy) -> KnownRegions:
        """Return the regions that a correction distinguishes: those with an emissivity."""
        stored = self.controls.emissivities(study)
        lines = {} if stored is None else stored.lines
        return {
            region: known
            for region, known in self.regions.items()
            if known is not None or named_value(lines, region) is not None
        }

    def corrected(self, picture: Picture, check: Callable[[float], None]) -> Picture:
        """Return a picture with the corrected image; `check` takes the completed fraction."""
        state, study = picture.state, picture.state.study
        measurement = self.measured.measurement(self.frame(state))
        measurement, notes, found = with_chosen_tool(measurement, study.tool)
        stated = study.outline_uncertainty
        rows, columns = self._part(state)
        zones, stored = self.zones(study), self.controls.emissivities(study)
        regions = [one for one in zones if one.mask(self.raster)[rows, columns].any()]
        part = measurement.part(rows=rows, columns=columns)
        tool = part.tool
        if tool is not None and not covers_a_pixel(tool, part.raster):
            tool = None
        lines = _emissivities(study, {one: zones[one] for one in regions}, stored, tool)
        elsewhere = study.named_elsewhere
        if not regions and not {elsewhere or ELSEWHERE, TOOL} & lines.keys():
            raise ValueError(
                "no region with an emissivity reaches the corrected part: move the cursor, or set "
                "Part or Emissivity"
            )
        result = correct_measured(
            part,
            psf_of(study),
            lines,
            regions,
            tool,
            elsewhere=elsewhere,
            surroundings=reflected_temperature(
                COLDEST if study.camera.reflected is None else study.camera.reflected,
                study.reflected_uncertainty,
            ),
            psf_uncertainty=study.psf_uncertainty,
            outline_uncertainty=found if stated is None else stated,
            progress=check,
        )
        origin = None if stored is None else stored.origin
        result = result.with_notes(notes + misfit_notes(result) + doubts(origin, [part]))
        self._corrected[self._key(state)] = Corrected(result)
        while len(self._corrected) > _KEPT:
            del self._corrected[next(iter(self._corrected))]
        return self.picture(state)

    def _part(self, state: State) -> tuple[slice, slice]:
        size = state.study.corrected_part
        if size == WHOLE:
            rows, columns = self.raster.shape
            return slice(0, rows), slice(0, columns)
        return around_cursor(state, self.raster, int(size) // 2)

    def _key(self, state: State) -> Hashable:
        rows, columns = self._part(state)
        zones = tuple(self.zones(state.study).items())
        stored = self.controls.emissivities(state.study)
        where = self.frame(state), rows.start, columns.start
        return state.key(*CORRECTING), zones, stored, where

    def measurement_of(self, picture: Picture) -> Measurement:
        """Return the frame of a picture."""
        return self.measured.measurement(self.frame(picture.state))

    def numbers(self, picture: Picture) -> dict[str, float]:
        """Return the numbers at the cursor in K, with the calibration's uncertainty if known."""
        numbers = values_at(picture.data, picture.raster, picture.state.cursor)
        frame = self.measured.measurement(self.frame(picture.state))
        if frame.calibration_errors is not None:
            row, column = pixel_at(picture.raster, picture.state.cursor)
            pixel = frame.part(rows=slice(row, row + 1), columns=slice(column, column + 1))
            values = np.full((1, 1, 1), numbers["measured"])
            estimate = pixel.estimate(values, pixel.calibration_effects(0)[None])
            numbers["uncertainty"] = float(estimate.standard_uncertainty[0, 0, 0])
        return numbers


def psf_of(study: ShownStudy) -> PSFChoice:
    """Return the point spread function of a page's controls; there must be one."""
    if study.psf_source == PSF_FILE:
        return MeasuredPSFFile(str(study.psf_file))
    assert study.camera.psf is not None
    return study.camera.psf


def _emissivities(
    study: ShownStudy, zones: KnownRegions, stored: StoredEmissivities | None, tool: Tool | None
) -> dict[str, EmissivityLine]:
    """Return the emissivities of regions, of the tool, and elsewhere, by their names."""
    lines = {} if stored is None else dict(stored.lines)
    if study.emissivity is not None:
        line = EmissivityLine.constant(study.emissivity, study.emissivity_uncertainty)
        lines = {TOOL: line} | lines | {ELSEWHERE: line}
    lines |= {region.name: known.line() for region, known in zones.items() if known is not None}
    if study.tool_emissivity is not None:
        own = study.tool_emissivity_uncertainty
        lines[TOOL] = EmissivityLine.constant(study.tool_emissivity, own)
    if tool is None:
        lines.pop(TOOL, None)
    return lines


@dataclass(eq=False)
class CorrectionModel(_FramesModel):
    """A correction that `chipglow correct` wrote, its controls, and its frames as pictures."""

    name: str
    correction: Correction
    controls: Controls
    source: str = ""
    """The file as a session names it."""
    places: PlacesDescription | None = None
    """Places and view of the session that was opened."""
    tool: ClassVar[None] = None
    _last: dict[int, tuple[Corrected, xr.Dataset, Panel]] = field(
        init=False, default_factory=dict, repr=False
    )

    @property
    def raster(self) -> Raster:
        return self.correction.raster

    @property
    def images(self) -> tuple[str, ...]:
        """Names of the images."""
        return ("measured", "corrected", "half_width")

    @property
    def times(self) -> Array:
        return np.asarray(self.correction.data["time"].values, np.float64)

    def kelvins(self, index: int) -> Array:
        return np.asarray(self.correction.data["measured"][index].values, np.float64)

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""
        return self.correction.notes

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return the frame that began nearest to the state's start."""
        raster, index = self.raster, self.frame(state)
        if index not in self._last:
            corrected = Corrected(self.correction, frame=index)
            measured = corrected.data["measured"].values
            data = xr.Dataset(
                {"measured": (("y", "x"), measured), "flagged": (("y", "x"), np.isnan(measured))}
            )
            self._last = {index: (corrected, data, measured_panel(data, raster))}
        corrected, data, panel = self._last[index]
        picture = Picture(
            state, raster, data, {"measured": panel}, lines_of(state, raster, data), {},
            corrected=corrected,
        )  # fmt: skip
        return with_correction(picture, corrected, ("corrected", "half_width"))

    def measurement_of(self, picture: Picture) -> None:
        """Return nothing: a correction states no radiance."""

    def numbers(self, picture: Picture) -> dict[str, float]:
        """Return the measured temperature at the cursor in K."""
        return values_at(picture.data, picture.raster, picture.state.cursor)
