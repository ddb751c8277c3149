"""A segment of the chip during one exposure: its shear band and its contact with the tool."""

from dataclasses import dataclass
from math import nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import frame_weights
from chipglow.chip.ridge import NoShearBandError
from chipglow.chip.shear_band import ShearBand, find_shear_band
from chipglow.quantities import Array, Brief
from chipglow.scene import Frame, Material, Raster, Scene, Tool, sample
from chipglow.scene.lines import nearest

_SWEEP_REACH: Final = 40e-6
"""Distance in m from the band's middle within which its motion is followed."""

_LONGEST_GAP: Final = 12e-6
"""Longest gap in m within a contact."""


class NoContactError(ValueError):
    """The chip does not touch the rake face."""


def contact_length(
    raster: Raster, workpiece: NDArray[np.bool_], tool: Tool, touching: float
) -> float:
    """Return the length in m over which the chip touches the rake face."""
    step = raster.spacing / 2
    along = np.arange(0.0, np.hypot(raster.rows, raster.columns) * raster.spacing, step)
    foot = tool.rake_point(along)
    touches = np.zeros(along.size, dtype=np.bool_)
    # Lines half a sample apart miss no sample; the first is within the samples on the face.
    for height in np.arange(raster.spacing / 4, touching + step, step):
        touches |= nearest(workpiece, raster, foot + height * np.array(tool.rake_normal)) == 1
    contacts = along[touches]
    if contacts.size == 0 or contacts[0] > _LONGEST_GAP:
        return 0.0
    gaps = np.diff(contacts) > _LONGEST_GAP
    return float(contacts[gaps.argmax() if gaps.any() else -1])


@dataclass(frozen=True, repr=False)
class Instant(Brief):
    """The shear band during one exposure."""

    start: float
    """Start of the exposure in s."""
    band: ShearBand | None
    """Ridge of the strain rate's mean over the exposure; None if undefined."""
    temperatures: Array
    """Mean true temperature along the ridge in K, shape (n,); empty without a band."""

    @property
    def mean_temperature(self) -> float:
        """Mean of the temperatures in K; NaN without a band."""
        known = self.temperatures[np.isfinite(self.temperatures)]
        return float(known.mean()) if known.size else nan

    @classmethod
    def at(cls, scene: Scene, start: float, duration: float) -> "Instant":
        """Find the band during an exposure."""
        indices, weights = frame_weights(scene.times, scene.frame_spacing, start, duration)
        rate = _mean(scene, "plastic_strain_rate", indices, weights)
        band = shear_band(scene, rate, scene.field("material", indices[len(indices) // 2]))
        if band is None:
            return cls(start, None, np.zeros(0))
        temperature = _mean(scene, "temperature", indices, weights)
        return cls(start, band, sample(temperature, scene.raster, band.ridge.points))


@dataclass(frozen=True)
class Segment:
    """A segment of the chip whose shear band is developed, and where its errors are read."""

    start: float
    """Start of the exposure in s."""
    frame: Frame
    """The scene in the middle of the exposure."""
    tool: Tool
    band: ShearBand
    """Ridge of the strain rate's mean over the exposure."""
    contact_length: float
    """Length over which the chip touches the rake face in m."""
    momentary_band: ShearBand | None
    """The band in `frame` alone, which motion does not blur; None if undefined."""
    sweep: float
    """Travel in m of the band's middle across itself during the exposure; NaN if undefined."""

    @property
    def moment(self) -> ShearBand:
        """The band at one moment if known, else over the exposure."""
        return self.momentary_band or self.band

    @property
    def band_width(self) -> float:
        """Width of the band at one moment in m."""
        return self.moment.width

    @classmethod
    def of(cls, scene: Scene, instant: Instant, duration: float, touching: float) -> "Segment":
        """Find the contact and the momentary band at an instant that has a band."""
        assert scene.tool is not None and instant.band is not None
        indices, _ = frame_weights(scene.times, scene.frame_spacing, instant.start, duration)
        frame = scene.frame(indices[len(indices) // 2])
        workpiece = frame.material == Material.WORKPIECE
        return cls(
            start=instant.start,
            frame=frame,
            tool=scene.tool,
            band=instant.band,
            contact_length=contact_length(scene.raster, workpiece, scene.tool, touching),
            momentary_band=shear_band(scene, frame.needed("plastic_strain_rate"), frame.material),
            sweep=_sweep(scene, indices, instant.band),
        )


def _mean(scene: Scene, field_name: str, indices: range, weights: Array) -> Array:
    parts = zip(indices, weights, strict=True)
    fields = (weight * scene.field(field_name, index) for index, weight in parts)
    return sum(fields, np.zeros(scene.raster.shape))


def shear_band(
    scene: Scene, rate: NDArray[np.floating], material: NDArray[np.integer]
) -> ShearBand | None:
    """Find the shear band in a strain rate of a scene; None without one."""
    assert scene.tool is not None
    try:
        return find_shear_band(scene.raster, rate, material == Material.WORKPIECE, scene.tool)
    except NoShearBandError:
        return None


def _sweep(scene: Scene, indices: range, band: ShearBand) -> float:
    """Return the travel of the largest strain rate on the line across the band's middle."""
    line = band.across(_SWEEP_REACH, scene.raster.spacing / 2)
    places = []
    for index in (indices[0], indices[-1]):
        rate = scene.field("plastic_strain_rate", index)
        values = np.nan_to_num(sample(rate, scene.raster, line.points))
        inside = 0 < values.argmax() < values.size - 1
        places.append(float(line.distance[values.argmax()]) if inside else nan)
    return abs(places[1] - places[0])
