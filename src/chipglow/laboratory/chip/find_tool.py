"""Detection of the rake face: the line where the chip's radiance ends and the tool's begins."""

from dataclasses import dataclass, replace
from math import atan, cos, degrees, radians, sqrt, tan
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, maximum_filter
from scipy.special import ndtr

from chipglow.camera import Measurement
from chipglow.laboratory.chip.tool_position import ToolUncertainty
from chipglow.quantities import TINY, Array
from chipglow.scene import Raster, ToolGeometry
from chipglow.text import Notes

_REACH: Final = 6
"""Pixels of a row on either side of a line in which its fit is judged."""

_SEARCH: Final = radians(20.0)
"""Largest difference of the rake angle from the assumed one, in rad."""

_STEP: Final = radians(1.0)
"""Step of the searched rake angles in rad."""

_SLOPE_RANGE: Final = tan(radians(4.0))
"""Largest change of the slope of a line after the search: four of its steps."""

_COARSE_BLUR: Final = 1.0
"""Standard deviation in pixels of the blur of a break, in the search."""

_DECAY_LENGTHS: Final = (2.0, 6.0)
"""Distances in pixels over which the fitted courses fall off with the distance from the face."""

_PLACE_RANGE: Final = 3.0
"""Largest change of the place of a line in the fit, in pixels: half of `_REACH`."""

_BLURS: Final = (0.4, 3.0)
"""Smallest and largest standard deviation of the fitted blur in pixels.

The smallest is above the 0.29 of a square pixel, 12^(-1/2); the largest is half of `_REACH`.
"""

_BLUR_STARTS: Final = (0.5, 2.9)
"""Range of the blur from which a fit starts, within that of the fit."""

_OUTLIER: Final = 0.02
"""Residual, as a fraction of the level, beyond which a pixel counts less (soft L1)."""

_SMOOTH_TERMS: Final = 5
"""Terms of the polynomial of a row without a break: nearly the 6 terms with one, so that a gain is
that of the break."""

_CONTRAST_LIMIT: Final = 0.3
"""Largest gain of a row in the search, as a fraction of its level, so that no few rows of high
contrast outweigh the others."""

_DARK_FRACTION: Final = 0.02
"""Fraction of the brightest radiance that keeps the level of a dark row off 0."""

_MIN_PROMINENCE: Final = 8.0
"""Smallest prominence of a line that is not noise: its score above the median of all lines, in
median absolute deviations."""

_SURE_PROMINENCE: Final = 10.0
"""Prominence below which the line is doubted."""

_RIVAL_SCORE: Final = 0.7
"""Fraction of the best score from which the score of another line is about as good."""

_FACE_GAIN: Final = 0.5
"""Fraction of the typical gain, that of the better half of the rows, from which a row shows the
face."""

_PEAK_SIZE: Final = (7, 9)
"""Steps of the angle and pixels within which only the best line is kept."""

_FEWEST_ROWS: Final = 12
"""Fewest rows that show the face: four for each of the fitted place, slope and blur."""

_BLOCKS: Final = 8
"""Blocks of rows of the jackknife."""

_MAX_RESIDUAL: Final = 3.0
"""Residual of a row, in the rows' median, above which it is left out."""

_DOUBTED_ANGLE: Final = radians(1.0)
"""Standard uncertainty of the rake angle in rad above which the line is doubted."""

_TIP_PIXELS: Final = 2.0
"""Standard uncertainty of the tip along the face in pixels."""

_LINE_SHIFT: Final = 0.5 / sqrt(3.0)
"""Standard uncertainty in pixels of a line that may be off by half a pixel (rectangular)."""


@dataclass(frozen=True)
class FoundTool:
    """A tool detected in an image."""

    tool: ToolGeometry
    """The tool in the measurement's coordinates."""
    uncertainty: ToolUncertainty
    """Standard uncertainties of its place and its rake angle."""
    notes: Notes
    """The assumed shape, and reasons why it may not be the rake face."""


def find_tool(measurement: Measurement, shape: ToolGeometry | None = None) -> FoundTool:
    """Find the rake face in a measurement.

    Parameters
    ----------
    measurement : Measurement
        Frames in which the tool stands still; their mean is looked at.
    shape : ToolGeometry, optional
        Assumed tool, the paper's by default. Its rake angle is looked for within 20 degrees; its
        edge and its clearance angle are taken as they are.

    Notes
    -----
    Every straight line is scored by how much a break between two parabolas on it explains along the
    rows; the rightmost of the best is the rake face, as the chip's back is further left. Then the
    line and the width of the blur are fitted to all rows at once, with courses that fall with the
    distance from the face over 2 and 6 pixels and a constant on either side.

    The uncertainties come from the jackknife over blocks of rows (type A) and of limits of a
    rectangular distribution (type B): half a pixel for the position as a whole, a pixel for either
    end of the face. The tip is where the radiance along the face has fallen to half of its largest
    value, within 2 pixels and half the edge radius.
    """
    shape, raster, pitch = shape or ToolGeometry(), measurement.raster, measurement.raster.spacing
    image = np.nan_to_num(measurement.radiance, posinf=0.0, neginf=0.0).mean(axis=0)
    angles = shape.rake_angle + np.arange(-_SEARCH, _SEARCH + _STEP / 2, _STEP)
    start, prominence = _best_line(image, angles)
    rows = _rows_with_face(image, start)
    if rows.size < _FEWEST_ROWS:
        raise _not_found(f"only {rows.size} rows of the image show one")
    fit = _fit(image, rows, _best_start(image, rows, start))
    residuals = np.sqrt((_Strip(fit, image, rows).residuals(fit) ** 2).mean(axis=-1))
    rows = rows[residuals <= _MAX_RESIDUAL * np.median(residuals)]
    fit = _fit(image, rows, fit)
    angle_error, place_error = _jackknife(image, rows, fit)
    angle = atan(fit[1])
    tip_row, tip_seen = _tip_row(image, fit, rows)
    tool = _placed(replace(shape, rake_angle=angle), raster, fit, tip_row)
    middle = raster.top - pitch * (float(rows.mean()) + 0.5)
    uncertainty = ToolUncertainty(
        along=sqrt((_TIP_PIXELS * pitch) ** 2 + (shape.edge_radius / 2) ** 2),
        across=pitch * sqrt(place_error**2 + _LINE_SHIFT**2),
        angle=sqrt(angle_error**2 + 2 * (2 * _LINE_SHIFT / rows.size) ** 2),
        pivot=(middle - float(tool.rake_foot[1])) / cos(tool.rake_angle),
    )
    assumed = (
        f"The clearance angle is {degrees(shape.clearance_angle):.3g} deg, the edge radius "
        f"{1e6 * shape.corner_radius:.3g} um."
    )
    doubts = {
        "The rake face hardly stands out from the noise of the image.": prominence
        < _SURE_PROMINENCE,
        "The rows of the image do not agree on the rake angle.": angle_error > _DOUBTED_ANGLE,
        "The rows of the image do not agree on a line within a pixel.": place_error > 1.0,
        f"The rake angle of {degrees(angle):.1f} degrees is at the limit of the search range.": (
            not angles[0] < angle < angles[-1]
        ),
        "The tip is not in the image: lengths count from its lower end.": not tip_seen,
    }
    warnings = [text for text, applies in doubts.items() if applies]
    return FoundTool(tool, uncertainty, Notes([assumed], warnings))


def _not_found(reason: str) -> ValueError:
    return ValueError(
        f"find tool: no rake face is found, {reason}; expected an image of a chip on a tool whose "
        "radiance differs from the chip's"
    )


def _best_line(image: Array, angles: Array) -> tuple[Array, float]:
    """Return the rightmost line that explains about as much as the best, and its prominence."""
    if image.shape[1] < 2 * _REACH + 2:
        raise _not_found(f"the image is {image.shape[1]} pixels wide")
    scores = np.stack([_scores(image, tan(angle)) for angle in angles])
    middle = float(np.median(scores))
    spread = float(np.median(np.abs(scores - middle)))
    best = float(scores.max())
    # Scores are up to 1; less than this is rounding.
    prominence = (best - middle) / max(spread, 1e-12)
    if not prominence > _MIN_PROMINENCE:
        raise _not_found("nothing stands out from the noise")
    peaks = (scores == maximum_filter(scores, size=_PEAK_SIZE)) & (scores >= _RIVAL_SCORE * best)
    at_angle, at_place = np.nonzero(peaks)
    right = int(at_place.argmax())
    place, slope = at_place[right] + _REACH, tan(angles[at_angle[right]])
    return np.array([place, slope, _COARSE_BLUR]), prominence


def _scores(image: Array, slope: float) -> Array:
    """Score lines of one slope, by the column in the middle row."""
    rows, columns = np.indices(image.shape, dtype=np.float64)
    shift = _up(image, rows) * slope
    turned = map_coordinates(image, [rows, columns + shift], order=1, mode="nearest")
    windows = np.lib.stride_tricks.sliding_window_view(turned, 2 * _REACH + 1, axis=1)
    gain = _gain(windows, np.zeros(windows.shape[:2]), _COARSE_BLUR, image)
    inside = (columns + shift)[:, _REACH:-_REACH]
    there = (inside > _REACH) & (inside < image.shape[1] - 1 - _REACH)
    return np.asarray(np.where(there, np.minimum(gain, _CONTRAST_LIMIT), 0.0).mean(axis=0))


def _up(image: Array, rows: Any) -> Array:
    """Count rows up from the middle one."""
    return np.asarray((image.shape[0] - 1) / 2 - rows, dtype=np.float64)


def _gain(windows: Array, place: Array, blur: float, image: Array) -> Array:
    """Return the root mean square that a break explains, as a fraction of the level."""
    steps = np.arange(-_REACH, _REACH + 1.0)
    basis = _parabolas(steps - place[..., None] if np.any(place) else steps, blur)
    smooth = np.stack([steps**power for power in range(_SMOOTH_TERMS)], axis=-1)
    explained = (_residuals(windows, smooth) ** 2).sum(axis=-1)
    explained -= (_residuals(windows, basis) ** 2).sum(axis=-1)
    explained = np.sqrt(np.maximum(explained, 0.0) / steps.size)
    return np.asarray(explained / (_level(windows, image) + TINY))


def _level(windows: Array, image: Array) -> Array:
    """Return the mean radiance of each window, kept off 0 by 2 % of the brightest in the image."""
    bright = np.percentile(image, 99.0)  # the maximum may be a defective pixel
    return np.asarray(windows.mean(axis=-1) + _DARK_FRACTION * bright)


def _parabolas(offset: Array, blur: float) -> Array:
    """Return a parabola and one that begins at offset 0, blurred by a Gaussian, (..., 6)."""
    step = ndtr(offset / blur)
    bell = blur * np.exp(-0.5 * (offset / blur) ** 2) / sqrt(2 * np.pi)
    begun = (step, offset * step + bell, (offset**2 + blur**2) * step + offset * bell)
    return np.stack([np.ones_like(offset), offset, offset**2, *begun], axis=-1)


def _decays(offset: Array, blur: float) -> Array:
    """Return courses that fall with the distance from offset 0 on either side, shape (..., 6)."""
    courses = []
    for away in (offset, -offset):
        courses.append(ndtr(away / blur))
        for length in _DECAY_LENGTHS:
            fall = np.exp(blur**2 / (2 * length**2) - away / length)
            courses.append(fall * ndtr(away / blur - blur / length))
    return np.stack(courses, axis=-1)


def _residuals(windows: Array, basis: Array) -> Array:
    """Return the residuals of a linear model of each window."""
    frame, _ = np.linalg.qr(basis)
    if frame.ndim == 2:
        return np.asarray(windows - windows @ frame @ frame.T)
    parts = np.einsum("...sk,...s->...k", frame, windows)
    return np.asarray(windows - np.einsum("...sk,...k->...s", frame, parts))


class _Strip:
    """Pixels of rows beside a line, shape (rows, pixels), and their level; not resampled."""

    def __init__(self, line: Array, image: Array, rows: NDArray[np.int64]) -> None:
        self.up = _up(image, rows)
        nearest = np.rint(line[0] + line[1] * self.up).astype(np.int64)
        self.middle = np.clip(nearest, _REACH, image.shape[1] - 1 - _REACH)
        self.windows = image[rows[:, None], self.middle[:, None] + np.arange(-_REACH, _REACH + 1)]
        self.level = _level(self.windows, image)

    def place(self, line: Array) -> Array:
        """Return the place of a line in each window, from its middle pixel."""
        return np.asarray(line[0] + line[1] * self.up - self.middle, dtype=np.float64)

    def residuals(self, line: Array) -> Array:
        """Return the residuals of each row as fractions of its level, shape (rows, pixels)."""
        steps = np.arange(-_REACH, _REACH + 1.0) - self.place(line)[:, None]
        return _residuals(self.windows, _decays(steps, float(line[2]))) / self.level[:, None]


def _rows_with_face(image: Array, line: Array) -> NDArray[np.int64]:
    """Return the rows in which a break on the line explains something."""
    every = np.arange(image.shape[0], dtype=np.int64)
    place = line[0] + line[1] * _up(image, every)
    rows = every[(place > _REACH) & (place < image.shape[1] - 1 - _REACH)]
    strip = _Strip(line, image, rows)
    gain = _gain(strip.windows, strip.place(line), line[2], image)
    typical = np.median(np.sort(gain)[-rows.size // 2 :])
    return np.asarray(rows[gain > _FACE_GAIN * typical], dtype=np.int64)


def _best_start(image: Array, rows: NDArray[np.int64], start: Array) -> Array:
    """Return the best of the lines around one: the least squares have several minima."""
    lines = [
        start + np.array([place, slope, 0.0])
        for place in np.linspace(-4.0, 4.0, 17)  # half a pixel apart
        for slope in np.linspace(-_SLOPE_RANGE, _SLOPE_RANGE, 9)  # a degree apart
    ]
    left = [np.abs(_Strip(line, image, rows).residuals(line)).sum() for line in lines]
    return np.asarray(lines[int(np.argmin(left))], dtype=np.float64)


def _fit(image: Array, rows: NDArray[np.int64], start: Array) -> Array:
    """Fit column in the middle row, slope and width of the blur in pixels."""
    # Windows that moved with the line would make the sum of squares jump.
    strip = _Strip(start, image, rows)
    room = np.array([_PLACE_RANGE, _SLOPE_RANGE])
    lower, upper = start[:2] - room, start[:2] + room
    least_blur, most_blur = _BLURS
    found = scipy.optimize.least_squares(
        lambda line: strip.residuals(line).ravel(),
        [start[0], start[1], np.clip(start[2], *_BLUR_STARTS)],
        bounds=([*lower, least_blur], [*upper, most_blur]),
        x_scale=[1.0, 0.05, 1.0],  # a pixel, 3 degrees, a pixel
        loss="soft_l1",
        f_scale=_OUTLIER,
    )
    return np.asarray(found.x, dtype=np.float64)


def _jackknife(image: Array, rows: NDArray[np.int64], fit: Array) -> tuple[float, float]:
    """Return standard uncertainties of the angle in rad, and of the place in pixels."""
    middle = float(_up(image, rows).mean())
    blocks = np.array_split(rows, min(_BLOCKS, rows.size))
    fits = np.array([_fit(image, np.setdiff1d(rows, block), fit) for block in blocks])
    place = (fits[:, 0] + middle * fits[:, 1]) * cos(atan(fit[1]))
    errors = np.sqrt((len(fits) - 1) * np.stack([np.arctan(fits[:, 1]), place]).var(axis=1))
    return float(errors[0]), float(errors[1])


def _tip_row(image: Array, line: Array, rows: NDArray[np.int64]) -> tuple[float, bool]:
    """Return the row at which the radiance on the face falls to half, and whether it does."""
    windows = _Strip(line, image, np.arange(image.shape[0])).windows
    level = windows[:, _REACH - 1 : _REACH + 2].mean(axis=-1)
    hottest = int(rows[level[rows].argmax()])
    below = np.flatnonzero(level[hottest:] < level[hottest] / 2)
    if below.size == 0:
        return float(image.shape[0] - 1), False
    row = hottest + int(below[0])
    upper, lower = level[row - 1], level[row]
    return row - 1 + float((upper - level[hottest] / 2) / (upper - lower)), True


def _placed(tool: ToolGeometry, raster: Raster, line: Array, tip_row: float) -> ToolGeometry:
    """Place the tool with its lowest point at the tip's row and its face on the line."""
    tip_y = raster.top - raster.spacing * (tip_row + 0.5)
    foot = tool.rake_foot + np.array([0.0, tip_y])
    row = (raster.top - foot[1]) / raster.spacing - 0.5
    column = line[0] + line[1] * ((raster.rows - 1) / 2 - row)
    on_line = raster.left + raster.spacing * (column + 0.5)
    return tool.at((float(on_line - foot[0]), float(tip_y)))
