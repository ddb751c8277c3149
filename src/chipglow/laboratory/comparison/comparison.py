"""Measured beside simulated: at the rake face and in the shear band, for several emissivities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, isfinite, radians, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Measurement
from chipglow.laboratory.chip import (
    BandProfile,
    NoShearBandError,
    RakeGrid,
    ThermalImage,
    ToolUncertainty,
    band_profile,
    rake_grid,
)
from chipglow.laboratory.chip.rake_grid import DEPTH, PIXELS
from chipglow.laboratory.chip.tool_position import contribution
from chipglow.laboratory.comparison.frame_scatter import FrameScatter
from chipglow.scene import Tool, sample
from chipglow.text.remarks import Remarks
from chipglow.uncertainty import Estimate, draw

COVERAGE: Final = 2.0
"""Factor between standard and expanded uncertainty: about 95 %."""

TIP_REACH: Final = 100e-6
"""Distance from the cutting edge in m within which the paper looks at the band by itself."""

SURE: Final = 0.95
"""Share of the draws in which the best set must be best to be called so."""

_DRAWS: Final = 4000
_SEED: Final = 2010
_FEW: Final = 3
_SAME_ANGLE: Final = radians(0.1)


def reading(
    temperature: NDArray[np.float64],
    systematic: NDArray[np.float64],
    random: NDArray[np.float64],
    from_tool: Sequence[NDArray[np.float64]] = (),
    scatter: FrameScatter | None = None,
) -> Estimate:
    """Radiance temperatures with their standard uncertainties, all of one shape.

    Parameters
    ----------
    temperature : ndarray
        In K; NaN where there is none.
    systematic : ndarray
        Standard uncertainty in K of what all values have in common: calibration, a stated one,
        the emissivity of a simulation.
    random : ndarray
        Standard uncertainty in K of what differs from value to value: position, and the mean over
        the frames.
    from_tool : sequence of ndarray
        What each independent standard uncertainty of the tool's place changes in K, with its sign:
        it changes all values together, up the one slope and down the other.
    scatter : FrameScatter, optional
        What of `random` comes from the mean over the frames, in which values change together. By
        default every value changes by itself.

    Returns
    -------
    Estimate
        With the components ``systematic``, ``position``, ``frames`` and ``tool``, independent of
        those of other readings.

    Raises
    ------
    ValueError
        If the shapes differ.
    """
    fields = [("systematic", systematic), ("random", random)]
    for name, values in (*fields, *(("from_tool", part) for part in from_tool)):
        if values.shape != temperature.shape:
            raise ValueError(
                f"reading: {name} has shape {values.shape}, expected {temperature.shape}"
            )
    alone = random
    if scatter is not None:
        alone = np.sqrt(np.maximum(random**2 - scatter.deviation**2, 0.0))
    found = Estimate(temperature).with_component("systematic", systematic, independent="common")
    found = found.with_component("position", alone, independent="per element")
    if scatter is not None:
        found = replace(found, components=(*found.components, scatter.component()))
    for part in from_tool:
        found = found.with_component("tool", part, independent="common")
    return found


def normalised_error(measured: Estimate, simulated: Estimate) -> NDArray[np.float64]:
    """E_n number: magnitude of the difference over the expanded uncertainty of the difference.

    E_n = abs(T_sim − T_meas) / sqrt(U_meas² + U_sim²) (ISO/IEC 17043), k = `COVERAGE`. Up to 1 the
    two agree. What both have in common is not in the uncertainty of their difference.
    """
    away = simulated - measured
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.abs(away.values) / (COVERAGE * away.standard_uncertainty))


@dataclass(frozen=True)
class Fit:
    """How one simulation fits the measurement at one place.

    Parameters
    ----------
    label : str
        Name of the simulation.
    bias : float
        Mean of simulated less measured in K.
    bias_uncertainty : float
        Its standard uncertainty in K.
    rms : float
        Root of the mean square of the differences in K.
    agreeing : int
        Number of values with E_n up to 1.
    count : int
        Number of values that both have.
    """

    label: str
    bias: float
    bias_uncertainty: float
    rms: float
    agreeing: int
    count: int


@dataclass(frozen=True)
class PlaceResult:
    """Which simulation fits best at one place.

    Parameters
    ----------
    place : str
        Where, in words.
    fits : tuple of Fit
        One for each simulation, in the given order.
    best : int
        Number of the one with the least root mean square.
    confidence : float
        Share of draws of all uncertainties in which it has the least one.
    """

    place: str
    fits: tuple[Fit, ...]
    best: int
    confidence: float

    @property
    def is_sure(self) -> bool:
        """Whether the best one is best in `SURE` of the draws."""
        return self.confidence >= SURE

    @property
    def sentence(self) -> str:
        """Which simulation fits here, in one sentence from the numbers."""
        best = self.fits[self.best]
        others = [fit for i, fit in enumerate(self.fits) if i != self.best]
        what = f"{_warmth(best)}, RMS {best.rms:.0f} K, {_agreement(best)}"
        if not others:
            return f"{_upper(self.place)} {best.label} is {what}."
        rest = "; ".join(
            f"{fit.label} is {_warmth(fit)}, RMS {fit.rms:.0f} K, {fit.agreeing} of {fit.count}"
            for fit in others
        )
        how = f"{100 * self.confidence:.3g} % of the draws of the uncertainties"
        if self.is_sure:
            return f"{_upper(self.place)} {best.label} fits best (in {how}): it is {what}; {rest}."
        return (
            f"{_upper(self.place)} the sets cannot be told apart ({best.label} is nearest, in "
            f"{how}): {best.label} is {what}; {rest}."
        )


def _upper(text: str) -> str:
    return text[0].upper() + text[1:]


def _warmth(fit: Fit) -> str:
    word = "too hot" if fit.bias > 0 else "too cold"
    return f"{abs(fit.bias):.0f} K {word} (± {COVERAGE * fit.bias_uncertainty:.0f} K)"


def _agreement(fit: Fit) -> str:
    return f"{fit.agreeing} of {fit.count} values agree (E_n up to 1)"


@dataclass(frozen=True)
class GridComparison:
    """The analysis grid on the rake face, measured and simulated.

    Parameters
    ----------
    along, depth : ndarray
        Middles of the squares up the face and into the chip in m, shapes (n,) and (m,).
    measured : Estimate
        Shape (m, n).
    simulated : tuple of Estimate
        One for each simulation.
    """

    along: NDArray[np.float64]
    depth: NDArray[np.float64]
    measured: Estimate
    simulated: tuple[Estimate, ...]


@dataclass(frozen=True)
class BandComparison:
    """The temperature along the shear band, measured and simulated.

    Parameters
    ----------
    distance : ndarray
        Distance from the cutting edge in m, at steps of a measured pixel, shape (n,).
    measured : Estimate
        Shape (n,).
    simulated : tuple of Estimate
        One for each simulation.
    """

    distance: NDArray[np.float64]
    measured: Estimate
    simulated: tuple[Estimate, ...]


@dataclass(frozen=True)
class Comparison:
    """A measurement beside simulations.

    Parameters
    ----------
    labels : tuple of str
        Names of the simulations.
    grid : GridComparison or None
        At the rake face; None if there is nothing to compare.
    band : BandComparison or None
        Along the shear band; None if there is nothing to compare.
    places : tuple of PlaceResult
        Which simulation fits where.
    assumptions : tuple of str
        What had to be assumed, a sentence each.
    warnings : tuple of str
        Why it may not be relied on, a sentence each.
    """

    labels: tuple[str, ...]
    grid: GridComparison | None
    band: BandComparison | None
    places: tuple[PlaceResult, ...]
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def statement(self) -> str:
        """Which simulation fits where, as the paper's conclusion says it."""
        if len(self.labels) == 1:
            agreeing = sum(result.fits[0].agreeing for result in self.places)
            count = sum(result.fits[0].count for result in self.places)
            return f"{self.labels[0]}: {agreeing} of {count} values agree (E_n up to 1)."
        parts = []
        for i, label in enumerate(self.labels):
            where = [r.place.rstrip(",") for r in self.places if r.is_sure and r.best == i]
            if where:
                parts.append(f"{label} fits best {'; '.join(where)}.")
        unsure = [r.place.rstrip(",") for r in self.places if not r.is_sure]
        if unsure:
            parts.append(f"The sets cannot be told apart {'; '.join(unsure)}.")
        return " ".join(parts)


@dataclass(frozen=True)
class StatedUncertainties:
    """Uncertainties that the files do not tell.

    Parameters
    ----------
    temperature : float
        Standard uncertainty of the measured radiance temperature in K, common to all values, for a
        measurement without its own.
    emissivity : float
        Relative standard uncertainty of the emissivities that the simulations assume.
    position : float, optional
        Standard uncertainty of positions in the measured image in m, of each value by itself. By
        default that of a pixel; for squares at the rake face only where `tool` is not stated.
    tool : ToolUncertainty, optional
        Uncertainty of the tool's place in the measured image, common to all values, such as that
        of a `FoundTool`.

    Raises
    ------
    ValueError
        If one is negative or not finite.
    """

    temperature: float = 0.0
    emissivity: float = 0.0
    position: float | None = None
    tool: ToolUncertainty | None = None

    def __post_init__(self) -> None:
        for name in ("temperature", "emissivity", "position"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value >= 0):
                raise ValueError(f"uncertainty: {name} is {value!r}, expected 0 or more")


def compare(
    measured: Measurement,
    simulated: Mapping[str, Measurement],
    tool: Tool,
    curve: NDArray[np.float64] | None = None,
    stated: StatedUncertainties | None = None,
    reference: int | None = None,
) -> Comparison:
    """Lay a measurement and simulations over each other.

    Parameters
    ----------
    measured : Measurement
        Frames of the camera.
    simulated : mapping
        Frames of the simulated camera by name, such as one for each set of emissivities. Pitch and
        grid of pixels may differ from the measured ones.
    tool : Tool
        The tool, in the measurement's coordinates. A simulation that tells its own is placed by
        that.
    curve : ndarray, optional
        Polyline along which to read the shear band in all files, from the cutting edge outward, in
        the measurement's coordinates in m, shape (k, 2). By default the ridge of each frame.
    stated : StatedUncertainties, optional
        Uncertainties that the files do not tell.
    reference : int, optional
        Number of the measured frame whose band is fully developed; see `band_profile`.

    Raises
    ------
    ValueError
        If there is no simulation, or nothing that can be compared.

    Notes
    -----
    Squares of 3 measured pixels stand on the rake face in all images alike. Along the shear band
    values at the same distance from the cutting edge are compared, as means over the frames in
    which the band is developing or fully developed, as in the paper.

    The measured values have the uncertainty of the calibration (or a stated one), of the position,
    of the tool's place and of the mean over the frames, the simulated ones that of the emissivity
    and of the mean over the frames. A tool that is elsewhere moves the squares, the cutting edge
    from which the distance along a found ridge counts, and a given curve's place in the
    simulations. Which set fits best is the one with the least root mean square of the differences;
    how sure that is, is found by drawing all values anew from their uncertainties: what is
    systematic, and each part of the tool's place, with one deviate a file, what is random with one
    a value.
    """
    if not simulated:
        raise ValueError("comparison: no simulation, expected 1 or more")
    stated = stated or StatedUncertainties()
    remarks = Remarks()
    if measured.calibration_uncertainty is None and stated.temperature == 0.0:
        remarks.warnings.append(
            "the measurement does not tell the uncertainty of its calibration and none is stated, "
            "so that the E_n are too great."
        )
    allowed = max(_SAME_ANGLE, COVERAGE * stated.tool.angle if stated.tool else 0.0)
    tools = {
        label: _tool_of(label, item, tool, allowed, remarks) for label, item in simulated.items()
    }
    grid = _compare_grid(measured, simulated, tool, tools, stated, remarks)
    files = [("measured", measured, tool, reference)]
    files += [(label, item, tools[label], None) for label, item in simulated.items()]
    band = _compare_band(files, curve, stated, remarks)
    places = _places(tuple(simulated), grid, band)
    if not places:
        reasons = " ".join(remarks.warnings)
        raise ValueError(f"comparison: there is nothing that can be compared: {reasons}")
    return Comparison(
        tuple(simulated),
        grid,
        band,
        places,
        tuple(remarks.assumptions),
        tuple(remarks.warnings),
    )


def _tool_of(
    label: str, simulated: Measurement, tool: Tool, allowed: float, remarks: Remarks
) -> Tool:
    own = simulated.tool
    if own is None:
        remarks.assumptions.append(f"{label} tells no tool; it is where the measurement has it.")
        return tool
    turn = abs(own.rake_angle - tool.rake_angle)
    if turn > allowed:
        remarks.warnings.append(
            f"the rake angle of {label} differs by {degrees(turn):.2g} degrees."
        )
    return own


def _compare_grid(
    measured: Measurement,
    simulated: Mapping[str, Measurement],
    tool: Tool,
    tools: Mapping[str, Tool],
    stated: StatedUncertainties,
    remarks: Remarks,
) -> GridComparison | None:
    size = PIXELS * measured.raster.spacing
    try:
        base = rake_grid(measured, tool, PIXELS, max(DEPTH, size), uncertainty=stated.tool)
        grids = {
            label: rake_grid(item, tools[label], size / item.raster.spacing, max(DEPTH, size))
            for label, item in simulated.items()
        }
    except ValueError as error:
        remarks.warnings.append(f"the rake face is left out: {error}.")
        return None
    if base.times.size < _FEW:
        remarks.warnings.append(_few_frames("measured", base.times.size))
    columns = min(grid.along.size for grid in (base, *grids.values()))
    readings = [_measured_squares(measured, base, columns, stated)]
    for label, item in simulated.items():
        grid = grids[label]
        mean = grid.frame_mean[:, :columns]
        emissivity = _of_the_emissivity(item, mean, stated)
        scatter = FrameScatter.of(grid.mean[:, :, :columns])
        readings.append(reading(mean, emissivity, scatter.deviation, scatter=scatter))
    return GridComparison(base.along[:columns], base.depth, readings[0], tuple(readings[1:]))


def _measured_squares(
    measured: Measurement, grid: RakeGrid, columns: int, stated: StatedUncertainties
) -> Estimate:
    mean = grid.frame_mean[:, :columns]
    corners = grid.corners()[:, : columns + 1]
    middles = (corners[1:, 1:] + corners[:-1, :-1]) / 2
    systematic = np.full(mean.shape, stated.temperature)
    if measured.calibration_uncertainty is not None:
        share = sample(_relative_calibration(measured), measured.raster, middles)
        systematic = np.hypot(systematic, share * _relative_to_kelvin(measured, mean))
    scatter = FrameScatter.of(grid.mean[:, :, :columns])
    random = scatter.deviation
    if stated.tool is None or stated.position is not None:
        images = [_image(measured, k) for k in range(measured.times.size)]
        image = np.mean([item.temperature for item in images if item is not None], axis=0)
        pitch = measured.raster.spacing
        slopes = [sample(slope, measured.raster, middles) for slope in np.gradient(image, pitch)]
        random = np.hypot(random, np.hypot(*slopes) * _position(measured, stated))
    from_tool = tuple(p[:, :columns] for p in grid.frame_from_tool)
    return reading(mean, systematic, random, from_tool, scatter)


def _relative_calibration(measured: Measurement) -> NDArray[np.float64]:
    """Uncertainty of the calibration over the radiance, mean over the frames, shape (y, x)."""
    absolute = measured.calibration_uncertainty
    assert absolute is not None
    usable = measured.usable & (measured.radiance > 0)
    share = np.divide(absolute, measured.radiance, out=np.zeros(absolute.shape), where=usable)
    return _mean(share, usable)


def _image(measured: Measurement, frame: int) -> ThermalImage | None:
    try:
        return ThermalImage.of(measured, frame)
    except NoShearBandError:
        return None


def _position(measured: Measurement, stated: StatedUncertainties) -> float:
    return measured.raster.spacing / sqrt(12.0) if stated.position is None else stated.position


def _few_frames(name: str, count: int) -> str:
    frames = "frame" if count == 1 else "frames"
    return (
        f"{name}: {count} {frames} only, which do not tell how the temperature varies between "
        "frames."
    )


def _relative_to_kelvin(
    measurement: Measurement, temperature: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Kelvins of radiance temperature for a radiance that is off by its own amount."""
    radiance = np.asarray(measurement.band.radiance(temperature), np.float64)
    return radiance / measurement.band.slope(temperature)


def _of_the_emissivity(
    simulated: Measurement, temperature: NDArray[np.float64], stated: StatedUncertainties
) -> NDArray[np.float64]:
    """Standard uncertainty in K that the assumed emissivity makes."""
    if stated.emissivity == 0.0:
        return np.zeros(temperature.shape)
    return stated.emissivity * _relative_to_kelvin(simulated, temperature)


def _compare_band(
    files: Sequence[tuple[str, Measurement, Tool, int | None]],
    curve: NDArray[np.float64] | None,
    stated: StatedUncertainties,
    remarks: Remarks,
) -> BandComparison | None:
    """The band of the measurement, which comes first, and of the simulations."""
    _, measured, tool, _ = files[0]
    position = _position(measured, stated)
    profiles: list[BandProfile] = []
    for name, item, placed, reference in files:
        moved = None if curve is None else curve + (placed.edge_point - tool.edge_point)
        try:
            profiles.append(
                band_profile(
                    item,
                    placed,
                    curve=moved,
                    reference=reference,
                    position=position,
                    # The measurement comes first; a simulation knows its tool.
                    uncertainty=None if profiles else stated.tool,
                )
            )
        except NoShearBandError as error:
            remarks.warnings.append(f"the shear band is left out: {name}: {error}.")
            return None
    if curve is not None and stated.tool is not None:
        moves = stated.tool.displacements(tool, tool.edge_point)
        profiles[0] = replace(profiles[0], from_tool=_of_the_curve(measured, profiles[0], moves))
    step = measured.raster.spacing
    last = max(float(profile.distance[-1]) for profile in profiles)
    distance = step * np.arange(1, int(last / step) + 1, dtype=np.float64)
    names = [name for name, *_ in files]
    parts = [_along(name, p, distance, remarks) for name, p in zip(names, profiles, strict=True)]
    (mean, calibration, off, *from_tool), scatter = parts[0]
    systematic = np.hypot(calibration, stated.temperature)
    random = np.hypot(off, scatter.deviation)
    own = reading(mean, systematic, random, tuple(from_tool), scatter)
    readings = []
    for (_, item, *_), ((mean, *_), scatter) in zip(files[1:], parts[1:], strict=True):
        emissivity = _of_the_emissivity(item, mean, stated)
        readings.append(reading(mean, emissivity, scatter.deviation, scatter=scatter))
    return BandComparison(distance, own, tuple(readings))


def _of_the_curve(
    measured: Measurement, profile: BandProfile, moves: NDArray[np.float64]
) -> tuple[NDArray[np.float64], ...]:
    """What it makes in K that the edge places a given curve on the simulations.

    There the curve is off by as much as the edge is here, across itself too, and the distances
    that are compared are the same: what it would read here stands for all simulations.
    """
    found = np.full((len(moves), *profile.temperature.shape), np.nan)
    for frame, points in enumerate(profile.points):
        image = _image(measured, frame)
        if image is not None:
            found[:, frame] = [contribution(image, points, move) for move in moves]
    return tuple(found)


def _along(
    name: str, profile: BandProfile, distance: NDArray[np.float64], remarks: Remarks
) -> tuple[tuple[NDArray[np.float64], ...], FrameScatter]:
    """Means over the frames of temperature, calibration, position, tool; and how the frames differ.

    Where a single frame reaches, the variance between frames is the mean of it where several do.
    """
    used = profile.in_place
    remarks.assumptions.extend(f"{sentence} ({name})" for sentence in profile.assumptions)
    remarks.warnings.extend(f"{sentence} ({name})" for sentence in profile.warnings)
    if not used.any():
        remarks.warnings.append(
            f"{name}: no frame has a band that is in place; all frames are used."
        )
        used = np.ones(used.size, np.bool_)
    elif used.sum() < _FEW:
        remarks.warnings.append(_few_frames(f"{name}, shear band in place", int(used.sum())))
    fields = (profile.temperature, profile.calibration, profile.position, *profile.from_tool)
    read = [
        np.stack([_at(distance, profile.distance, row) for row in field[used]]) for field in fields
    ]
    known = np.isfinite(read[0])
    count = known.sum(axis=0)
    scatter = FrameScatter.of(read[0])
    several = count > 1
    if several.any() and (count == 1).any():
        patterns = scatter.patterns.copy()
        patterns[0, count == 1] = sqrt(float((count * scatter.deviation**2)[several].mean()))
        scatter = replace(scatter, patterns=patterns)
    return tuple(_mean(field, known) for field in read), scatter


def _at(
    distance: NDArray[np.float64], own: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values at other distances; NaN beside a NaN and beyond the ends."""
    return np.asarray(np.interp(distance, own, values, left=np.nan, right=np.nan))


def _mean(values: NDArray[np.float64], known: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Mean over the first axis of what is known; NaN where nothing is."""
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


def _places(
    labels: Sequence[str], grid: GridComparison | None, band: BandComparison | None
) -> tuple[PlaceResult, ...]:
    """Which simulation fits where both have values."""
    results: list[PlaceResult | None] = []
    if grid is not None:
        face = np.zeros(grid.measured.values.shape, dtype=np.bool_)
        face[0] = True
        reach = grid.depth[0] * 2e6
        results.append(_judged(f"at the rake face, up to {reach:.3g} µm deep,", labels, grid, face))
        results.append(
            _judged(f"in the chip, over {reach:.3g} µm from the face,", labels, grid, ~face)
        )
    if band is not None:
        near, reach = band.distance < TIP_REACH, 1e6 * TIP_REACH
        results.append(
            _judged(f"in the shear band, under {reach:.3g} µm from the edge,", labels, band, near)
        )
        results.append(
            _judged(f"in the shear band, {reach:.3g} µm and farther,", labels, band, ~near)
        )
    return tuple(result for result in results if result is not None)


def _judged(
    place: str,
    labels: Sequence[str],
    pair: GridComparison | BandComparison,
    where: NDArray[np.bool_],
) -> PlaceResult | None:
    """The fits at one place; None where not all files have a value together."""
    common = where & np.isfinite(pair.measured.values)
    for item in pair.simulated:
        common &= np.isfinite(item.values)
    if not common.any():
        return None
    measured = pair.measured[common]
    simulated = [item[common] for item in pair.simulated]
    fits = tuple(_fit(label, measured, item) for label, item in zip(labels, simulated, strict=True))
    best = int(np.argmin([fit.rms for fit in fits]))
    return PlaceResult(place, fits, best, _confidence(measured, simulated, best))


def _fit(label: str, measured: Estimate, simulated: Estimate) -> Fit:
    away = simulated - measured
    bias = away.mean()
    return Fit(
        label=label,
        bias=float(away.values.mean()),
        bias_uncertainty=float(bias.standard_uncertainty),
        rms=float(np.sqrt((away.values**2).mean())),
        agreeing=int((normalised_error(measured, simulated) <= 1).sum()),
        count=away.values.size,
    )


def _confidence(measured: Estimate, simulated: Sequence[Estimate], best: int) -> float:
    """Share of draws of all uncertainties in which the best set stays the best."""
    base, *others = draw([measured, *simulated], _DRAWS, np.random.default_rng(_SEED))
    rms = [((other - base) ** 2).mean(axis=1) for other in others]
    return float((np.argmin(rms, axis=0) == best).mean())
