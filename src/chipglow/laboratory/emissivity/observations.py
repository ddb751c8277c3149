"""Images of one place as observations, and their random errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isnan, nan, sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Flag, Measurement
from chipglow.laboratory.emissivity.uniformity import Uniformity, noise_around, uniformity
from chipglow.quantities import Array, Brief
from chipglow.scene import Area
from chipglow.uncertainty import Cause, Component, Estimate

ALL_IMAGES: Final = "all images"
"""Identity of the errors that all images of a camera and all regions have in common."""

RANDOM: Final = "random"
"""Name of the component of the random errors that observations show."""

UNIFORMITY: Final = "uniformity"
"""Name of the component of the variation over an area beyond noise and texture."""

_FLAGS: Final = {
    Flag.UNDER_RANGE: "below the lower range limit",
    Flag.SATURATED: "saturated",
    Flag.DEAD: "dead",
}
"""Flags that make pixels unusable, in words."""

_MANY_LEFT_OUT: Final = 0.05
"""Fraction of an area's pixels above which their omission is a warning."""


def area_estimate(mean: float, values: Array, identity: str, noise: float = nan) -> Estimate:
    """Return the mean of an area with its random component, by an analysis of variance.

    `noise` is the noise of a single pixel, which a single frame does not show.
    """
    observations, pixels = values.shape
    if observations == 1:
        if pixels == 1:
            if isnan(noise):
                return Estimate(np.array(mean)).with_unevaluated("repeatability", "noise")
            alone = _random(mean, {"noise": noise}, inf, identity)
            return alone.with_unevaluated("repeatability")
        noise = float(values[0].std(ddof=1)) / sqrt(pixels)
        alone = _random(mean, {"noise": noise}, pixels - 1.0, identity)
        return alone.with_unevaluated("repeatability")
    means = values.mean(axis=1)
    total = float(means.var(ddof=1)) / observations
    if pixels == 1:
        parts = {"repeatability": 0.0, "noise": sqrt(total)}
        return _random(mean, parts, observations - 1.0, identity)
    residual = values - means[:, None] - values.mean(axis=0) + means.mean()
    freedom = (observations - 1.0) * (pixels - 1.0)
    noise = float((residual**2).sum()) / freedom / values.size
    # One standard deviation is known, that of the means: its parts share its degrees of freedom.
    parts = {"repeatability": sqrt(max(total - noise, 0.0)), "noise": sqrt(noise)}
    return _random(mean, parts, observations - 1.0 if total > noise else freedom, identity)


def deviation_of(pixels: Array) -> float:
    """Return the standard deviation over the pixels of an area, NaN of a single one."""
    return float(pixels.std(ddof=1)) if pixels.size > 1 else nan


def _random(mean: float, parts: dict[str, float], freedom: float, identity: str) -> Estimate:
    cause = Cause(RANDOM, identity, len(parts), freedom, parts=tuple(parts))
    return Estimate(np.array(mean), (Component(cause, np.array([list(parts.values())])),))


def uncertainty_columns(
    estimate: Estimate, causes: Sequence[str], unit: str = ""
) -> dict[str, float]:
    """Return columns for the uncertainty of one value: the total and its parts."""
    whole = {
        f"standard_uncertainty{unit}": estimate.standard_uncertainty,
        "degrees_of_freedom": estimate.degrees_of_freedom,
        "coverage_factor": estimate.coverage_factor(),
        f"expanded_uncertainty{unit}": estimate.expanded_uncertainty(),
    }
    parts = {f"{cause}_uncertainty{unit}": estimate.contribution(cause) for cause in causes}
    return {name: float(value) for name, value in (whole | parts).items()}


@dataclass(frozen=True, eq=False, repr=False)
class UsedPixels(Brief):
    """Pixels of an area that have a value in every frame."""

    name: str
    mask: NDArray[np.bool_]
    count: int
    left_out: int
    """Number of other pixels of the area, which are flagged."""
    flagged: dict[Flag, int]
    """Number of pixels with each flag."""
    uniformity: Uniformity
    noise: float
    """Noise of a single pixel of a single frame in W/(m² sr); NaN if there are more, or unknown."""

    def warnings(self) -> list[str]:
        """Return a warning if many of the area's pixels are left out."""
        total = self.count + self.left_out
        if self.left_out <= _MANY_LEFT_OUT * total:
            return []
        flags = flag_text(self.flagged)
        return [f"{self.name}: {self.left_out} of {total} pixels are left out ({flags})."]

    def uneven_text(self, variation: str) -> str:
        """Return the warning of an uneven area; `variation` is a standard deviation in words."""
        return (
            f"{self.name}: is uneven: across it the {variation} (standard deviation), which noise "
            "and texture do not explain. u includes it (uniformity); draw the region farther from "
            "edges, or smaller."
        )


def used_pixels(area: Area, radiance: Array, flags: NDArray[np.uint8]) -> UsedPixels:
    """Return the usable pixels of an area; raise ValueError if it has none.

    `radiance` in W/(m² sr) has the shape (observation, y, x).
    """
    usable, total = area.mask & np.isfinite(radiance).all(axis=0), int(area.mask.sum())
    count = int(usable.sum())
    flagged = {flag: int((flags[area.mask] & flag != 0).sum()) for flag in _FLAGS}
    if count == 0:
        raise ValueError(
            f"region {area.name}: 0 of its {total} pixels can be used ({flag_text(flagged)}), "
            "expected 1 or more"
        )
    even = uniformity(usable, radiance[:, usable])
    noise = noise_around(usable, radiance[0]) if count == len(radiance) == 1 else nan
    return UsedPixels(area.name, usable, count, total - count, flagged, even, noise)


def with_observed(
    known: Estimate,
    values: Array,
    used: UsedPixels,
    per_radiance: float,
    drift: float | None,
    by_drift: float,
    recordings: int,
    of: str,
) -> Estimate:
    """Add the random errors of an area's observations, its unevenness, and the drift beyond both.

    `per_radiance` is the change of the estimate with the radiance; `by_drift` is the effect of a
    relative drift of 1; `of` identifies the observations and, after a space, their area.
    """
    mean = float(known.values)
    random = area_estimate(mean, values, of, per_radiance * used.noise)
    known = known.with_component(
        UNIFORMITY,
        per_radiance * used.uniformity.standard_deviation,
        identity=f"{of} {UNIFORMITY}",
        degrees_of_freedom=used.uniformity.degrees_of_freedom,
    )
    if recordings > 1:
        repeatability = float(random.contribution("repeatability"))
        stated = (drift or 0.0) * by_drift / sqrt(recordings)
        change: float | None = sqrt(max(stated**2 - repeatability**2, 0.0))
    else:
        change = None if drift is None else drift * by_drift
    return with_drift(known, change, of.partition(" ")[0]) + (random - mean)


def with_drift(estimate: Estimate, effect: Any, identity: str | None = None) -> Estimate:
    """Add the component ``drift``, which is unevaluated if its effect is None."""
    if effect is None:
        return estimate.with_unevaluated("drift")
    return estimate.with_component("drift", effect, identity=identity)


def check_same_pixels(
    measurements: Sequence[Measurement], purpose: str, names: Sequence[str] = ()
) -> None:
    """Raise ValueError unless there are images, all of one camera that see the same place."""
    if not measurements:
        raise ValueError(f"{purpose}: there is no image, expected 1 or more")
    names = names or [f"image {number}" for number, _ in enumerate(measurements, 1)]
    first = measurements[0]
    for name, other in zip(names, measurements, strict=True):
        if other.raster != first.raster or other.band != first.band:
            raise ValueError(
                f"{name}: has other pixels, or another band, than {names[0]}, "
                "expected images of one camera that see the same place"
            )


def observed_radiance(measurements: Sequence[Measurement]) -> Array:
    """Return the frames of one image, or the means of several, in W/(m² sr); NaN where flagged."""
    frames = [np.where(one.usable.all(axis=0), one.radiance, np.nan) for one in measurements]
    return np.stack([image.mean(axis=0) for image in frames]) if len(frames) > 1 else frames[0]


def observed_flags(measurements: Sequence[Measurement]) -> NDArray[np.uint8]:
    """Return all `Flag` that a pixel has in any frame, shape (y, x)."""
    flags = [np.bitwise_or.reduce(measurement.flags, axis=0) for measurement in measurements]
    return np.asarray(np.bitwise_or.reduce(flags, axis=0), np.uint8)


def calibration_uncertainty(
    measurements: Sequence[Measurement], radiance: Array, kelvins: float | None
) -> Array | None:
    """Return the uncertainty of the mean radiance by `kelvins`, or as stated if all images do."""
    if kelvins is not None:
        band = measurements[0].band
        temperature = np.asarray(band.temperature(radiance), np.float64)
        low, high = (band.radiance(temperature + sign * kelvins) for sign in (-1.0, 1.0))
        return np.asarray((high - low) / 2, np.float64)
    known = [measurement.calibration_uncertainty for measurement in measurements]
    stated = [image.mean(axis=0) for image in known if image is not None]
    return np.asarray(np.mean(stated, axis=0), np.float64) if len(stated) == len(known) else None


def flag_text(flagged: dict[Flag, int]) -> str:
    """Describe how many pixels have each flag."""
    texts = [f"{count} {_FLAGS[flag]}" for flag, count in flagged.items() if count]
    return ", ".join(texts) or "none flagged"
