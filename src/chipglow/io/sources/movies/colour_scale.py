"""Colour scales: values from the colours of a picture."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import sqrt
from typing import Final, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.special import erfc

from chipglow.io.sources.source import SourceError, naming

RAINBOW: Final = "rainbow"
"""Blue, cyan, green, yellow, red at full saturation, as finite-element programs draw it."""

Picture: TypeAlias = NDArray[np.uint8]
"""Red, green and blue of the pixels, row 0 at the top, shape (y, x, 3)."""

_LEVELS: Final = 256
"""Number of colours of a named map without bands, as many as 8 bits distinguish."""

_SAME: Final = 7.0  # a difference in Lab that a codec makes between two pixels of one colour

_APART: Final = 15.0
"""Difference in Lab beyond which a scale has left a colour: twice what codecs change."""

_COMPARED: Final = 192
"""Most knots compared in pairs to find a repeated colour: limits time and memory."""

_CHORD: Final = 0.01  # half of the fraction of the scale over which its slope is taken

_FEWEST_BANDS, _MOST_BANDS = 2, 40
"""Numbers of bands that are tried."""

_NARROWEST_BAND: Final = 6
"""Width in pixels of the narrowest band: `_BLURRED` pixels at both edges and a middle."""

_BLURRED: Final = 2.0
"""Pixels on either side of an edge between bands whose colours are mixed by codecs."""

_BANDED: Final = 0.5
"""Misfit of bands, by that of lines between them, below which a legend has bands."""

_AS_WELL, _AS_WELL_LAB = 2.0, 0.5
"""Factor and addend in CIE L*a*b* by which the misfit of fewer bands may exceed the smallest.

A box that is off by 2 pixels shifts the edges of the bands, to which multiples of their number fit
slightly better.
"""
_CLEARLY: Final = 0.1  # misfit of bands, by that of lines between them, that leaves no doubt
_COVERAGE: Final = 2.5  # colours of one value differ by up to this multiple of their noise
# D65, IEC 61966-2-1
_WHITE: Final = np.array([[0.95047], [1.0], [1.08883]])
# From linear sRGB to XYZ, IEC 61966-2-1.
_TO_XYZ: Final = (
    np.array(
        [
            [0.4124564, 0.3575761, 0.1804375],
            [0.2126729, 0.7151522, 0.0721750],
            [0.0193339, 0.1191920, 0.9503041],
        ]
    )
    / _WHITE
)


FULL: Final = 255.0
"""Level of a full channel of a picture, which has 8 bits."""


def lab_of_bytes(colours: ArrayLike) -> NDArray[np.float64]:
    """CIE L*a*b* of sRGB colours of 8 bits, shape (..., 3)."""
    return lab(np.asarray(colours) / FULL)


def lab(colours: ArrayLike) -> NDArray[np.float64]:
    """CIE L*a*b* (1976, D65) of sRGB colours of 0 to 1, shape (..., 3)."""
    srgb = np.asarray(colours, np.float64)
    # IEC 61966-2-1, then CIE 15.
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ _TO_XYZ.T
    small = xyz <= (6 / 29) ** 3
    f = np.where(small, xyz * (29 / 6) ** 2 / 3 + 4 / 29, np.cbrt(xyz))
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


@dataclass(frozen=True, eq=False)
class ColourScale:
    """Colours that stand for values; none may stand for two values."""

    values: NDArray[np.float64]
    """Values of the colours in SI units, ascending, shape (n,)."""
    colours: NDArray[np.float64]
    """sRGB of 0 to 1, shape (n, 3)."""
    banded: bool = False
    """Whether each colour stands for a band of values; otherwise values are interpolated."""
    noise: float = 0.0
    """Standard deviation of the colours in CIE L*a*b*, if they were taken from a picture."""

    def __post_init__(self) -> None:
        """Refuse a scale that returns to a colour that it left."""
        chosen = np.unique(np.linspace(0, len(self.knots) - 1, _COMPARED).astype(int))
        labs = self.labs[chosen]
        apart = np.triu(np.linalg.norm(labs[:, None] - labs[None, :], axis=2))
        left = np.maximum.accumulate(apart, axis=1) > _APART
        back = np.argwhere(left & (apart < _SAME) & np.triu(np.ones_like(left), 1))
        if len(back):
            first, second = self.knots[chosen[back[0]]]
            raise SourceError(
                f"colours: {first:.5g} and {second:.5g} have the same colour, expected a scale "
                "that never returns to one"
            )

    @classmethod
    def named(cls, name: str, values: tuple[float, float], bands: int = 0) -> "ColourScale":
        """Return the scale of a map between the values in SI at its first and last edge.

        The map is `RAINBOW` or one of matplotlib (``jet``, ``turbo``, ``viridis``, ``jet_r``);
        ``matplotlib.rainbow`` is matplotlib's own. It has bands of equal width, the first and the
        last with its end colours, or 0 for none.
        """
        count = bands or _LEVELS
        with naming(name):
            return cls._linear(_map_colours(name, count), values, banded=bands > 0)

    @classmethod
    def from_legend(
        cls,
        pixels: NDArray[np.uint8],
        values: tuple[float, float],
        bands: int = 0,
        noise: float = 0.0,
    ) -> "ColourScale":
        """Return the scale of a legend's colours, shape (n, 3), by the values at its two edges.

        Bands are counted if their number is 0; the noise is the standard deviation in L*a*b*.
        """
        colours = pixels / FULL
        count = bands or _equal_bands(colours)
        if count:
            ends = pairwise(np.linspace(0, len(pixels), count + 1))
            colours = np.array([np.median(_inner(colours, *of), axis=0) for of in ends])
        return cls._linear(colours, values, banded=count > 0, noise=noise)

    @classmethod
    def _linear(
        cls,
        colours: NDArray[np.float64],
        values: tuple[float, float],
        *,
        banded: bool,
        noise: float = 0.0,
    ) -> "ColourScale":
        first, last = values
        places = first + (last - first) * (np.arange(len(colours)) + 0.5) / len(colours)
        order = slice(None, None, 1 if last > first else -1)
        return cls(places[order], colours[order], banded, noise)

    @cached_property
    def knots(self) -> NDArray[np.float64]:
        """Values of the colours that differ in 8 bits, the middle of those of one, shape (m,)."""
        first, last = self._runs
        return np.asarray((self.values[first] + self.values[last]) / 2)

    @cached_property
    def widths(self) -> NDArray[np.float64]:
        """Range of values for which each colour of the knots stands, shape (m,)."""
        return self._widths(*self._runs)

    @cached_property
    def uncertainties(self) -> NDArray[np.float64]:
        """Standard uncertainty of the value by the number of distinct colours, shape (m,).

        Adjacent knots whose colours differ by no more than noise are not distinguished. The true
        value and the value that is read are then both anywhere in their range; in the range of a
        single knot the centre is read.
        """
        first, last = self._runs
        below, above = (self._alike(side) for side in (-1, 1))
        alike = self._widths(first[below], last[above])
        return np.sqrt((2 * alike**2 - self.widths**2) / 12)

    def _widths(self, first: NDArray[np.intp], last: NDArray[np.intp]) -> NDArray[np.float64]:
        step = (self.values[-1] - self.values[0]) / max(len(self.values) - 1, 1)
        return np.asarray(self.values[last] - self.values[first] + step)

    def _alike(self, side: int) -> NDArray[np.intp]:
        """Return the farthest knot with the same colour as each knot and all between, (m,)."""
        count = len(self.labs)
        result = np.arange(count)
        growing = result.copy()
        while growing.size:
            beyond = result[growing] + side
            growing, beyond = (of[(beyond >= 0) & (beyond < count)] for of in (growing, beyond))
            apart = np.linalg.norm(self.labs[growing] - self.labs[beyond], axis=1)
            alike = apart <= _COVERAGE * self.noise
            growing = growing[alike]
            result[growing] = beyond[alike]
        return result

    @cached_property
    def labs(self) -> NDArray[np.float64]:
        """Colours of the knots in CIE L*a*b*, shape (m, 3)."""
        return lab(self.colours[self._runs[0]])

    @cached_property
    def _runs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """First and last of the colours that are the same in 8 bits, shape (m,) each."""
        changes = np.diff(np.round(255 * self.colours), axis=0).any(axis=1)
        edges = np.flatnonzero(changes) + 1
        return np.append(0, edges), np.append(edges, len(self.values)) - 1

    @cached_property
    def sensitivity(self) -> NDArray[np.float64]:
        """Standard deviation of the value for a root mean square distance of 1, shape (m,).

        The noise is equally large in red, green and blue: it has one component along the scale,
        which changes the value, and two across, which make the distance.
        """
        count = len(self.knots)
        reach = max(1, round(_CHORD * count))
        above = np.minimum(np.arange(count) + reach, count - 1)
        below = np.maximum(np.arange(count) - reach, 0)
        chord = self.labs[above] - self.labs[below]
        # A constant colour is known within the rounding of 8 bits.
        length = np.maximum(np.linalg.norm(chord, axis=1), 0.1)
        change = _lab_per_colour(self.colours[self._runs[0]])
        along = (np.einsum("nij,ni->nj", change, chord / length[:, None]) ** 2).sum(axis=1)
        across = (change**2).sum(axis=(1, 2)) - along
        slope = (self.knots[above] - self.knots[below]) / length
        return np.asarray(slope * np.sqrt(along / across))

    def invert(self, picture: Picture) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return values and distances of a picture's colours, shape (y, x), float32.

        A value is taken from the nearest place on the scale; its distance is the CIE L*a*b*
        difference of 1976. Each of the 2^24 colours is projected onto the scale only once.
        """
        red, green, blue = np.moveaxis(picture.astype(np.int32), -1, 0)
        keys = (red << 16) | (green << 8) | blue
        new = np.unique(keys[self._known[keys, 1] == 0.0])
        if new.size:
            colours = np.stack([new >> 16, new >> 8 & 0xFF, new & 0xFF], axis=1) / FULL
            self._known[new] = _nearest(lab(colours), self.labs, self.knots, self.banded)
        return self._known[keys, 0], self._known[keys, 1] - np.float32(1.0)

    @cached_property
    def _known(self) -> NDArray[np.float32]:
        """Value and 1 + distance of every colour; 0 where it was not asked for yet."""
        return np.zeros((1 << 24, 2), np.float32)


@dataclass(frozen=True)
class ColourUncertainty:
    """Standard uncertainties of a field that is read from colours, in its unit."""

    colours: float
    """By the finite number of colours of the scale."""
    noise: float
    """By colours that are not of the scale: compression and rounding."""
    legend: float = 0.0
    """By the ends of a legend, which are known to a pixel."""
    lines: float = 0.0
    """By lines and text, under which values come from neighbouring pixels."""

    @property
    def total(self) -> float:
        """Combined standard uncertainty."""
        return sqrt(self.colours**2 + self.noise**2 + self.legend**2 + self.lines**2)


def colour_uncertainty(
    scale: ColourScale, values: ArrayLike, distance: ArrayLike
) -> ColourUncertainty:
    """Return the uncertainty of values and distances that `ColourScale.invert` gave.

    Noise is assumed as large along the scale as across it, where it is seen as a distance: see
    `ColourScale.sensitivity`. Bands are wrong only where noise reaches the next band.
    """
    values, distance = np.ravel(values), np.ravel(distance).astype(np.float64)
    widths = np.interp(values, scale.knots, scale.widths)
    noise = distance * np.interp(values, scale.knots, scale.sensitivity)
    if scale.banded:
        # 1e-9 of a width is negligible; it prevents a division by zero.
        wrong = erfc(widths / 2 / np.maximum(noise, 1e-9 * widths) / sqrt(2))
        noise = np.sqrt(wrong) * widths
    colours = np.interp(values, scale.knots, scale.uncertainties)
    return ColourUncertainty(_root_mean_square(colours), _root_mean_square(noise))


def _root_mean_square(values: NDArray[np.float64]) -> float:
    return float(np.sqrt((values**2).mean())) if values.size else 0.0


def _lab_per_colour(colours: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return derivatives of L*a*b* with respect to red, green and blue, shape (n, 3, 3)."""
    columns = []
    for direction in np.eye(3) / 255:
        above, below = np.minimum(colours + direction, 1), np.maximum(colours - direction, 0)
        columns.append((lab(above) - lab(below)) / (above - below).sum(axis=1)[:, None])
    return np.stack(columns, axis=2)


def _map_colours(name: str, count: int) -> NDArray[np.float64]:
    from matplotlib import colormaps
    from matplotlib.colors import hsv_to_rgb

    if name == RAINBOW:
        hue = np.linspace(2 / 3, 0.0, count)  # from blue to red
        return np.asarray(hsv_to_rgb(np.stack([hue, np.ones(count), np.ones(count)], axis=1)))
    plain = name.removeprefix("matplotlib.")
    if plain not in colormaps:
        raise SourceError("unknown colour map, expected rainbow or one of matplotlib's, as jet")
    return np.asarray(colormaps[plain].resampled(count)(np.arange(count)))[:, :3]


def _equal_bands(colours: NDArray[np.float64]) -> int:
    """Return the number of bands of equal width of a legend, 0 if it has none.

    Pixels of bands are nearer to the middle of their band than to lines between the middles: codecs
    blur the jumps, by which they cannot be counted.
    """
    labs = lab(colours)
    tried = range(_FEWEST_BANDS, min(_MOST_BANDS, len(colours) // _NARROWEST_BAND) + 1)
    apart = np.array([_misfits(labs, count) for count in tried]).reshape(-1, 2)
    if not len(apart):
        return 0
    of_bands, of_lines = apart.T
    nearly = np.maximum(_AS_WELL * of_bands.min() + _AS_WELL_LAB, _CLEARLY * of_lines)
    best = int(np.argmax(of_bands <= nearly))
    return tried[best] if of_bands[best] < _BANDED * of_lines[best] else 0


def _misfits(labs: NDArray[np.float64], count: int) -> tuple[float, float]:
    """Return the mean distances of pixels from equal bands and from lines between their middles."""
    edges = np.linspace(0, len(labs), count + 1)
    middles = np.array([np.median(_inner(labs, *ends), axis=0) for ends in pairwise(edges)])
    place = np.arange(len(labs)) + 0.5
    # A box that is off shifts the edges too; narrow bands have no pixels to spare.
    margin = np.clip(len(labs) / count / 6, _BLURRED, 2 * _BLURRED)
    inside = np.abs(place - edges[:, None]).min(axis=0) > margin
    centres = (edges[1:] + edges[:-1]) / 2
    lines = np.stack([np.interp(place, centres, part) for part in middles.T], axis=1)
    between = inside & (place > centres[0]) & (place < centres[-1])
    if not between.any():
        return np.inf, np.inf
    band = np.clip(np.searchsorted(edges, place) - 1, 0, count - 1)
    of_bands = np.linalg.norm(labs - middles[band], axis=1)[inside].mean()
    return float(of_bands), float(np.linalg.norm(labs - lines, axis=1)[between].mean())


def _inner(colours: NDArray[np.float64], first: float, last: float) -> NDArray[np.float64]:
    """Return the middle of a band, at least a pixel and the half of a narrow band."""
    trim = min(_BLURRED, (last - first) / 4)
    start = int(np.ceil(first + trim - 0.5))
    return colours[start : max(int(last - trim + 0.5), start + 1)]


@njit(cache=True)
def _nearest(places, labs, scale, banded):  # type: ignore[no-untyped-def]
    """Return values of the nearest places on the scale, and 1 + their distances, float32."""
    result = np.empty((len(places), 2), np.float32)
    for number in range(len(places)):
        place = places[number]
        best = np.inf
        value = scale[0]
        for index in range(len(scale) if banded else len(scale) - 1):
            u0 = place[0] - labs[index, 0]
            u1 = place[1] - labs[index, 1]
            u2 = place[2] - labs[index, 2]
            fraction = 0.0
            if not banded:
                v0 = labs[index + 1, 0] - labs[index, 0]
                v1 = labs[index + 1, 1] - labs[index, 1]
                v2 = labs[index + 1, 2] - labs[index, 2]
                square = v0 * v0 + v1 * v1 + v2 * v2
                if square > 0:
                    fraction = min(max((u0 * v0 + u1 * v1 + u2 * v2) / square, 0.0), 1.0)
                u0 -= fraction * v0
                u1 -= fraction * v1
                u2 -= fraction * v2
            apart = u0 * u0 + u1 * u1 + u2 * u2
            if apart < best:
                best = apart
                value = scale[index]
                if fraction > 0:
                    value += fraction * (scale[index + 1] - scale[index])
        result[number, 0] = value
        result[number, 1] = 1.0 + np.sqrt(best)
    return result
