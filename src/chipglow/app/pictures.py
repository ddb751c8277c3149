"""Pictures of a page: images, lines and numbers at a state of the controls."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from math import nan
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis import Distribution
from chipglow.app.controls import CORRECTION_IMAGES, LINES, State
from chipglow.camera import Camera, Exposure
from chipglow.correction import Correction
from chipglow.drawing.scales import HEAT, PLAIN, SIGNED, ends, round_limit
from chipglow.quantities import ZERO_CELSIUS, Array, Brief
from chipglow.scene import Raster, Tool, sample
from chipglow.scene.lines import nearest, nearest_sample

_STEP: Final = 16
"""Pixels by which this part follows the cursor, so that few moves need a new correction."""


_SHORT_TITLES: Final = {"measured": "Measured", "corrected": "Corrected", "true": "True"}
"""Titles of images of temperatures, of which many stand in a row."""

_LONG_TITLES: Final = 2
"""Images of a correction, next to the measured one, up to which titles are longer."""

_LINE_OF: Final = {
    "reference": "true", "corrected": "temperature", "low": "lower", "high": "upper",
}  # fmt: skip
"""Variables of a correction that are drawn along lines, by the names of their curves."""


@dataclass(frozen=True, eq=False, repr=False)
class Panel(Brief):
    """An image as a figure shows it, NaN where it is grey."""

    name: str
    unit: str
    values: NDArray[Any]
    raster: Raster
    limits: tuple[float, float]
    colours: str


@dataclass(frozen=True)
class CorrectedPixel:
    """A corrected pixel: temperatures in K (NaN: unknown), expanded uncertainty, and by source."""

    temperature: float
    expanded_uncertainty: float
    true: float
    contributions: Mapping[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Corrected(Brief):
    """A part of an image, corrected, and its true temperature in K if it is known."""

    correction: Correction
    true: Array | None = None
    frame: int = 0

    @property
    def data(self) -> xr.Dataset:
        """The frame of the correction."""
        return self.correction.data.isel(time=self.frame)

    @cached_property
    def images(self) -> Mapping[str, Array]:
        """The images of `CORRECTION_IMAGES` that are known: temperatures in °C, others in K."""
        kelvins = np.asarray(self.data["temperature"].values, np.float64)
        images = {
            "corrected": kelvins - ZERO_CELSIUS,
            "half_width": self.correction.half_width(self.frame),
        }
        if self.true is not None:
            images["true"] = np.where(np.isnan(kelvins), nan, self.true) - ZERO_CELSIUS
            images["error"] = kelvins - self.true
        return images

    def at(self, place: tuple[float, float]) -> CorrectedPixel | None:
        """Return the pixel at x and y in m; None without a corrected temperature."""
        try:
            estimate = self.correction.at(place, self.frame)
        except ValueError:
            return None
        budget = self.correction.budget(place, self.frame)
        true = nan
        if self.true is not None:
            true = float(nearest(self.true, self.correction.raster, place))
        return CorrectedPixel(
            float(estimate.values),
            float(estimate.expanded_uncertainty()),
            true,
            dict(zip(budget.cause, budget.standard_uncertainty, strict=True)),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Picture(Brief):
    """Images over the pixels in K and lines in µm and °C at a state; `quick` marks coarse ones."""

    state: State
    raster: Raster
    data: xr.Dataset  # of a scene that of `error_images`, else ``measured`` and ``flagged``
    panels: dict[str, Panel]
    lines: dict[str, dict[str, Array]]  # ``along``, ``measured`` and ``reference`` by name
    crossings: dict[str, float]  # distances at which lines enter the tool in µm
    quick: bool = False
    camera: Camera | None = None
    exposure: Exposure | None = None
    parts: Callable[[], xr.Dataset] | None = None  # computes the `error_parts`
    absent: Mapping[str, str] = field(default_factory=dict)  # why error images are 0 everywhere
    reference: str = ""  # label of the reference
    corrected: Corrected | None = None
    second: Panel | None = None  # image of the second camera

    @property
    def lower_limit(self) -> float | None:
        """Lower range limit of the camera in °C."""
        limit = self.camera.lower_limit if self.camera else None
        return None if limit is None else limit - ZERO_CELSIUS


@dataclass(frozen=True, eq=False, repr=False)
class Drawn(Brief):
    """Measured lines in °C, shape (draw, n), and error at the cursor over phases and textures."""

    state: State
    lines: dict[str, Array]
    error: Distribution | None


def with_correction(
    picture: Picture, corrected: Corrected | None, names: tuple[str, ...]
) -> Picture:
    """Return the picture with its measured image, and those of a correction by their names.

    They are grey where not known.
    """
    measured = picture.panels["measured"]
    raster = corrected.correction.raster if corrected else picture.raster
    known = corrected.images if corrected else {}
    images = {name: known.get(name, _unknown(raster.shape)) for name in names}
    low, high = measured.limits
    temperature = images["corrected"]
    if np.isfinite(temperature).any():
        low, high = min(low, np.nanmin(temperature)), max(high, np.nanmax(temperature))
    is_short = len(names) > _LONG_TITLES
    title = _SHORT_TITLES["measured"] if is_short else measured.name
    panels = {"measured": replace(measured, name=title, limits=(low, high))}
    for name, image in images.items():
        title = CORRECTION_IMAGES[name]
        title = _SHORT_TITLES.get(name, title) if is_short else title
        if name == "error":
            panels[name] = error_panel(title, image, raster)
        elif name == "half_width":
            limits = 0.0, round_limit(image, 98, 5.0)
            panels[name] = Panel(title, "K", image, raster, limits, PLAIN)
        else:
            panels[name] = Panel(title, "°C", image, raster, (low, high), HEAT)
    lines = {
        name: curves | _corrected_line(picture, corrected, name)
        for name, curves in picture.lines.items()
    }
    others = {name: panel for name, panel in picture.panels.items() if name not in panels}
    kept = {} if "scene" in others else others
    return replace(picture, panels=panels | kept, lines=lines, corrected=corrected)


@lru_cache(maxsize=2)
def _unknown(shape: tuple[int, int]) -> Array:
    """Return an image without values; the same one again, which a page then has already."""
    return np.full(shape, nan)


def _corrected_line(picture: Picture, corrected: Corrected | None, name: str) -> dict[str, Array]:
    """Return the corrected temperature along a line, its interval and the true one in °C."""
    if corrected is None:
        unknown = np.full_like(picture.lines[name]["along"], nan)
        return {"reference": unknown} if "scene" in picture.panels else {}
    data = corrected.data
    if corrected.true is not None:
        data = data.assign(true=(("y", "x"), corrected.true))
    line = picture.state.line(name).line(picture.raster.spacing)
    return {
        key: sample(data[variable].values, corrected.correction.raster, line.points) - ZERO_CELSIUS
        for key, variable in _LINE_OF.items()
        if variable in data
    }


def lines_of(state: State, raster: Raster, data: xr.Dataset) -> dict[str, dict[str, Array]]:
    """Return images in °C along the lines, whose distances are in µm."""
    lines = {}
    for name in LINES:
        line = state.line(name).line(raster.spacing)
        lines[name] = {"along": 1e6 * line.distance} | {
            key: sample(data[key].values, raster, line.points) - ZERO_CELSIUS
            for key in ("measured", "reference")
            if key in data
        }
    return lines


def crossings_of(state: State, tool: Tool | None) -> dict[str, float]:
    """Return the distances in µm at which lines enter the tool."""
    found = {}
    for name in LINES if tool is not None else ():
        line = state.line(name).line(1e-6)  # m between points, finer than a pixel of the figure
        depth = tool.signed_distance(*line.points.T)  # type: ignore[union-attr]
        if depth.min() < 0 < depth.max():
            found[name] = float(1e6 * line.distance[np.abs(depth).argmin()])
    return found


def measured_panel(data: xr.Dataset, raster: Raster) -> Panel:
    """Return the measured image in °C."""
    values = unflagged(data, data["measured"]) - ZERO_CELSIUS
    limits = ends(values, 0.0, 100.0, 10.0)
    return Panel("Measured radiance temperature", "°C", values, raster, limits, HEAT)


def error_title(reference: str) -> str:
    """Return the title of an error image by the label of its reference."""
    return f"Error against {reference[0].lower()}{reference[1:]}"


def error_panel(title: str, values: Array, raster: Raster) -> Panel:
    """Return an error image in K with limits of equal size."""
    limit = round_limit(values, 99, 5.0)
    return Panel(title, "K", values, raster, (-limit, limit), SIGNED)


def unflagged(data: xr.Dataset, image: xr.DataArray) -> Array:
    """Return an image that is NaN where pixels are flagged."""
    return np.where(data["flagged"].values, nan, image.values)


def pixel_at(raster: Raster, at: tuple[float, float]) -> tuple[int, int]:
    """Return row and column of the pixel at x and y in m."""
    row, column = nearest_sample(raster, at)
    return int(row.clip(0, raster.rows - 1)), int(column.clip(0, raster.columns - 1))


def values_at(data: xr.Dataset, raster: Raster, at: tuple[float, float]) -> dict[str, float]:
    """Return the values of the pixel at x and y in m."""
    return {str(name): float(nearest(one.values, raster, at)) for name, one in data.items()}


def around_cursor(state: State, pixels: Raster, half: int) -> tuple[slice, slice]:
    """Return the rows and columns of pixels that are corrected; the cursor is well inside."""
    x, y = state.cursor
    places = (pixels.top - y) / pixels.spacing, (x - pixels.left) / pixels.spacing
    middles = (round(place / _STEP) * _STEP for place in places)
    return tuple(  # type: ignore[return-value]
        slice(max(middle - half, 0), min(middle + half, count))
        for middle, count in zip(middles, pixels.shape, strict=True)
    )


def nearest_time(times: Array, state: State) -> int:
    """Return the index of the frame that began nearest to the state's start."""
    return int(np.abs(times - state.study.start).argmin())
