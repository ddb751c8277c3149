"""Scenes in closed form: a band, a step or a spot that moves across the image."""

from collections.abc import Callable
from math import ceil, isfinite, log, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf as error_function

from chipglow.scene.raster import Raster
from chipglow.scene.scene import Scene

Profile = Callable[[NDArray[np.float64]], NDArray[np.float64]]

HOT_CHIP: Final = 773.15
"""Temperature in K beside the band, the step or the spot, unless it is stated: 500 °C."""

SAMPLES_OF_A_WIDTH: Final = 24
"""Samples across the width: the mean of a Gaussian over a sample differs by 0.04 % of its rise."""

_WIDTHS: Final = 10.0
"""Size of a scene in widths, beside the path."""

_LEAST_FRAMES: Final = 5
"""Frames of a scene that moves."""

_MOST_VALUES: Final = 2e8
"""Values of a scene: some seconds of computation."""

_SIGMA: Final = 1 / sqrt(8 * log(2))
"""Standard deviation of a Gaussian of full width 1 at half maximum."""

_STEP: Final = 0.3902
"""Standard deviation of a Gaussian whose integral rises from 10 % to 90 % within 1."""


class _Layout(NamedTuple):
    """Samples and frames of a scene."""

    raster: Raster
    times: NDArray[np.float64]
    """Times of the frames in s."""
    middles: NDArray[np.float64]
    """Position x of the middle of the band, the step or the spot in each frame, in m."""


def band(
    width: float,
    rise: float,
    speed: float = 0.0,
    duration: float = 0.0,
    base: float = HOT_CHIP,
    spacing: float | None = None,
    size: tuple[float, float] | None = None,
) -> Scene:
    """Return a straight hot band that moves to the right, across its own direction.

    Parameters
    ----------
    width : float
        Full width at half maximum in m of the Gaussian profile of the temperature.
    rise : float
        Temperature of the middle minus `base`, in K; negative of a cold band.
    speed : float
        Speed in m/s.
    duration : float
        Time in s that the scene covers, from 0: at least the integration time of the camera. The
        band is at x = 0 in the middle of it.
    base : float
        Temperature in K beside the band.
    spacing : float, optional
        Distance of the samples in m; a 24th of the width by default.
    size : tuple of float, optional
        Size of the scene along x and y in m; by default 10 widths, and along x the path too.

    Returns
    -------
    Scene
        Temperature alone, of one frame if nothing moves.

    Raises
    ------
    ValueError
        If a number is not finite or not positive, or the scene would have over 2e8 values.
    SceneError
        If a temperature is out of the limits of a scene.

    Examples
    --------
    >>> scene = chipglow.scenes.band(20e-6, 300.0, speed=4.0, duration=10e-6)
    >>> chipglow.Camera.paper().measure(scene, chipglow.UniformSurface(0.6), start=0.0)
    """

    def profile(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return gaussian(x, width)

    layout = _layout(width, rise, speed, duration, base, spacing, size)
    return _uniform_along_y(profile, layout, base, rise)


def step(
    width: float,
    rise: float,
    speed: float = 0.0,
    duration: float = 0.0,
    base: float = HOT_CHIP,
    spacing: float | None = None,
    size: tuple[float, float] | None = None,
) -> Scene:
    """Return a straight step of the temperature, hot on the left, that moves to the right.

    Its profile is the integral of a Gaussian. Parameters as for `band`, but `width` is the distance
    in m over which the temperature changes from 10 % to 90 % of `rise`.
    """

    def profile(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((1 - error_function(x / (sqrt(2) * _STEP * width))) / 2)

    layout = _layout(width, rise, speed, duration, base, spacing, size)
    return _uniform_along_y(profile, layout, base, rise)


def spot(
    width: float,
    rise: float,
    speed: float = 0.0,
    duration: float = 0.0,
    base: float = HOT_CHIP,
    spacing: float | None = None,
    size: tuple[float, float] | None = None,
) -> Scene:
    """Return a round hot spot that moves to the right: a Gaussian in both directions.

    Parameters as for `band`.
    """
    raster, times, middles = _layout(width, rise, speed, duration, base, spacing, size)
    across = np.stack([gaussian(raster.x - middle, width) for middle in middles])
    along = gaussian(raster.y, width)
    return _scene(raster, times, base + rise * along[:, None] * across[:, None, :])


def gaussian(x: ArrayLike, width: float) -> NDArray[np.float64]:
    """Return a Gaussian of height 1 and a full width at half maximum."""
    return np.asarray(np.exp(-0.5 * (np.asarray(x) / (_SIGMA * width)) ** 2))


def _uniform_along_y(profile: Profile, layout: _Layout, base: float, rise: float) -> Scene:
    """Return a scene whose rows are all the same: they share the memory of one."""
    raster, times, middles = layout
    rows = np.stack([profile(raster.x - middle) for middle in middles]).astype(np.float32)
    kelvins = (np.float32(base) + np.float32(rise) * rows)[:, None, :]
    return _scene(raster, times, np.broadcast_to(kelvins, (len(times), *raster.shape)))


def _scene(raster: Raster, times: NDArray[np.float64], kelvins: NDArray[np.floating]) -> Scene:
    return Scene.from_fields(raster, times, {"temperature": kelvins})


def _layout(
    width: float,
    rise: float,
    speed: float,
    duration: float,
    base: float,
    spacing: float | None,
    size: tuple[float, float] | None,
) -> _Layout:
    """Return the samples and frames of a scene, after a check of its numbers."""
    for name, value in {"rise": rise, "speed": speed, "base": base}.items():
        if not isfinite(value):
            raise ValueError(f"{name}: {value!r}, expected a finite number")
    _check_positive("width", width)
    if not (isfinite(duration) and duration >= 0):
        raise ValueError(f"duration: {duration!r} s, expected 0 or more")
    path = abs(speed) * duration
    spacing = width / SAMPLES_OF_A_WIDTH if spacing is None else spacing
    size = (_WIDTHS * width + path, _WIDTHS * width) if size is None else size
    for name, value in {"spacing": spacing, "size": min(size)}.items():
        _check_positive(name, value)
    # Odd numbers, so that one sample of one frame is the middle.
    columns, rows = (ceil(length / spacing) | 1 for length in size)
    count = max(_LEAST_FRAMES, ceil(path / spacing)) | 1 if path else 1
    if count * columns * rows > _MOST_VALUES:
        raise ValueError(
            f"duration: {duration:.3g} s, in which {path / width:.3g} widths pass, takes {count} "
            f"frames of {columns} x {rows} samples; state a larger spacing or a smaller size"
        )
    times = duration / count * np.arange(count, dtype=np.float64)
    # A frame stands for the time until the next: it shows the middle of that time.
    middles = speed * (times + duration / count / 2 - duration / 2)
    left, top = -spacing * columns / 2, spacing * rows / 2
    return _Layout(Raster(left, top, spacing, rows, columns), times, middles)


def _check_positive(name: str, value: float) -> None:
    if not (isfinite(value) and value > 0):
        raise ValueError(f"{name}: {value!r} m, expected more than 0")
