"""Images of all exposures on the page: reference, measurement and error, with one slider."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any, Final, NamedTuple

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import KELVIN
from chipglow.quantities.format import quantity_text
from chipglow.report.facts import Facts, time_text
from chipglow.report.page import texts
from chipglow.scene import Raster

_COLOURS: Final = 255


class Curve(NamedTuple):
    """A curve on all images, in the unit of the drawing; on those of one frame if it is given."""

    points: str
    kind: str
    frame: int | None = None


@dataclass(frozen=True)
class View:
    """One quantity through time: images of shape (time, y, x) in the unit, NaN where undefined."""

    title: str
    frames: NDArray[np.float64]
    limits: tuple[float, float]
    colours: str
    alt: str
    unit: str = "°C"

    @property
    def pictures(self) -> list[str]:
        return [self._picture(frame) for frame in self.frames]

    @property
    def scale(self) -> str:
        return self._picture(np.linspace(*self.limits, 256)[None])

    @property
    def low(self) -> str:
        return quantity_text(self.limits[0], self.unit, 0)

    @property
    def high(self) -> str:
        return quantity_text(self.limits[1], self.unit, 0)

    def _picture(self, values: NDArray[np.float64]) -> str:
        """Return a data URL of a PNG with one pixel per value; index 0 is undefined."""
        low, high = self.limits
        part = np.clip((values - low) / (high - low), 0.0, 1.0)
        index = np.where(np.isfinite(values), 1 + np.round(part * (_COLOURS - 1)), 0)
        colours = matplotlib.colormaps[self.colours](np.linspace(0.0, 1.0, _COLOURS))[:, :3]
        palette = np.concatenate([[to_rgb(scales.VOID)], colours])
        image = Image.fromarray(np.nan_to_num(index).astype(np.uint8))
        image.putpalette(np.round(palette * 255).astype(np.uint8).tobytes())
        return drawing.data_url(drawing.png(image))


@dataclass(frozen=True)
class Player:
    """Views of the same frames with their times; `still` is shown first, and in print."""

    title: str
    caption: str
    views: Sequence[View]
    times: Sequence[str]
    still: int
    raster: Raster
    curves: Sequence[Curve]

    @property
    def box(self) -> str:
        """View box of the drawing on an image."""
        left, right, bottom, top = self._extent
        return f"{left:.1f} {-top:.1f} {right - left:.1f} {top - bottom:.1f}"

    @property
    def scale_bar(self) -> dict[str, Any]:
        left, right, bottom, top = self._extent
        length = _round_down((right - left) / 4)
        x, y, size = left + (right - left) / 25, -bottom - (top - bottom) / 16, (right - left) / 18
        return {
            "points": f"{x:.1f},{y:.1f} {x + length:.1f},{y:.1f}",
            "x": f"{x:.1f}",
            "y": f"{y - size / 2:.1f}",
            "size": f"{size:.1f}",
            "stroke": f"{size / 6:.2f}",
            "text": f"{length:g} {drawing.length_unit(self.raster)[1]}",
        }

    @property
    def _extent(self) -> NDArray[np.float64]:
        return np.array(self.raster.extent) * drawing.length_unit(self.raster)[0]


def _round_down(length: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not over a length."""
    power = 10.0 ** floor(log10(length))
    return max(step * power for step in (1, 2, 5) if step * power <= length)


def exposure_player(facts: Facts) -> Player:
    """Return the images of an analysis: of the longest part of a cut, else of all exposures."""
    analysis = facts.analysis
    starts = analysis.data.instant.values[: facts.starts]
    raster = next(iter(analysis.measurements.values())).raster
    return Player(
        title=texts()["figures"]["player"]["title"],
        caption=facts.text(texts()["figures"]["player"]["caption"]),
        views=list(_views(facts)),
        times=[
            f"Exposure {i + 1} of {len(starts)}: begins at {time_text(start, '.4g')}, lasts "
            f"{time_text(analysis.camera.integration_time)}."
            for i, start in enumerate(starts)
        ],
        still=int(analysis.data.attrs["shown_instant"]),
        raster=raster,
        curves=list(_curves(facts, drawing.length_unit(raster)[0])),
    )


def _curves(facts: Facts, factor: float) -> Iterator[Curve]:
    """Yield tool, places of the readings and, of a cut, the band's ridge in every exposure."""
    cut, still = facts.analysis.cut, int(facts.data.attrs["shown_instant"])
    if facts.analysis.tool is not None:
        yield Curve(_points(factor * facts.analysis.tool.outline(3e-3)), "tool")
    for i, instant in enumerate(cut.one_segment if cut else ()):
        if instant.band is not None:
            yield Curve(_points(factor * instant.band.ridge.points), "ridge", i)
    for points in facts.analysis.read_curves():
        if len(points) > 1:
            yield Curve(_points(factor * points), "line", still if cut else None)
        else:
            yield Curve(_points(factor * points.repeat(2, axis=0)), "spot")


def _points(points: NDArray[np.float64]) -> str:
    return " ".join(f"{x:.1f},{-y:.1f}" for x, y in points)


def _views(facts: Facts) -> Iterator[View]:
    """Yield three views for each surface that is read; colours are the same in all rows."""
    data = facts.data.isel(instant=slice(facts.starts)).sel(surface=facts.read_surfaces)
    reference, measured = data.reference_temperature - KELVIN, data.radiance_temperature - KELVIN
    error = measured - reference
    heat = facts.heat_limits(reference.values)
    largest = scales.round_limit(error.values, 99.0, 10.0)
    for name in facts.read_surfaces:
        of = f", {name}" if len(facts.read_surfaces) > 1 else ""
        for title, images, limits, colours, alt in (
            ("Reference", reference, heat, scales.HEAT, "reference, sharp and mottled"),
            ("Measured", measured, heat, scales.HEAT, "measured radiance temperature, blurred"),
            ("Error", error, (-largest, largest), scales.SIGNED, "error, blue where negative"),
        ):
            frames = images.sel(surface=name).values.astype(np.float64)
            unit = "K" if title == "Error" else "°C"
            yield View(f"{title}{of}", frames, limits, colours, f"Image of the {alt}{of}.", unit)
