"""A segment of the chip during one exposure: its shear band and its contact with the tool."""

from dataclasses import dataclass
from math import nan

import numpy as np

from chipglow.camera import frame_weights
from chipglow.laboratory.chip.contact import contact_length
from chipglow.laboratory.chip.ridge import NoShearBandError
from chipglow.laboratory.chip.shear_band import ShearBand, find_shear_band
from chipglow.quantities import Array
from chipglow.scene import Frame, Material, Raster, Scene, Tool, sample


@dataclass(frozen=True)
class Instant:
    """The shear band during one exposure."""

    start: float
    """When the exposure begins in s."""
    band: ShearBand | None
    """Ridge of the strain rate's mean over the exposure; None if there is none."""
    temperatures: Array
    """Mean true temperature over the exposure along the ridge in K, shape (n,); NaN outside the
    scene, empty without a band.
    """

    @property
    def mean_temperature(self) -> float:
        """Mean of the temperatures along the ridge in K; NaN without a band."""
        known = self.temperatures[np.isfinite(self.temperatures)]
        return float(known.mean()) if known.size else nan

    @classmethod
    def at(cls, scene: Scene, start: float, duration: float) -> "Instant":
        """Find the band during an exposure."""
        indices, weights = frame_weights(scene.times, scene.frame_spacing, start, duration)
        rate = _mean(scene, "plastic_strain_rate", indices, weights)
        workpiece = scene.field("material", indices[len(indices) // 2]) == Material.WORKPIECE
        assert scene.tool is not None
        try:
            band = find_shear_band(scene.raster, rate, workpiece, scene.tool)
        except NoShearBandError:
            return cls(start, None, np.zeros(0))
        temperature = _mean(scene, "temperature", indices, weights)
        return cls(start, band, sample(temperature, scene.raster, band.ridge.points))


@dataclass(frozen=True)
class Segment:
    """A segment of the chip whose shear band is developed, and where its errors are read."""

    start: float
    """When the exposure begins in s."""
    frame: Frame
    """The scene in the middle of the exposure."""
    tool: Tool
    band: ShearBand
    """Ridge of the strain rate's mean over the exposure."""
    contact_length: float
    """Length over which the chip touches the rake face in m."""
    momentary_band: ShearBand | None
    """The band in `frame` alone, which motion does not blur; None if there is none."""
    sweep: float
    """How far the band's middle moves across itself during the exposure, in m; NaN where it is
    not found in both the first and the last frame.
    """

    @property
    def moment(self) -> ShearBand:
        """The band at one moment, where there is one, else that over the exposure."""
        return self.momentary_band or self.band

    @property
    def band_width(self) -> float:
        """Width of the band at one moment in m."""
        return self.moment.width

    @classmethod
    def of(cls, scene: Scene, instant: Instant, duration: float, touching: float) -> "Segment":
        """The segment at an instant that has a band."""
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
            momentary_band=_momentary_band(scene.raster, frame, scene.tool),
            sweep=_sweep(scene, indices, instant.band),
        )


def _mean(scene: Scene, field_name: str, indices: range, weights: Array) -> Array:
    total = np.zeros(scene.raster.shape)
    for index, weight in zip(indices, weights, strict=True):
        total += weight * scene.field(field_name, index)
    return total


def _momentary_band(raster: Raster, frame: Frame, tool: Tool) -> ShearBand | None:
    workpiece = frame.material == Material.WORKPIECE
    try:
        return find_shear_band(raster, frame.needed("plastic_strain_rate"), workpiece, tool)
    except NoShearBandError:
        return None


def _sweep(scene: Scene, indices: range, band: ShearBand) -> float:
    """Travel of the greatest strain rate on the line across the band's middle."""
    line = band.across(40e-6, scene.raster.spacing / 2)
    places = []
    for index in (indices[0], indices[-1]):
        rate = scene.field("plastic_strain_rate", index)
        values = np.nan_to_num(sample(rate, scene.raster, line.points))
        inside = 0 < values.argmax() < values.size - 1
        places.append(float(line.distance[values.argmax()]) if inside else nan)
    return abs(places[1] - places[0])
