"""Comparison of measurement and simulation at the rake face and in the shear band."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, isnan, nan, radians, sqrt
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.camera import Measurement
from chipglow.chip import NoShearBandError
from chipglow.laboratory.chip import (
    BandProfile,
    RakeGrid,
    ThermalImage,
    ToolUncertainty,
    band_profile,
    rake_grid,
)
from chipglow.laboratory.chip.band_profile import CALIBRATION_UNKNOWN, POSITION
from chipglow.laboratory.chip.frames import FRAMES, frame_mean, frame_scatter, linearly_changed
from chipglow.laboratory.chip.rake_grid import DEPTH, PIXELS
from chipglow.laboratory.chip.tool_position import TOOL, contribution
from chipglow.laboratory.comparison.coverage import COVERAGE
from chipglow.quantities import SEED, ZERO_CELSIUS, Array, Brief, Parameter, Part, uncertainty_text
from chipglow.quantities.units import LENGTH, TEMPERATURE_DIFFERENCE
from chipglow.scene import Tool, sample
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Component, Estimate, draw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TIP_REACH: Final = 100e-6
"""Distance from the cutting edge in m within which the paper looks at the band by itself."""

SURE: Final = 0.95
"""Fraction of the draws in which the best set must be best to be called so."""

AGREEING: Final = "values_with_E_n_up_to_1"
"""Column of the number of values that agree."""

_DRAWS: Final = 4000
"""Draws of the errors from which the probability of each simulation follows."""

_FEWEST_VALUES: Final = 3
"""Fewest frames, and fewest places, that can be compared."""

_SAME_ANGLE: Final = radians(0.1)
"""Angle in rad between two rake faces that count as the same, if no uncertainty is stated."""


def normalised_error(measured: Estimate, simulated: Estimate) -> Array:
    """Return E_n = abs(T_sim − T_meas) / U(T_sim − T_meas) (ISO/IEC 17043), k = `COVERAGE`."""
    away = simulated - measured
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.abs(away.values) / (COVERAGE * away.standard_uncertainty)


@dataclass(frozen=True, repr=False)
class Readings(Brief):
    """Temperatures of the measurement and of each simulation, at the same positions."""

    place: str
    distance: Array
    """Distance up the rake face, or from the cutting edge along the band, in m, shape (n,)."""
    measured: Estimate
    simulated: tuple[Estimate, ...]
    """Positions in the shape of `measured`: (n,), or (m, n) with a depth."""
    depth: Array | None = None
    """Depth in the chip in m, shape (m,); None along the band."""

    def to_frame(self, labels: Sequence[str]) -> pd.DataFrame:
        """Return every value of each simulation; one row each."""
        measured, unknown = self.measured, np.full(self.measured.shape, np.nan)
        place = {"along_um": unknown, "depth_um": unknown, "distance_um": unknown + self.distance}
        if self.depth is not None:
            depth, along = np.meshgrid(self.depth, self.distance, indexing="ij")
            place = {"along_um": along, "depth_um": depth, "distance_um": unknown}
        frames = []
        for label, simulated in zip(labels, self.simulated, strict=True):
            columns = {
                **{name: 1e6 * values for name, values in place.items()},
                "measured_degC": measured.values - ZERO_CELSIUS,
                "measured_expanded_K": COVERAGE * measured.standard_uncertainty,
                "simulation": np.full(measured.shape, label, object),
                "simulated_degC": simulated.values - ZERO_CELSIUS,
                "simulated_expanded_K": COVERAGE * simulated.standard_uncertainty,
                "difference_K": simulated.values - measured.values,
                "E_n": normalised_error(measured, simulated),
            }
            flat = {name: np.ravel(values) for name, values in columns.items()}
            frames.append(pd.DataFrame({"place": self.place, **flat}))
        return pd.concat(frames, ignore_index=True)


@dataclass(frozen=True, repr=False)
class Comparison(Brief):
    """A measurement compared with simulations."""

    labels: tuple[str, ...]
    grid: Readings | None
    band: Readings | None
    """Readings at the rake face and along the shear band, where both sides have some."""
    fits: pd.DataFrame
    """Fit of each simulation at each place, one row each. The bias is the mean of simulated minus
    measured; the confidence is the fraction of the draws of all uncertainties in which the
    simulation has the smallest root mean square of the place, NaN with one measured frame.
    """
    notes: Notes

    def to_frame(self) -> pd.DataFrame:
        """Return every value of each simulation; one row each."""
        readings = [one for one in (self.grid, self.band) if one is not None]
        return pd.concat([one.to_frame(self.labels) for one in readings], ignore_index=True)

    def plot(self) -> "Figure":
        """Draw measured and simulated temperatures, and their differences with uncertainties.

        Returns a figure, as it has several panels.
        """
        from chipglow.laboratory.comparison.figure import draw_comparison

        return draw_comparison(self)

    def _repr_html_(self) -> str:
        return result_html("Comparison", self.fits, self.notes)

    @property
    def best(self) -> pd.DataFrame:
        """Fits with the smallest root mean square of each place."""
        return self.fits.loc[self.fits.groupby("place", sort=False)["rms_K"].idxmin()]

    @property
    def sentences(self) -> list[str]:
        """Which simulation fits best, a sentence for each place."""
        places = zip(self.best.iloc, self.fits.groupby("place", sort=False), strict=True)
        return [_sentence(best, fits.drop(index=best.name)) for best, (_, fits) in places]

    @property
    def statement(self) -> str:
        """Which simulation fits best where, in the form of the paper's conclusion."""
        if len(self.labels) == 1:
            agreeing, count = self.fits[[AGREEING, "values"]].sum()
            return f"{self.labels[0]}: {agreeing} of {count} values agree (E_n up to 1)."
        best, parts = self.best, []
        sure = best["confidence"] >= SURE
        for label in self.labels:
            where = best["place"][sure & (best["simulation"] == label)]
            if where.size:
                parts.append(f"{label} fits best {'; '.join(where)}.")
        if not sure.all():
            parts.append(f"The sets cannot be distinguished {'; '.join(best['place'][~sure])}.")
        return " ".join(parts)


def _sentence(best: pd.Series, others: pd.DataFrame) -> str:
    """Return which simulation fits best at a place."""
    place, name = f"{best['place'][0].upper()}{best['place'][1:]},", best["simulation"]
    result = f"{_fit_text(best)} values agree (E_n up to 1)"
    if others.empty:
        return f"{place} {name} is {result}."
    result = "; ".join(
        [result, *(f"{fit['simulation']} is {_fit_text(fit)}" for fit in others.iloc)]
    )
    how = f"in {100 * best['confidence']:.3g} % of the draws of the uncertainties"
    if best["confidence"] >= SURE:
        return f"{place} {name} fits best ({how}): it is {result}."
    if isnan(best["confidence"]):
        how = "but one measured frame does not show how much frames vary"
    nearest = f"({name} is nearest, {how}): {name} is {result}."
    return f"{place} the sets cannot be distinguished {nearest}"


def _fit_text(fit: pd.Series) -> str:
    word = "too hot" if fit["bias_K"] > 0 else "too cold"
    expanded = uncertainty_text(COVERAGE * fit["bias_standard_uncertainty_K"])
    return (
        f"{abs(fit['bias_K']):.0f} K {word} (± {expanded} K), RMS {fit['rms_K']:.0f} K, "
        f"{fit[AGREEING]} of {fit['values']}"
    )


@dataclass(frozen=True)
class StatedUncertainties(Part):
    """Standard uncertainties that the files do not state."""

    temperature: Annotated[
        float,
        Parameter(
            "Uncertainty of the measured radiance temperature, common to all values.",
            TEMPERATURE_DIFFERENCE,
            least=0.0,
        ),
    ] = 0.0
    emissivity: Annotated[
        float, Parameter("Relative uncertainty of the emissivities in the simulations.", least=0.0)
    ] = 0.0
    position: Annotated[
        float | None,
        Parameter(
            "Uncertainty of each measured position, by default of a pixel; for squares at "
            "the rake face only where `tool` is not stated.",
            LENGTH,
            least=0.0,
        ),
    ] = None
    tool: Annotated[
        ToolUncertainty | None,
        Parameter("Uncertainty of the tool's position, common to all measured values."),
    ] = None


def compare(
    measured: Measurement,
    simulated: Mapping[str, Measurement],
    tool: Tool,
    curve: Array | None = None,
    stated: StatedUncertainties | None = None,
    reference: int | None = None,
) -> Comparison:
    """Compare a measurement with simulations.

    Parameters
    ----------
    measured : Measurement
        Frames of the camera.
    simulated : mapping
        Frames of the simulated camera by name, such as one for each set of emissivities. Pitch and
        grid of pixels may differ from the measured ones.
    tool : Tool
        The tool, in the measurement's coordinates. A simulation is placed by its own tool, if any.
    curve : ndarray, optional
        Polyline along which to read the shear band in all files, from the cutting edge outward, in
        the measurement's coordinates in m, shape (k, 2). By default the ridge of each frame.
    stated : StatedUncertainties, optional
        Uncertainties that the files do not state.
    reference : int, optional
        Index of the measured frame whose band is fully developed; see `band_profile`.

    Notes
    -----
    Squares of 3 measured pixels on the rake face are compared, and along the shear band values at
    the same distance from the cutting edge, as means over the frames in which the band is
    developing or fully developed, as in the paper. The best set has the smallest root mean
    square of the differences; its confidence follows from draws of all values.
    """
    if not simulated:
        raise ValueError("comparison: no simulation, expected 1 or more")
    stated = stated or StatedUncertainties()
    if stated.temperature > 0.0 and measured.calibration_errors is not None:
        raise ValueError(
            f"uncertainty: {stated.temperature:g} K beside the uncertainty that the measurement "
            "states, give only one of them"
        )
    notes = Notes()
    if measured.calibration_errors is None and stated.temperature == 0.0:
        notes.warnings.append(
            "The measurement does not state the uncertainty of its calibration and none is given, "
            "so the E_n are too large."
        )
    files = [_File("measured", measured, tool, stated.tool, reference)]
    for label, item in simulated.items():
        files.append(_File(label, item, _tool_of(label, item, files[0], notes)))
    grid = _compare_grid(files, stated, notes)
    band = _compare_band(files, curve, stated, notes)
    fits = _fits(tuple(simulated), grid, band)
    if fits.empty:
        reasons = " ".join(notes.warnings)
        raise ValueError(f"comparison: there is nothing that can be compared: {reasons}")
    return Comparison(tuple(simulated), grid, band, fits, notes)


class _File(NamedTuple):
    """The measurement or a simulation, with its tool."""

    name: str
    item: Measurement
    tool: Tool
    uncertainty: ToolUncertainty | None = None
    reference: int | None = None


def _tool_of(label: str, simulated: Measurement, measured: _File, notes: Notes) -> Tool:
    own = simulated.tool
    if own is None:
        notes.assumed.append(f"{label}: The file states no tool; that of the measurement is used.")
        return measured.tool
    turn = abs(own.rake_angle - measured.tool.rake_angle)
    spread = measured.uncertainty.angle if measured.uncertainty else 0.0
    if turn > max(_SAME_ANGLE, COVERAGE * spread):
        notes.warnings.append(f"The rake angle of {label} differs by {degrees(turn):.2g} degrees.")
    return own


def _compare_grid(
    files: Sequence[_File], stated: StatedUncertainties, notes: Notes
) -> Readings | None:
    """Read the squares of the measurement, which comes first, and of the simulations."""
    size = PIXELS * files[0].item.raster.spacing
    try:
        grids = []
        for one in files:
            pixels, depth = size / one.item.raster.spacing, max(DEPTH, size)
            grids.append(rake_grid(one.item, one.tool, pixels, depth, uncertainty=one.uncertainty))
    except ValueError as error:
        notes.warnings.append(f"The rake face is left out: {error}.")
        return None
    if grids[0].times.size < _FEWEST_VALUES:
        notes.warnings.append(_few_frames("measured", grids[0].times.size))
    columns = min(grid.along.size for grid in grids)
    base, *others = grids
    readings = [
        _assumed(one.item, grid.frame_estimate[:, :columns], stated)
        for one, grid in zip(files[1:], others, strict=True)
    ]
    own = _measured_squares(files[0].item, base, stated)[:, :columns]
    return Readings("rake face", base.along[:columns], own, tuple(readings), base.depth)


def _measured_squares(
    measured: Measurement, grid: RakeGrid, stated: StatedUncertainties
) -> Estimate:
    found = grid.frame_estimate.with_component("stated", stated.temperature)
    if stated.tool is not None and stated.position is None:
        return found
    corners = grid.corners()
    middles = (corners[1:, 1:] + corners[:-1, :-1]) / 2
    images = [_image(measured, k) for k in range(measured.times.size)]
    image = np.mean([item.temperature for item in images if item is not None], axis=0)
    pitch = measured.raster.spacing
    slopes = [sample(slope, measured.raster, middles) for slope in np.gradient(image, pitch)]
    off = np.where(np.isfinite(found.values), np.hypot(*slopes), np.nan)
    off = off * _position(measured, stated)
    return found.with_component(POSITION, off, per_element=True)


def _assumed(simulated: Measurement, found: Estimate, stated: StatedUncertainties) -> Estimate:
    """Add the uncertainty of the assumed emissivity to simulated values."""
    spread = np.zeros(found.shape)
    if stated.emissivity > 0.0:
        # Kelvins of radiance temperature for a radiance that is off by its own amount.
        radiance = np.asarray(simulated.band.radiance(found.values), np.float64)
        spread = stated.emissivity * radiance / simulated.band.slope(found.values)
    return found.with_component("emissivity", spread)


def _image(measured: Measurement, frame: int) -> ThermalImage | None:
    try:
        return ThermalImage.of(measured, frame)
    except NoShearBandError:
        return None


def _position(measured: Measurement, stated: StatedUncertainties) -> float:
    return measured.raster.spacing / sqrt(12.0) if stated.position is None else stated.position


def _few_frames(name: str, count: int) -> str:
    frames = f"{count} frame{'s' * (count != 1)}"
    return f"{name}: Only {frames}, which do not show how the temperature varies between frames."


def _compare_band(
    files: Sequence[_File], curve: Array | None, stated: StatedUncertainties, notes: Notes
) -> Readings | None:
    """Read the band of the measurement, which comes first, and of the simulations."""
    _, measured, tool, uncertainty, _ = files[0]
    profiles = []
    for one in files:
        moved = None if curve is None else curve + (one.tool.edge_point - tool.edge_point)
        try:
            profiles.append(
                band_profile(
                    one.item,
                    one.tool,
                    curve=moved,
                    reference=one.reference,
                    position=_position(measured, stated),
                    uncertainty=one.uncertainty,
                )
            )
        except NoShearBandError as error:
            notes.warnings.append(f"The shear band is left out: {one.name}: {error}.")
            return None
    if curve is not None and uncertainty is not None:
        profiles[0] = _laid_by_the_edge(measured, profiles[0], tool, uncertainty)
    step = measured.raster.spacing
    last = max(float(profile.distance[-1]) for profile in profiles)
    distance = step * np.arange(1, int(last / step) + 1, dtype=np.float64)
    own, *others = [
        _along(one.name, profile, distance, notes)
        for one, profile in zip(files, profiles, strict=True)
    ]
    readings = [
        _assumed(one.item, found.without(POSITION), stated)
        for one, found in zip(files[1:], others, strict=True)
    ]
    own = own.with_component("stated", stated.temperature)
    return Readings("shear band", distance, own, tuple(readings))


def _laid_by_the_edge(
    measured: Measurement, profile: BandProfile, tool: Tool, uncertainty: ToolUncertainty
) -> BandProfile:
    """Replace the effect of the tool's place by that on a given curve, placed by the edge."""
    moves = uncertainty.displacements(tool, tool.edge_point)
    found = np.full((len(moves), *profile.temperature.shape), np.nan)
    for frame, points in enumerate(profile.points):
        image = _image(measured, frame)
        if image is not None:
            found[:, frame] = [contribution(image, points, move) for move in moves]
    estimate = uncertainty.applied(tool, profile.estimate.without(TOOL), found)
    return replace(profile, estimate=estimate)


def _along(name: str, profile: BandProfile, distance: Array, notes: Notes) -> Estimate:
    """Return means over the frames at distances from the edge."""
    used = profile.in_place
    warnings = [text for text in profile.notes.warnings if text != CALIBRATION_UNKNOWN]
    own = Notes(profile.notes.assumed, warnings).about(name)
    notes.assumed.extend(own.assumed)
    notes.warnings.extend(own.warnings)
    if not used.any():
        notes.warnings.append(f"{name}: No frame has a band that is in place; all frames are used.")
        used = np.ones(used.size, np.bool_)
    elif used.sum() < _FEWEST_VALUES:
        notes.warnings.append(_few_frames(f"{name}, shear band in place", int(used.sum())))

    def read(field: Array) -> Array:
        # NaN next to a NaN and beyond the ends.
        ends = {"left": np.nan, "right": np.nan}
        return np.stack([np.interp(distance, profile.distance, row, **ends) for row in field[used]])

    frames = linearly_changed(profile.estimate.without(POSITION), read)
    # The curve's place does not change from frame to frame: it is as uncertain in their mean.
    position = frame_mean(Estimate(read(profile.estimate.contribution(POSITION))))
    mean = frame_mean(frames)
    mean = mean.with_component(POSITION, position.values, per_element=True)
    if len(frames.values) == 1:
        return mean.with_unevaluated(FRAMES)
    return replace(mean, components=(*mean.components, _scatter(frames.values)))


def _scatter(frames: Array) -> Component:
    """Return the scatter of the frames; where only one reaches, it is the mean of the others'."""
    scatter, count = frame_scatter(frames), np.isfinite(frames).sum(axis=0)
    several = count > 1
    if several.any() and (count == 1).any():
        effects = scatter.effects.copy()
        effects[count == 1, 0] = sqrt(float(np.nanvar(frames[:, several], axis=0, ddof=1).mean()))
        scatter = replace(scatter, effects=effects)
    return scatter


def _fits(labels: Sequence[str], grid: Readings | None, band: Readings | None) -> pd.DataFrame:
    """Return the fits at each place where measurement and simulations have values."""
    asked: list[tuple[str, Readings, NDArray[np.bool_]]] = []
    if grid is not None and grid.depth is not None:
        face = np.zeros(grid.measured.values.shape, dtype=np.bool_)
        face[0] = True
        reach = grid.depth[0] * 2e6  # in µm; the centre of a square is half as deep as its end
        asked.append((f"at the rake face, up to {reach:.3g} µm deep", grid, face))
        asked.append((f"in the chip, over {reach:.3g} µm from the face", grid, ~face))
    if band is not None:
        near, reach = band.distance < TIP_REACH, 1e6 * TIP_REACH
        asked.append((f"in the shear band, under {reach:.3g} µm from the edge", band, near))
        asked.append((f"in the shear band, {reach:.3g} µm and farther", band, ~near))
    rows: list[dict[str, Any]] = []
    for place, readings, where in asked:
        common = where & np.isfinite(readings.measured.values)
        for item in readings.simulated:
            common &= np.isfinite(item.values)
        if common.any():
            measured = readings.measured[common]
            simulated = [item[common] for item in readings.simulated]
            confidences = _confidences(measured, simulated)
            for label, item, confidence in zip(labels, simulated, confidences, strict=True):
                fit = {"simulation": label, **_fit(measured, item), "confidence": confidence}
                rows.append({"place": place, **fit})
    return pd.DataFrame(rows)


def _fit(measured: Estimate, simulated: Estimate) -> dict[str, float]:
    away = simulated - measured
    return {
        "bias_K": float(away.values.mean()),
        "bias_standard_uncertainty_K": float(away.mean().standard_uncertainty),
        "rms_K": float(np.sqrt((away.values**2).mean())),
        "values": away.values.size,
        AGREEING: int((normalised_error(measured, simulated) <= 1).sum()),
    }


def _confidences(measured: Estimate, simulated: Sequence[Estimate]) -> list[float]:
    """Return the fraction of draws in which each set is best; NaN with one measured frame."""
    if FRAMES in measured.unevaluated:
        return [nan] * len(simulated)
    generator = np.random.default_rng(SEED)
    base, *others = draw([measured, *simulated], _DRAWS, generator, heavy_tails=True)
    best = np.argmin([((other - base) ** 2).mean(axis=1) for other in others], axis=0)
    return [float((best == number).mean()) for number in range(len(others))]
