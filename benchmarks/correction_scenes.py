"""Known scenes for `correction.py`: analytic chips, and quick cuts at other speeds and feeds.

A scene is known on samples of an eighth of a pixel, not on the cells of the correction, and
continues beyond its image. Seeds from 4000 on are held out: nothing is chosen by them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from time import time

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from chipglow import AnnularAperturePSF, Band, Camera, Estimate, Measurement, Raster, Scene
from chipglow.camera import image_formation
from chipglow.chip import Instant
from chipglow.correction import ObservedObject, SampledObject, ShapedObject, Zone
from chipglow.io.scene_file import StoredScene
from chipglow.scene import Polygon, Region
from chipglow.study import Study, cut
from chipglow.surface import UniformSurface

BAND = Band(3.8e-6, 5.1e-6)
PITCH, SAMPLES = 6e-6, 8
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), psf_order="optics", lower_limit=None)
EMISSIVITY = 0.42, 0.58
"""Of chip and tool: the paper's."""

DARK = Estimate(np.array(200.0))
MARGIN = 16
"""Pixels by which a scene continues beyond its image on each side."""

LOWER_LIMIT = 573.15
"""Lower range limit in K of the camera that sees a cut, as in the paper: much of it is cold."""

KINDS = "band", "step", "plateau", "ridge", "plain"
VIEWS = 8
"""Scenes of one cut; in turn beside the cutting edge and on the shear band."""

SPEEDS, FEEDS = (2.0, 7.0), (0.2e-3, 0.4e-3)
"""Ranges of cutting speed in m/s and feed in m; the paper's are 4.2 m/s and 0.3 mm."""

CELLS_IN_FEED, LARGEST_CELL = 15, 20e-6
"""Resolution of a quick cut: that of the quick study at the paper's feed."""

BESIDE, BELOW = 260e-6, 230e-6
"""Parts of the scene of a cut in m on the right of the cutting edge and under it."""

ON_FACE, ON_BAND, AROUND = 0.6, 0.6, 6 * PITCH
"""Views of a cut: up to this part of the feed up the rake face, or of the band; moved by as much.
"""

TRIALS, LEAST_IN_RANGE = 4, 0.2
"""Draws of a view at most, and the part of its pixels that must be within the range."""

CLEAR_OF_VOID = 2 * PITCH
"""Distance in m from where there is no material at times: motion is not undone."""


class TimeOverError(Exception):
    """The time for a cut is over."""


@dataclass(frozen=True, eq=False)
class Known:
    """A scene that is known: what the camera shows of it, and what is stated of it."""

    kind: str
    pixels: Raster
    black: np.ndarray
    """Blackbody radiance on samples of the image, mean over the exposure."""
    to_tool: np.ndarray
    """Distance to the outline of the tool in m, positive in it; on samples of the image."""
    solid: np.ndarray
    """Samples of the image with material."""
    places: dict[str, np.ndarray]
    """Pixels of places."""
    normal: tuple[float, float]
    """Direction across the outline, into the tool."""
    width: float
    """Full width at half maximum of the band in pixels, of temperature or (cut) strain rate."""
    netd: float
    image: np.ndarray
    lower_limit: float | None
    stated: Callable[..., ObservedObject]
    """Object with emissivities of chip and tool, their uncertainties, and a shift in m."""
    conditions: dict[str, float]
    """Speed in m/s, feed in m and start of the exposure in s of a cut."""

    @property
    def measurement(self):
        frame = self.image[None]
        return Measurement.from_radiance(frame, BAND, np.zeros(1), self.pixels, self.lower_limit)

    @cached_property
    def is_tool(self):
        """Pixels with a larger part of the tool than of the chip."""
        in_tool = self.to_tool > 0
        return means(self.solid & in_tool) > means(self.solid & ~in_tool)

    @cached_property
    def truth(self):
        """Temperature in K of the mean radiance over the own part of each pixel; NaN outside."""
        own = self.solid & (on_samples(self.is_tool) == (self.to_tool > 0))
        with np.errstate(invalid="ignore"):
            return BAND.temperature(means(np.where(own, self.black, 0.0)) / means(own))

    def outline_off(self, shift, motion):
        """Return the distance from the outline to the found one in pixels (root mean square).

        The stated outline is shifted along `normal` in m; `motion` is the estimated one: to the
        right and up in m, and a turn in rad about the middle of the image.
        """
        spacing = PITCH / SAMPLES
        on_outline = self.solid & (np.abs(self.to_tool) <= spacing)
        if not on_outline.any():
            return np.nan
        row, column = np.nonzero(on_outline)
        middle = (np.array(self.to_tool.shape) - 1) / 2
        across, along = spacing * (column - middle[1]), spacing * (middle[0] - row)
        down, right = np.gradient(self.to_tool)
        normal = np.stack([right, -down])[:, on_outline]
        normal /= np.linalg.norm(normal, axis=0)
        moved = shift * np.array(self.normal) + motion[:2]
        distance = normal.T @ moved + motion[2] * (normal[1] * across - normal[0] * along)
        return np.sqrt(np.mean(distance**2)) / PITCH

    @property
    def step(self):
        """Relative change of the radiance across the outline, averaged along it."""
        sides = []
        for shine, side in zip(EMISSIVITY, (-self.to_tool, self.to_tool), strict=True):
            near = self.solid & (side > 0) & (side < 0.3 * PITCH)
            sides.append((shine * self.black)[near].mean() if near.any() else np.nan)
        return abs(sides[1] / sides[0] - 1)


def analytic(seed, pixels):
    """Return an analytic scene: a chip beside a straight outline, with a band or another detail."""
    draw = np.random.default_rng([56, seed])
    view, samples = raster(pixels), raster(pixels, SAMPLES, MARGIN)
    x, y = np.meshgrid(samples.x, samples.y)
    side = pixels * PITCH
    lean = np.deg2rad(draw.uniform(-25, 25))
    normal = np.cos(lean), np.sin(lean)
    place = side * draw.uniform(0.62, 0.77) - side / 2
    to_tool = (x - side / 2) * normal[0] + (y - side / 2) * normal[1] - place
    base, across, along = draw.uniform(780, 950), draw.normal(0, 60), draw.normal(0, 60)
    heat, chip_depth = draw.uniform(80, 350), draw.uniform(3, 12) * PITCH
    chip = base + across * (x / side - 0.5) + along * (y / side - 0.5)
    chip += heat * np.exp(np.minimum(to_tool, 0) / chip_depth)
    contact, tool_depth = base + heat - 450 + draw.normal(0, 20), draw.uniform(8, 25) * PITCH
    tool = 450 + contact * np.exp(-np.maximum(to_tool, 0) / tool_depth)
    width, rise = draw.uniform(1.5, 6.0), draw.uniform(100, 350)
    turn = draw.uniform(0, np.pi)
    middle = side * draw.uniform(0.25, 0.45), side * draw.uniform(0.3, 0.7)
    from_band = (x - middle[0]) * np.cos(turn) + (y - middle[1]) * np.sin(turn)
    kind = KINDS[seed % len(KINDS)]
    chip += rise * profile(kind, from_band / (width * PITCH / 2.355))
    netd = drawn_netd(draw)
    black = BAND.radiance(np.where(to_tool > 0, tool, chip))
    # Samples that the outline cuts are of both: stairs would displace it by a part of a sample.
    in_tool = np.clip(0.5 + to_tool / samples.spacing, 0, 1)
    image = seen(black, in_tool, samples, view, netd, draw)
    black, to_tool, from_band = map(inner, (black, to_tool, from_band))
    distance, band = means(to_tool), np.abs(means(from_band))
    in_tool = means(to_tool > 0) > 0.5
    places = {
        "rake face": ~in_tool & (distance > -PITCH),
        "tool": in_tool & (distance < PITCH),
        "band": ~in_tool & (distance < -3 * PITCH) & (band < (width / 4 + 0.3) * PITCH),
        "rest": ~in_tool & (distance < -2 * PITCH),
    }

    def stated(emissivity, uncertainty=(0.0, 0.0), shift=0.0):
        across = np.array(normal)
        point = np.array([side / 2, side / 2]) + across * (place + shift)
        reach, far = 2 * side * np.array([-normal[1], normal[0]]), 3 * side * across
        corners = point - reach, point + reach, point + reach + far, point - reach + far
        shape = Region("tool", Polygon(tuple(map(tuple, corners))), unit="m")
        zones = (
            Zone("chip", emissivity[0], None, uncertainty[0]),
            Zone("tool", emissivity[1], shape, uncertainty[1]),
        )
        return ShapedObject(zones, view)

    solid = np.ones(black.shape, bool)
    return Known(
        kind, view, black, to_tool, solid, places, normal, width, netd, image, None, stated, {}
    )


def profile(kind, distance):
    """Return a band, a step, a plateau or a ridge over the distance in standard deviations."""
    if kind == "band":
        return np.exp(-(distance**2) / 2)
    if kind == "step":
        return 0.5 * (1 + np.tanh(distance))
    if kind == "plateau":
        return 0.5 * (np.tanh(1.5 * (distance + 3)) - np.tanh(1.5 * (distance - 3)))
    if kind == "ridge":
        return np.exp(-np.abs(distance))
    return np.zeros_like(distance)


def study_of(number):
    """Return the study of a quick cut at a speed and a feed of its own."""
    draw = np.random.default_rng([58, number])
    speed = round(float(np.exp(draw.uniform(*np.log(SPEEDS)))), 2)
    feed = round(float(draw.uniform(*FEEDS)), 6)
    larger, spacing = feed / 0.3e-3, PITCH / 4
    left, top = -650e-6 * larger, 700e-6 * larger
    view = {
        "left": f"{left} m",
        "top": f"{top} m",
        "spacing": f"{spacing} m",
        "rows": round((top + BELOW) / spacing),
        "columns": round((BESIDE - left) / spacing),
    }
    window = {"interval": "0.5 us", "later_bands": 0}
    cutting = {"speed": f"{speed} m/s", "feed": f"{feed} m", "window": window}
    cell = min(feed / CELLS_IN_FEED, LARGEST_CELL)
    cutting |= {"field_of_view": view, "numerics": {"cell": f"{cell} m"}}
    end = Study(cutting=cutting).cutting.window.end
    return Study(cutting=cutting | {"cutting_length": f"{1.001 * end} m"})


def computed_cut(number, end):
    """Compute a cut if the cache does not hold it; its progress is kept when the time is over."""

    def check(step, fraction):
        if time() > end:
            raise TimeOverError

    return cut(study_of(number), check, resume=True)


def of_cut(number, view, pixels):
    """Return a scene of a cut: an exposure at a random time, beside the edge or on the band.

    An image that is too cold for its camera is drawn again, at last beside the edge.
    """
    study, draw = study_of(number), np.random.default_rng([59, number, view])
    stored = StoredScene(cut(study))
    for trial in range(2 * TRIALS):
        on_band = view % 2 == 1 and trial < TRIALS
        one = exposed(stored, study, draw, pixels, on_band)
        if (one.measurement.flags == 0).mean() >= LEAST_IN_RANGE:
            break
    return one


def exposed(stored, study, draw, count, on_band):
    """Return an exposure of a cut of `count` by `count` pixels."""
    duration = CAMERA.integration_time
    start = draw.uniform(stored.times[0], stored.times[-1] - duration)
    instant = Instant.at(stored, start, duration)
    on_band &= instant.band is not None
    pixels, samples = rasters_at(middle(study, stored, instant, draw, on_band), count, stored)
    x, y = np.meshgrid(samples.x, samples.y)
    in_tool = stored.tool.signed_distance(x, y) < 0
    near = StoredScene(stored.path, replace(stored.lattice, raster=samples, in_tool=in_tool))
    black = CAMERA.expose(near, UniformSurface(1.0), start).mean_radiance.astype(float)
    solid, always = black > 0, material_throughout(near, start, duration)
    netd = drawn_netd(draw)
    image = seen(black, in_tool, samples, pixels, netd, draw)
    to_tool = distance_to_tool(in_tool, solid)
    width = np.nan if instant.band is None else instant.band.width / PITCH
    places = places_of_cut(stored.tool, pixels, to_tool, always, instant)
    normal = tuple(-part for part in stored.tool.rake_normal)

    def stated(emissivity, uncertainty=(0.0, 0.0), shift=0.0):
        zones = tuple(
            Zone(name, value, None, spread)
            for name, value, spread in zip(("chip", "tool"), emissivity, uncertainty, strict=True)
        )
        left, top = samples.left + shift * normal[0], samples.top + shift * normal[1]
        moved = replace(samples, left=left, top=top)
        labels = np.where(solid, np.where(in_tool, 1, 0), -1).astype(np.int16)
        values = np.where(solid, np.where(in_tool, *emissivity[::-1]), 0.0)
        return SampledObject(zones, moved, labels, values)

    conditions = {"speed": study.cutting.speed, "feed": study.cutting.feed, "start": start}
    known = *map(inner, (black, to_tool, solid)), places, normal, width, netd, image
    kind = "shear band" if on_band else "rake face"
    return Known(kind, pixels, *known, LOWER_LIMIT, stated, conditions)


def middle(study, stored, instant, draw, on_band):
    """Return the middle of an image in m."""
    if on_band:
        points = instant.band.ridge.points
        place = points[int(draw.uniform(0, ON_BAND) * len(points))]
    else:
        place = stored.tool.rake_point(draw.uniform(0, ON_FACE) * study.cutting.feed)
    return place + draw.uniform(-AROUND, AROUND, 2)


def rasters_at(middle, pixels, stored):
    """Return pixels and samples about a place, moved so that the samples are in the scene."""
    reach = (pixels / 2 + MARGIN) * PITCH
    left, right, bottom, top = stored.raster.extent
    if 2 * reach > min(right - left, top - bottom):
        raise SystemExit(f"--pixels {pixels}: more than the scene of a cut has")
    x = float(np.clip(middle[0], left + reach, right - reach))
    y = float(np.clip(middle[1], bottom + reach, top - reach))
    side = pixels * PITCH
    return (
        Raster(x - side / 2, y + side / 2, PITCH, pixels, pixels),
        Raster(x - reach, y + reach, PITCH / SAMPLES, *[(pixels + 2 * MARGIN) * SAMPLES] * 2),
    )


def material_throughout(scene: Scene, start, duration):
    """Return the samples that have material in all frames of an exposure."""
    first, last = scene.frame_at(start), scene.frame_at(start + duration)
    return np.all([scene.field("material", index) > 0 for index in range(first, last + 1)], axis=0)


def distance_to_void(always):
    if always.all():
        return np.full(always.shape, np.inf)
    return distance_transform_edt(always) * PITCH / SAMPLES


def distance_to_tool(in_tool, solid):
    """Return the distance of samples to the outline between chip and tool in m."""
    spacing, far = PITCH / SAMPLES, np.full(in_tool.shape, np.inf)
    chip = solid & ~in_tool
    outside = distance_transform_edt(~in_tool) if in_tool.any() else far
    inside = distance_transform_edt(~chip) if chip.any() else far
    # From the middle of a sample to the border between samples.
    return spacing * (np.where(in_tool, inside, -outside) - np.where(in_tool, 0.5, -0.5))


def places_of_cut(tool, pixels, to_tool, always, instant):
    """Return the pixels of places that are away from moving surfaces."""
    x, y = np.meshgrid(pixels.x, pixels.y)
    centres = np.stack([x, y], axis=-1)
    along = tool.face_coordinates(centres)[0]
    clear = means(inner(distance_to_void(always))) > CLEAR_OF_VOID
    in_tool, distance = means(inner(to_tool) > 0) > 0.5, means(inner(to_tool))
    band = np.zeros(pixels.shape, bool)
    if instant.band is not None:
        from_ridge = cKDTree(instant.band.ridge.points).query(centres)[0]
        band = from_ridge < PITCH / 2
    return {
        "rake face": ~in_tool & (along > 0) & (distance > -PITCH) & clear,
        "tool": in_tool & (along > 0) & (distance < PITCH),
        "band": ~in_tool & (distance < -3 * PITCH) & band & clear,
        "rest": ~in_tool & (distance < -2 * PITCH) & clear,
    }


def drawn_netd(draw):
    return float(np.exp(draw.uniform(np.log(0.1), np.log(2.0))))


def seen(black, in_tool, samples, pixels, netd, draw):
    """Return the noisy image of the radiance on samples."""
    shining = (EMISSIVITY[0] + (EMISSIVITY[1] - EMISSIVITY[0]) * in_tool) * black
    image = image_formation(CAMERA, samples, pixels=pixels).forward(shining)
    return image + draw.normal(0, netd * float(BAND.slope(600.0)), image.shape)


def raster(pixels, parts=1, margin=0):
    count = (pixels + 2 * margin) * parts
    return Raster(-margin * PITCH, (pixels + margin) * PITCH, PITCH / parts, count, count)


def inner(field):
    """Return the samples within the image."""
    edge = slice(MARGIN * SAMPLES, -MARGIN * SAMPLES)
    return field[edge, edge]


def means(values):
    """Return the means over pixels of values on samples."""
    rows, columns = (count // SAMPLES for count in values.shape)
    return values.reshape(rows, SAMPLES, columns, SAMPLES).mean(axis=(1, 3))


def on_samples(pixels):
    return np.repeat(np.repeat(pixels, SAMPLES, 0), SAMPLES, 1)
