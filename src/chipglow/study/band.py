"""Reading of a hot band by a study's camera: a first answer about a camera, without a scene."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.analysis import attribute
from chipglow.camera import UNUSABLE, Camera
from chipglow.camera.chain import Chain, ExposedChain
from chipglow.camera.exposure import surroundings_radiance
from chipglow.chip import first_crossing
from chipglow.laboratory.emissivity import SurfaceFile
from chipglow.quantities import ZERO_CELSIUS, Array, Brief, changed
from chipglow.radiometry import blackbody_radiance
from chipglow.scene import Scene, scenes
from chipglow.study.budgets import check_draws
from chipglow.study.camera_section import CameraSection
from chipglow.study.fitting import left_to_the_paper, surfaces_on
from chipglow.study.running import Progress, silent
from chipglow.study.schema import Study
from chipglow.study.surface_section import FeaturesSection
from chipglow.surface import Surface, UniformSurface
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Inputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PEAK, SET, RISE, WIDTH = QUANTITIES = (
    "peak temperature",
    "peak, emissivity set",
    "rise",
    "width at half of the rise",
)
"""Quantities that are read of the band, in K, K, K and m; the second with the emissivity set."""

BESIDE: Final = "beside the middle"
"""Contribution of a hottest pixel that is not in the middle of the band, as it is in noise."""

_POSITIONS: Final = 9
"""Positions of the pixels, evenly over a pixel: the best estimate is a mean over them."""

_DRAWS: Final = 200
"""Single frames that are drawn: the ends of the interval have a standard error of a tenth of it."""

_FEWEST_DRAWS: Final = 40
"""Draws below which 95 % of them leave less than one at each end."""

_TAIL: Final = 0.025
"""Part of the frames on each side of the interval of 95 %."""

_SAMPLES_OF_A_PIXEL: Final = 8
"""Samples of the scene across a pixel, or more if the band is narrow."""

_BLUR_WIDTHS: Final = 4.0
"""Margin of the scene beside the path of the band, in full widths at half maximum of the blur."""

_WIDTHS: Final = 3.0
"""Further margin in widths of the band: there its rise is 1e-11 of the largest."""

_PIXELS: Final = 3
"""Rows of pixels, of which the middle one is read, and further margin in pixels."""

_NO_CONTRIBUTION: Final = 0.05
"""Contribution in K that is shown as 0.0."""


@dataclass(frozen=True, eq=False, repr=False)
class BandReading(Brief):
    """Reading of a hot band by a camera: its error, the causes, and the scatter of frames.

    Parameters
    ----------
    width, rise, speed, base : float
        The band: full width at half maximum in m, rise in K, speed in m/s, and temperature in K
        beside it.
    camera : Camera
        The camera.
    emissivity : float
        Emissivity of the middle of the band.
    x : ndarray
        Positions across the band in m, shape (n,).
    true, shown : ndarray
        Temperature in K at these positions: of the band in the middle of the exposure, and as
        single frames show it, shape (draw, n).
    values : ndarray
        True values of `QUANTITIES`, and as they are shown, a mean over positions of the pixels:
        shape (2, 4). NaN where nothing rises.
    draws : ndarray
        The values as single frames show them, shape (draw, 4).
    contributions : mapping
        Contribution of each effect to the error of the peak temperature in K; they sum to it.
    causes : tuple of str
        Differences between the frames.
    scene : Scene
        The scene.
    notes : Notes
        Assumptions and warnings.
    """

    width: float
    rise: float
    speed: float
    base: float
    camera: Camera
    emissivity: float
    x: Array
    true: Array
    shown: Array
    values: Array
    draws: Array
    contributions: Mapping[str, float]
    causes: tuple[str, ...]
    scene: Scene
    notes: Notes

    @property
    def interval(self) -> Array:
        """Ends of the interval of 95 % of single frames, (2, 4); NaN if some frame shows none."""
        return np.asarray(np.quantile(self.draws, [_TAIL, 1 - _TAIL], axis=0))

    def to_frame(self) -> pd.DataFrame:
        """Return the rows of quantities, then of effects: ``error by`` and the contribution."""
        effects = self.effects_frame()
        named = {"quantity": "error by " + effects.effect, "error": effects.contribution_K}
        rows = pd.DataFrame(named).assign(unit="K")
        return pd.concat([self.quantities_frame(), rows], ignore_index=True)

    def quantities_frame(self) -> pd.DataFrame:
        """Return a row for each quantity: true value, shown value, error and interval of frames."""
        values = np.concatenate([self.values, self.interval])
        values[:, :2] -= ZERO_CELSIUS
        values[:, 3] *= 1e6
        true, shown, low, high = values
        columns = {"true": true, "shown": shown, "error": shown - true, "low": low, "high": high}
        frame = pd.DataFrame(
            {"quantity": QUANTITIES, "unit": ["degC", "degC", "K", "um"], **columns}
        )
        return frame if self.emissivity < 1 else frame[frame.quantity != SET]

    def effects_frame(self) -> pd.DataFrame:
        """Return a row for each effect: its contribution to the error of the peak temperature."""
        rows = list(self.contributions.items())
        return pd.DataFrame(rows, columns=["effect", "contribution_K"])

    def plot(self) -> "Figure":
        """Draw the band as it is and as it is shown, and the contributions of the effects."""
        from chipglow.study.band_figure import draw_band_reading

        return draw_band_reading(self)

    def _repr_html_(self) -> str:
        return result_html("BandReading", self.to_frame(), self.notes)


def band_reading(
    study: Study,
    width: float,
    rise: float,
    speed: float = 0.0,
    *,
    base: float = scenes.HOT_CHIP,
    draws: int = _DRAWS,
    progress: Progress = silent,
) -> BandReading:
    """Return what a study's camera shows of a straight hot band that moves across the image.

    Parameters
    ----------
    study : Study
        Camera, surface and uncertainties. Its scene or cut is not used.
    width, rise, speed, base : float
        The band, see `chipglow.scenes.band`.
    draws : int
        Single frames that are drawn, with other positions of the pixels, noise and texture, and
        with other values of the uncertain settings of camera and surface.
    progress : callable
        Called with the current step and its completed fraction, 0 to 1.

    Returns
    -------
    BandReading
        One row of pixels across the band is read; its peak is the largest temperature.

    Raises
    ------
    ValueError
        If the band is impossible, or so narrow or fast for the camera that its scene would have too
        many values.

    Notes
    -----
    An emissivity of the features of a chip needs the strain of a cut, and a map its place: the
    band of such a study is a blackbody.

    Examples
    --------
    >>> study = chipglow.Study(surface={"kind": "uniform", "emissivity": 0.6})
    >>> chipglow.band_reading(study, width=20e-6, rise=300.0, speed=4.0).to_frame()
    """
    if not rise > 0:
        raise ValueError(f"rise: {rise:g} K, expected more than 0")
    if draws < _FEWEST_DRAWS:
        raise ValueError(f"draws: {draws}, expected {_FEWEST_DRAWS} or more")
    assumed = [text for text in left_to_the_paper(study) if " of camera: " in text]
    if isinstance(study.surface, FeaturesSection | SurfaceFile):
        study = changed(study, {"surface": UniformSurface(1.0)})
        assumed.append("The band is a blackbody: its emissivity is 1.")
    inputs, warnings = _inputs(study)
    camera = _camera(study.camera, study.seed)
    scene = _scene(camera, width, rise, speed, base)
    surface = _surface(study, scene)
    emissivity = _emissivity(scene, camera, surface)
    view = _View(scene, camera.pitch, emissivity, (width, rise, speed, base))
    values, contributions = _attributed(view, camera, surface, base + rise, progress)
    frames = list(_frames(study, view, inputs, draws, progress))
    differs = {"noise": camera.detector is not None, "texture": surface.redrawn(1) is not surface}
    x = scene.raster.x
    return BandReading(
        width=width,
        rise=rise,
        speed=speed,
        base=base,
        camera=camera,
        emissivity=view.emissivity,
        x=x,
        true=base + rise * scenes.gaussian(x, width),
        shown=np.stack([np.interp(x, one.x, one.kelvins) for one in frames]),
        values=np.array([[base + rise, base + rise, rise, width], values]),
        draws=np.stack([one.values for one in frames]),
        contributions=contributions,
        causes=("position of the pixels", *filter(differs.get, differs), *inputs.names),
        scene=scene,
        notes=Notes(assumed, [*warnings, *_warnings(camera, surface, speed, frames)]),
    )


class _Row(NamedTuple):
    """A row of pixels across the band."""

    x: Array  # in m
    kelvins: Array
    values: Array  # of `QUANTITIES`
    is_lost: bool  # whether the hottest pixel is saturated or below the lower range limit


@dataclass(frozen=True, eq=False)
class _View:
    """A scene of a band, with the pitch and the emissivity that the reader takes to be true."""

    scene: Scene
    pitch: float
    emissivity: float
    band: tuple[float, float, float, float]
    """Width, rise, speed and base, as of `band_reading`."""

    def through(self, camera: Camera) -> "_View":
        """Return the view with a scene that is as long and as fine as another camera needs."""
        return replace(self, scene=_scene(camera, *self.band))

    def row(self, camera: Camera, kelvins: Array, is_lost: NDArray[np.bool_]) -> _Row:
        """Return the middle row of images of the band."""
        middle = len(kelvins) // 2
        row, lost = kelvins[middle], is_lost[middle]
        right = camera.offset[0] + self.scene.raster.left
        x = right + self.pitch * (np.arange(row.size) + 0.5)
        hottest, beside = int(np.argmax(row)), (row[0] + row[-1]) / 2
        reflected = surroundings_radiance(camera.band, camera.reflected)
        seen = camera.band.radiance(row[hottest])
        light = blackbody_radiance(seen, self.emissivity, reflected)
        corrected = float(camera.band.temperature(light))
        rise = row[hottest] - beside
        width = _width(x, row, hottest, beside + rise / 2)
        return _Row(x, row, np.array([row[hottest], corrected, rise, width]), bool(lost[hottest]))


def _width(x: Array, row: Array, hottest: int, level: float) -> float:
    """Return the width in m at a level, straight between pixels; NaN if a side stays above it."""
    sides = ((row[hottest::-1], x[hottest::-1]), (row[hottest:], x[hottest:]))
    left, right = (
        float(first_crossing(values[None], places, level)[0]) for values, places in sides
    )
    return right - left


def _inputs(study: Study) -> tuple[Inputs, list[str]]:
    """Return the uncertain settings of camera and surface, and sentences on truncated ones."""
    stated = study.uncertainty.build(study)
    kept = [one for one in stated.inputs if not one.name.startswith("cutting.")]
    names = [one.name for one in kept]
    pairs = [pair for pair in stated.correlations if pair[0] in names]
    inputs = Inputs(kept, pairs)
    check_draws(study, inputs)
    return inputs, inputs.truncated


def _camera(section: CameraSection, seed: int) -> Camera:
    """Return the camera of a section with as many pixels as see a scene."""
    return replace(section.build(seed), shape=None, offset=(0.0, 0.0))


def _scene(camera: Camera, width: float, rise: float, speed: float, base: float) -> Scene:
    """Return a scene of the band that is as fine and as wide as the camera needs."""
    blur = camera.psf.fwhm if camera.psf is not None else 0.0
    duration = camera.integration_time + (_PIXELS + 1) * (camera.line_time or 0.0)
    spacing = min(camera.pitch / _SAMPLES_OF_A_PIXEL, width / scenes.SAMPLES_OF_A_WIDTH)
    margin = _WIDTHS * width + _BLUR_WIDTHS * blur + _PIXELS * camera.pitch
    size = 2 * margin + abs(speed) * duration, (_PIXELS + 0.5) * camera.pitch
    return scenes.band(width, rise, speed, duration, base, spacing, size)


def _surface(study: Study, scene: Scene) -> Surface:
    (surface,) = surfaces_on(scene, study.surface, study.seed)[0].values()
    return surface


def _emissivity(scene: Scene, camera: Camera, surface: Surface) -> float:
    """Return the emissivity of the hottest sample in the middle of the exposure."""
    seen = Chain(camera, scene, surface).at(0.0).exposure
    hottest = np.unravel_index(np.argmax(seen.centre_temperature), seen.raster.shape)
    black = float(camera.band.radiance(float(seen.centre_temperature[hottest])))
    reflected = surroundings_radiance(camera.band, camera.reflected)
    emissivity = (float(seen.centre_radiance[hottest]) - reflected) / (black - reflected)
    return min(round(emissivity, 6), 1.0)  # radiances are single floats


def _attributed(
    view: _View, camera: Camera, surface: Surface, peak: float, tell: Progress
) -> tuple[Array, dict[str, float]]:
    """Return the mean values of all positions of the pixels, and the contributions of effects."""
    values, contributions = [], []
    for number in range(_POSITIONS):
        tell("attribution", number / _POSITIONS)
        moved = replace(camera, offset=(camera.pitch * number / _POSITIONS, 0.0)).redrawn(number)
        found = attribute(view.scene, moved, surface, 0.0)
        row = view.row(moved, found.measured.values, found.lost.values > 0)
        values.append(row.values)
        at = {"y": found.sizes["y"] // 2, "x": int(np.argmax(row.kelvins))}
        pixel = found.isel(at)
        beside = float(pixel.reference) - peak
        contributions.append([*pixel.contribution.values.tolist(), beside])
    tell("attribution", 1.0)
    names = [*found.effect.values.tolist(), BESIDE]
    means = dict(zip(names, np.mean(contributions, axis=0).tolist(), strict=True))
    if abs(means[BESIDE]) < _NO_CONTRIBUTION:
        del means[BESIDE]
    return np.mean(values, axis=0), means


def _frames(
    study: Study, view: _View, inputs: Inputs, draws: int, tell: Progress
) -> Iterator[_Row]:
    """Yield the row of each drawn frame."""
    generator = np.random.default_rng(study.seed)
    numbers = generator.random((draws, len(inputs)))
    values = inputs.at(numbers) if len(inputs) else numbers
    positions = (generator.permutation(draws) + 0.5) / draws
    nominal = _camera(study.camera, study.seed), _surface(study, view.scene)
    exposed: ExposedChain | None = None
    before: tuple[object, ...] = ()
    for number, position in enumerate(positions.tolist()):
        tell("frames", number / draws)
        drawn = dict(zip(inputs.names, values[number].tolist(), strict=True))
        camera, surface = _drawn(study, view, drawn, nominal)
        surface = surface.redrawn(number)
        seen = view if camera is nominal[0] else view.through(camera)
        times = camera.integration_time, camera.line_time
        how = surface, camera.band, camera.reflected, *times, seen.scene.raster
        if exposed is None or how != before:
            chain = Chain(camera, seen.scene, surface)
            exposed, before = chain.exposed(chain.at(0.0).exposure, shares_blur=True), how
        moved = replace(camera, offset=(camera.pitch * position, 0.0)).redrawn(number)
        read = exposed.through(moved).read()
        yield seen.row(moved, read.temperature, read.flags & UNUSABLE != 0)
    tell("frames", 1.0)


def _drawn(
    study: Study, view: _View, values: Mapping[str, float], nominal: tuple[Camera, Surface]
) -> tuple[Camera, Surface]:
    """Return camera and surface with drawn settings; the nominal one if none of its are drawn."""
    camera, surface = nominal
    try:
        varied = changed(study, values) if values else study
        if any(name.startswith("camera.") for name in values):
            camera = _camera(varied.camera, study.seed)
            if camera.band == nominal[0].band:  # whose tables are computed
                camera = replace(camera, band=nominal[0].band)
        if any(name.startswith("surface.") for name in values):
            surface = _surface(varied, view.scene)
    except ValueError as reason:
        raise ValueError(
            f"uncertainty.inputs: a draw is impossible: {reason}; state a smaller or a bounded "
            "uncertainty (half_width)"
        ) from None
    return camera, surface


def _warnings(
    camera: Camera, surface: Surface, speed: float, frames: Sequence[_Row]
) -> Iterator[str]:
    """Yield sentences on what limits the validity of a reading."""
    yield from surface.origin.warnings(camera.band, "")
    if speed and camera.time_constant is not None:
        yield (
            f"The thermal time constant of {1e3 * camera.time_constant:.3g} ms is not taken into "
            "account: the detector lags behind the moving band, so the peak is lower still."
        )
    lost = sum(one.is_lost for one in frames)
    if lost:
        yield (
            f"In {100 * lost / len(frames):.0f} % of the frames the hottest pixel is saturated or "
            "below the lower range limit."
        )
