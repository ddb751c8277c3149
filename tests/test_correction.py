"""The true temperature of every pixel: solution, intervals, flags and refusals."""

from dataclasses import astuple, replace
from functools import partial

import numba
import numpy as np
import pytest
import xarray as xr
from command import refusal, typed, words

from chipglow import AnnularAperturePSF, Band, Camera, Estimate, Measurement, Raster
from chipglow.camera import Flag, ImageFormation, image_formation
from chipglow.correction import (
    CorrectionFlag,
    Zone,
    correct,
    known_parts,
    read_correction,
    write_correction,
)
from chipglow.correction.beyond import _REACH
from chipglow.correction.cells import cut_cells
from chipglow.correction.correct import _MARGIN, _image, _problem, _problem_and_beyond
from chipglow.correction.outline import (
    _OUTLINE_ERROR,
    LinearErrors,
    _motion_images,
    find_outlines,
    fit_outline,
)
from chipglow.correction.posterior import Image, Problem
from chipglow.correction.sensitivity import Knowledge
from chipglow.correction.zones import Motion, ShapedObject
from chipglow.io import read_measurement, write_measurement
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.scene import Polygon, Region, ToolGeometry

PITCH = 6e-6
SAMPLES = 8
"""Samples along a pixel of the images that stand for measured ones."""

BAND = Band(3.8e-6, 5.1e-6)
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), psf_order="optics", lower_limit=None)
DARK = Estimate(np.array(200.0))
"""Surroundings that hardly radiate."""

MORE = 16
"""Pixels by which a scene continues beyond its image: light from there reaches it."""

EDGE = 0.6
"""Position of the outline between chip and tool, of the width of the image."""


AWAY = ToolGeometry(tip=(5e-3, 5e-3))
OUTSIDE = r"tool: its tip at \(5000, 5000\) um is outside the image, expected .* x 0 to"


def half_plane(pixels, position, lean=0.2):
    """Return the part of an image to the right of a line that leans, as a region in m."""
    left, right, bottom, top = pixels.extent
    x, more = left + position * (right - left), MORE * PITCH
    far, low, high = right + (right - left) + more, bottom - more, top + more
    corners = ((x - lean * more, low), (far, low), (far, high), (x + lean * (high - bottom), high))
    return Region("tool", Polygon(corners), unit="m")


def around(pixels, samples=SAMPLES):
    """Return samples of the pixels and of those around them."""
    size = (pixels.rows + 2 * MORE) * samples
    left, top = pixels.left - MORE * PITCH, pixels.top + MORE * PITCH
    return Raster(left, top, PITCH / samples, size, size)


def scene(count=24, position=EDGE):
    """Return temperature and emissivity on samples, and the pixels: a hot chip beside a tool."""
    pixels = Raster(0.0, count * PITCH, PITCH, count, count)
    samples = around(pixels)
    x, y = np.meshgrid(samples.x, samples.y)
    tool = half_plane(pixels, position).shape.holds(x, y)
    across = (x - y) / (count * PITCH)
    band = 150.0 * np.exp(-(((across + 0.1) * count / 3) ** 2))
    kelvins = np.where(tool, 820.0 - 150.0 * x / (count * PITCH), 900.0 + 80.0 * across + band)
    return kelvins, np.where(tool, 0.58, 0.42), samples, pixels


def measured(kelvins, emissivity, samples, pixels, netd=0.5, seed=4, **settings):
    """Return the measurement of a scene, with noise in K at 600 K."""
    formation = image_formation(CAMERA, samples, pixels=pixels)
    light = formation.forward(emissivity * BAND.radiance(kelvins))
    noise = netd * float(BAND.slope(600.0))
    light = light + np.random.default_rng(seed).normal(0.0, noise, light.shape)
    return Measurement.from_radiance(light[None], BAND, np.zeros(1), pixels, **settings)


def zones(pixels, position=EDGE, **chip):
    return [Zone("chip", 0.42, **chip), Zone("tool", 0.58, half_plane(pixels, position))]


def pixel_truth(kelvins, emissivity, zone):
    """Return the temperature of the mean radiance over each pixel's part of its zone."""
    edge = slice(MORE * SAMPLES, -MORE * SAMPLES)
    emissivity = emissivity[edge, edge]
    radiance, truth = BAND.radiance(kelvins[edge, edge]), np.full(zone.shape, np.nan)
    for number, value in enumerate((0.42, 0.58)):
        own = emissivity == value
        sums, count = (
            np.where(own, one, 0.0).reshape(zone.shape[0], SAMPLES, zone.shape[1], SAMPLES)
            for one in (radiance, 1.0)
        )
        mean = sums.sum((1, 3)) / np.maximum(count.sum((1, 3)), 1)
        truth = np.where(zone == number, mean, truth)
    return BAND.temperature(truth)


@pytest.fixture(scope="module")
def chip_and_tool():
    """Return the corrected image of chip and tool, its truth, and the measurement."""
    kelvins, emissivity, samples, pixels = scene()
    image = measured(kelvins, emissivity, samples, pixels)
    result = correct(image, CAMERA, zones(pixels), surroundings=DARK, noise=0.5)
    truth = pixel_truth(kelvins, emissivity, result.data["zone"][0].values)
    return result, truth, image


def inside(image, width=3):
    mask = np.zeros(image.shape, bool)
    mask[width:-width, width:-width] = True
    return mask


def test_a_uniform_object_is_unchanged_within_the_noise():
    pixels = Raster(0.0, 20 * PITCH, PITCH, 20, 20)
    light = np.full((1, 20, 20), 0.5 * float(BAND.radiance(800.0)))
    noise = 0.5 * float(BAND.slope(600.0))
    light += np.random.default_rng(2).normal(0.0, noise, light.shape)
    image = Measurement.from_radiance(light, BAND, np.zeros(1), pixels)
    result = correct(image, CAMERA, [Zone("plate", 0.5)], surroundings=DARK, noise=0.5)
    error = result.data["temperature"][0].values - 800.0
    # Noise of one pixel: 0.5 K at 600 K is this much true temperature at 800 K.
    single = noise / 0.5 / float(BAND.slope(800.0))
    assert np.sqrt((error**2).mean()) < single
    # The mean of 400 pixels scatters by a twentieth of that; four standard deviations.
    assert abs(error.mean()) < 4 * single / 20


def test_blur_across_the_outline_is_taken_back(chip_and_tool):
    result, truth, image = chip_and_tool
    zone = result.data["zone"][0].values
    emissivity = np.where(zone == 1, 0.58, 0.42)
    alone = BAND.temperature(image.radiance[0] / emissivity) - truth
    error = result.data["temperature"][0].values - truth
    beside = np.zeros(zone.shape, bool)
    beside[:, 1:] |= zone[:, 1:] != zone[:, :-1]
    beside[:, :-1] |= zone[:, 1:] != zone[:, :-1]
    beside &= inside(zone)
    assert np.sqrt((alone[beside] ** 2).mean()) > 15.0  # there is an error to take back
    assert np.sqrt((error[beside] ** 2).mean()) < 0.35 * np.sqrt((alone[beside] ** 2).mean())
    rest = inside(zone) & ~beside
    assert np.sqrt((error[rest] ** 2).mean()) < np.sqrt((alone[rest] ** 2).mean())


def test_intervals_hold_the_truth(chip_and_tool):
    result, truth, _ = chip_and_tool
    lower, upper = (result.data[name][0].values for name in ("lower", "upper"))
    held = ((lower <= truth) & (truth <= upper))[inside(truth)]
    # 95 % are promised; errors of neighbours are correlated, so that 18 x 18 pixels are about
    # 80 independent ones, whose fraction scatters by 2.4 %: three standard deviations.
    assert held.mean() > 0.95 - 3 * 0.024


def problem_of(count):
    """Return the problem of an image of `scene`, and its measurement."""
    kelvins, emissivity, samples, pixels = scene(count)
    image = measured(kelvins, emissivity, samples, pixels)
    parts = cut_cells(ShapedObject(tuple(zones(pixels)), pixels), pixels)
    formation = ImageFormation(parts.cells, pixels, CAMERA.psf, False, 1.0)
    noise = np.full(pixels.shape, 0.5 * float(BAND.slope(600.0)))
    nothing = np.zeros(pixels.shape, bool)
    data = Image(image.radiance[0], noise, nothing, nothing, nothing)
    return Problem(data, parts, formation, np.zeros(pixels.shape)), image


def test_the_solution_is_that_of_a_dense_newton_method():
    """The same objective, with dense matrices and finite differences, has the same minimum."""
    problem, image = problem_of(8)
    parts, formation, noise = problem.parts, problem.formation, problem.image.noise
    posterior = problem.solve(np.random.default_rng(1), lambda: None)
    curvature, slopes = problem.curvature.matrix.toarray(), problem.slopes.toarray()
    prior = curvature.T @ (posterior.prior_weights[:, None] * curvature) + slopes.T @ slopes
    shine, centroids = parts.area * parts.emissivity, parts.at_centroids.toarray()
    columns = [
        formation.forward(cell.reshape(parts.cells.shape)).ravel()
        for cell in np.eye(parts.cells.rows * parts.cells.columns)
    ]
    matrix = np.stack(columns, axis=1)

    x = posterior.x.copy()
    for _ in range(30):
        sent = shine * np.exp(centroids @ x)
        seen = matrix @ parts.spread(x).toarray()
        jacobian = (seen * sent) @ centroids / noise.ravel()[:, None]
        residual = (image.radiance[0].ravel() - seen @ sent) / noise.ravel()
        hessian = jacobian.T @ jacobian + prior
        step = np.linalg.solve(hessian, jacobian.T @ residual - prior @ x)
        x = x + step
        if np.abs(step).max() < 1e-12:
            break
    spread = np.sqrt(np.diag(np.linalg.inv(hessian)))
    # Steps end at a change of 0.3 %; that is within a fifth of each standard uncertainty here.
    assert (np.abs(posterior.x - x) < 0.2 * spread).all()

    draws = np.stack(posterior.draws(np.random.default_rng(3), 200))
    ratio = np.sqrt((draws**2).mean(axis=0)) / spread
    # A standard deviation of 200 draws scatters by 5 %; the largest of 300 values by 4 of these.
    assert np.abs(ratio - 1).max() < 4 * 0.05 + 0.05


def test_contributions_sum_to_the_standard_uncertainty():
    kelvins, emissivity, samples, pixels = scene(16)
    image = measured(kelvins, emissivity, samples, pixels)
    known = zones(pixels, uncertainty=0.02, texture=0.01)
    result = correct(image, CAMERA, known, surroundings=DARK, noise=0.5, psf_uncertainty=0.03)
    assert {"noise", "smoothing", "emissivity", "texture", "psf"} <= set(result.sources)
    squares = sum(result.contribution(source) ** 2 for source in result.sources)
    stated = result.data["standard_uncertainty"][0].values
    # Effects are stored with 24 bits.
    np.testing.assert_allclose(np.sqrt(squares), stated, rtol=1e-5)


def test_an_emissivity_error_contributes_as_equation_2_says():
    pixels = Raster(0.0, 16 * PITCH, PITCH, 16, 16)
    light = np.full((1, 16, 16), 0.5 * float(BAND.radiance(900.0)))
    image = Measurement.from_radiance(light, BAND, np.zeros(1), pixels)
    result = correct(image, CAMERA, [Zone("plate", 0.5, None, 0.025)], surroundings=DARK, noise=0.1)
    expected = 0.05 * float(BAND.radiance(900.0)) / float(BAND.slope(900.0))
    # The change is solved to a residual of 0.1 %, which the noise's weights enlarge.
    np.testing.assert_allclose(result.contribution("emissivity"), expected, rtol=0.03)


def test_the_outline_is_found():
    kelvins, emissivity, samples, pixels = scene()
    image = measured(kelvins, emissivity, samples, pixels)
    off = 0.4 * PITCH
    moved = zones(pixels, EDGE + off / (24 * PITCH))
    result = correct(
        image, CAMERA, moved, surroundings=DARK, noise=0.5, outline_uncertainty=0.5 * PITCH
    )
    normal = np.array([1.0, -0.2]) / np.hypot(1.0, 0.2)
    found = result.data["outline_motion"][0].values[:2] @ normal
    assert abs(found + off * normal[0]) < 0.05 * PITCH


def test_without_an_outline_in_the_image_none_is_moved():
    pixels = Raster(0.0, 12 * PITCH, PITCH, 12, 12)
    light = np.full((1, 12, 12), 0.5 * float(BAND.radiance(800.0)))
    image = Measurement.from_radiance(light, BAND, np.zeros(1), pixels)
    stated = {"surroundings": DARK, "noise": 0.5, "outline_uncertainty": 3e-6}
    result = correct(image, CAMERA, [Zone("plate", 0.5)], **stated)
    assert (result.data["outline_motion"].values == 0).all()
    assert "outline" not in result.sources


def test_cells_are_cut_exactly():
    pixels = Raster(0.0, 12 * PITCH, PITCH, 12, 12)
    for position, lean in ((0.603, 0.0), (0.55, 0.3)):
        chip, tool = zones(pixels)
        tool = replace(tool, shape=half_plane(pixels, position, lean))
        parts = cut_cells(ShapedObject((chip, tool), pixels), pixels)
        found = parts.area[parts.zone == 1].sum()
        expected = 24**2 * (1 - position - lean / 2)
        # Each of the 24 cut rows of cells errs by up to 1/2000 of a cell, at random.
        assert abs(found - expected) < 0.01


def test_the_displacement_between_outlines_is_that_of_the_line():
    pixels = Raster(0.0, 12 * PITCH, PITCH, 12, 12)
    chip, tool = zones(pixels)
    moved = replace(tool, shape=half_plane(pixels, EDGE + 0.1 / 12))
    one, other = (cut_cells(ShapedObject((chip, every), pixels), pixels) for every in (tool, moved))
    # A line at this slope crosses 1.2 to 1.4 cells a row, which share its displacement.
    assert 0.1 / 1.5 < one.displacement(other) < 0.1
    assert one.displacement(one) == 0


def heated_chip():
    """Return temperature, distance to the outline and emissivity on samples, and the rasters."""
    _, emissivity, samples, pixels = scene()
    x, y = np.meshgrid(samples.x, samples.y)
    right = x - EDGE * 24 * PITCH - 0.2 * y
    chip = 850.0 + 300.0 * np.exp(np.minimum(right, 0.0) / (5 * PITCH))
    tool = 450.0 + 700.0 * np.exp(-np.maximum(right, 0.0) / (12 * PITCH))
    return np.where(emissivity == 0.58, tool, chip), right, emissivity, samples, pixels


# The third position is a second minimum of the loss, the last one takes 18 rounds.
@pytest.mark.parametrize(("off", "noise"), [(0.45, 0.5), (-0.45, 0.5), (0.75, 0.5), (-0.9, 0.1)])
def test_the_outline_of_a_heated_chip_is_found_and_does_not_slide_along_itself(off, noise):
    kelvins, _, emissivity, samples, pixels = heated_chip()
    image = measured(kelvins, emissivity, samples, pixels, netd=noise)
    moved = zones(pixels, EDGE + off / 24)
    result = correct(
        image, CAMERA, moved, surroundings=DARK, noise=noise, outline_uncertainty=0.5 * PITCH
    )
    motion = result.data["outline_motion"][0].values[:2] / PITCH
    normal = np.array([1.0, -0.2]) / np.hypot(1.0, 0.2)
    # The goal of the method where the radiance changes by 10 % or more across the outline.
    assert abs(motion @ normal + off * normal[0]) < 0.05
    # Nothing shows a motion along a straight outline: it stays below its standard uncertainty.
    assert abs(motion @ [normal[1], -normal[0]]) < 0.5


def test_any_number_of_threads_gives_the_same_bits():
    kelvins, emissivity, samples, pixels = scene(12)
    image = measured(kelvins, emissivity, samples, pixels)
    before = numba.get_num_threads()
    results = []
    for threads in {1, numba.config.NUMBA_NUM_THREADS}:
        numba.set_num_threads(threads)
        known = zones(pixels, uncertainty=0.02)
        results.append(correct(image, CAMERA, known, surroundings=DARK, noise=0.5).data)
    numba.set_num_threads(before)
    assert all(one.identical(results[0]) for one in results)


def test_a_gap_at_the_outline_does_not_move_it():
    kelvins, right, emissivity, samples, pixels = heated_chip()
    up = np.meshgrid(samples.x, samples.y)[1] - 6 * PITCH
    gap = (np.abs(right - 0.5 * PITCH) < PITCH) & (np.abs(up) < PITCH)
    image = measured(np.where(gap, 300.0, kelvins), emissivity, samples, pixels, netd=0.1)
    off = 0.2
    stated = ShapedObject(tuple(zones(pixels, EDGE + off / 24)), pixels)
    known = Knowledge(stated, BAND, 0.0, 0.5 * PITCH, DARK)
    inside, _ = _image(image, 0, CAMERA, 0.1, float(DARK.values))
    extended = inside.extended(_MARGIN)
    first = _problem_and_beyond(extended, CAMERA, known, pixels)
    problem_of = partial(_problem, extended, CAMERA, pixels.widened(_MARGIN))
    found, _, _ = find_outlines(first, known, [], problem_of, lambda: None)
    motion = np.array(astuple(found.observed.motion)[:2]) / PITCH
    normal = np.array([1.0, -0.2]) / np.hypot(1.0, 0.2)
    # Two of its smallest standard uncertainties; with an even prior the gap moves it by 0.33.
    assert abs(motion @ normal + off * normal[0]) < 2 * _OUTLINE_ERROR


def test_an_error_that_looks_like_a_motion_leaves_the_position_uncertain():
    problem, _ = problem_of(16)
    observed = ShapedObject(tuple(zones(problem.parts.pixels)), problem.parts.pixels)
    stated, error = 0.5 * PITCH, 0.3 * PITCH
    known = Knowledge(observed, BAND, 0.0, stated, DARK)
    posterior = problem.smooth(lambda: None)
    like_a_motion = error * _motion_images(posterior, known)[0]
    alone, both = (
        fit_outline(posterior, known, LinearErrors.of(posterior, images)).standard_uncertainty.right
        for images in ([], [like_a_motion])
    )
    # The image shows the sum of both at most, which leaves this much of the motion undetermined.
    least = stated * error / np.hypot(stated, error)
    assert alone < least < both < stated + _OUTLINE_ERROR * PITCH


def test_the_radiance_continues_beyond_the_image():
    """The field cools away from its middle, as a heated object does."""
    pixels = Raster(0.0, 16 * PITCH, PITCH, 16, 16)

    def field(x, y):
        distance = np.hypot(x / PITCH - 8, y / PITCH - 8)
        return 600.0 + 300.0 / (1 + (distance / 14) ** 2)

    samples = around(pixels, 4)
    light = 0.5 * BAND.radiance(field(*np.meshgrid(samples.x, samples.y)))
    image = image_formation(CAMERA, samples, pixels=pixels).forward(light)
    image = Measurement.from_radiance(image[None], BAND, np.zeros(1), pixels)
    result = correct(image, CAMERA, [Zone("plate", 0.5)], surroundings=DARK, noise=0.1)
    error = result.data["temperature"][0].values - field(*np.meshgrid(pixels.x, pixels.y))
    mean = error[4:-4, 4:-4].mean()
    # Without the slope of the radiance beyond the image, the mean is 2.6 K too low.
    assert abs(mean) < 0.9  # a third of it: the slopes fade, those of the field do less
    assert abs(mean) < float(result.at(inside(error, 4)).expanded_uncertainty())


def test_a_zone_whose_hot_end_is_in_the_image_cools_beyond_it():
    """As a workpiece under a cutting edge does, of which an image shows the contact."""
    count = 24
    pixels = Raster(0.0, count * PITCH, PITCH, count, count)
    corners = ((12.0, 2.0), (60.0, 2.0), (60.0, -40.0), (12.0, -40.0))
    points = tuple((x * PITCH, y * PITCH) for x, y in corners)
    end = Zone("workpiece", 0.4, Region("workpiece", Polygon(points), unit="m"))
    observed = ShapedObject((Zone("chip", 0.4), end), pixels)
    known = Knowledge(observed, BAND, 0.0, 0.0, DARK)
    data = Image(*np.ones((2, count, count)), *np.zeros((3, count, count), bool))
    beyond = _problem_and_beyond(data.extended(_MARGIN), CAMERA, known, pixels).beyond
    # It is hotter by a factor of e² and cools by 0.1 a pixel, which the image shows in two rows.
    outer, solved = beyond.outer, beyond.solved
    rows, columns = np.divmod(solved.cell, solved.cells.columns)
    depth = rows / 2 - (_REACH + _MARGIN + count)  # pixels under the image
    warm, cold = (
        beyond.continuation(np.where(solved.zone == 1, 2.0 - 0.1 * depth, level))
        for level in (0.0, -2.0)
    )
    rows, columns = np.divmod(outer.cell, outer.cells.columns)
    column, row = (2 * (_REACH + _MARGIN + place) for place in (18, count + _REACH))
    far = (outer.zone == 1) & (columns == column) & (rows == row)
    # A constant would be 2, and a constant slope 0.8: the end of the zone is nearer to this.
    assert 0.6 < warm[far][0] < 1.2
    # The colder the image, the colder is what it does not show.
    assert cold[far][0] < warm[far][0] - 0.1


def test_an_interval_contains_light_that_is_not_beyond_the_image():
    """A hot corner of a cold image: its light from beyond is assumed, and is not there."""
    pixels = Raster(0.0, 24 * PITCH, PITCH, 24, 24)

    def field(x, y):
        distance = np.hypot(x / PITCH - 24, y / PITCH - 24)
        return 350.0 + 550.0 * np.exp(-distance / 14)

    samples = around(pixels, 4)
    light = 0.5 * BAND.radiance(field(*np.meshgrid(samples.x, samples.y)))
    image = image_formation(CAMERA, samples, pixels=pixels).forward(light)
    image += np.random.default_rng(1).normal(0, 0.1 * float(BAND.slope(600.0)), image.shape)
    image = Measurement.from_radiance(image[None], BAND, np.zeros(1), pixels, 573.15)
    result = correct(image, CAMERA, [Zone("plate", 0.5)], surroundings=DARK, noise=0.1)
    found = result.data["temperature"][0].values
    judged = np.isfinite(found) & inside(found, 4)
    error = (found - field(*np.meshgrid(pixels.x, pixels.y)))[judged].mean()
    # The assumed light makes it 5 K too cold; the noise, of 0.1 K, hardly counts.
    assert -7.0 < error < -4.0
    assert abs(error) < float(result.at(judged).expanded_uncertainty())


def test_cells_form_the_image_of_a_cut_object():
    """Cells half as wide as a pixel and samples of a sixteenth form the same image."""
    pixels = Raster(0.0, 10 * PITCH, PITCH, 10, 10)
    parts = cut_cells(ShapedObject(tuple(zones(pixels)), pixels), pixels)
    samples = Raster(0.0, 10 * PITCH, PITCH / 16, 160, 160)
    x, y = np.meshgrid(samples.x, samples.y)
    # A sample that the outline crosses is of both zones.
    to_tool = (x - EDGE * 10 * PITCH - 0.2 * y) / samples.spacing
    tool = np.clip(0.5 + to_tool, 0.0, 1.0)
    fine = image_formation(CAMERA, samples, pixels=pixels).forward(0.42 + 0.16 * tool)
    light = parts.spread(np.zeros(parts.size)) @ (parts.area * parts.emissivity)
    formation = image_formation(CAMERA, parts.cells, pixels=pixels)
    error = formation.forward(light.reshape(parts.cells.shape)) / fine - 1
    # Measured: 1.7e-4, which is 0.04 K at 900 K. Without third and fourth moments: 4.9e-4.
    assert np.abs(error[2:-2, 2:-2]).max() < 3e-4


def test_the_resolution_counts_the_data():
    """The squares of the resolution side by side need as many data as the image has, or fewer."""
    kelvins, emissivity, samples, pixels = scene()
    image = measured(kelvins, emissivity, samples, pixels)

    def data(noise):
        found = correct(image, CAMERA, zones(pixels), surroundings=DARK, noise=noise)
        return float(((PITCH / found.data["resolution"][0]) ** 2).sum())

    few, many = data(5.0), data(0.5)
    # Twelve draws estimate the trace to some percent; a tenth of the noise shows more detail.
    assert 10 < few < 0.8 * many
    assert many < 1.1 * pixels.rows * pixels.columns


def test_pixels_out_of_range_have_one_bound():
    kelvins, emissivity, samples, pixels = scene()
    plain = measured(kelvins, emissivity, samples, pixels)
    flags = np.zeros((1, *pixels.shape), np.uint8)
    flags[0, 5:8, 5:8] = Flag.SATURATED
    flags[0, 12, 12] = Flag.DEAD
    limit = float(np.quantile(plain.radiance_temperature(), 0.1))
    image = Measurement.from_radiance(
        plain.radiance, BAND, np.zeros(1), pixels, lower_limit=limit, flags=flags
    )
    result = correct(image, CAMERA, zones(pixels), surroundings=DARK, noise=0.5)
    data, found = result.data.isel(time=0), result.data["flags"][0].values
    above, below = (
        found & one > 0 for one in (CorrectionFlag.LOWER_BOUND, CorrectionFlag.UPPER_BOUND)
    )
    assert above[5:8, 5:8].all() and above.sum() == 9
    assert below.any()
    assert np.isnan(data["temperature"].values[above | below]).all()
    assert np.isfinite(data["lower"].values[above]).all()
    assert np.isnan(data["upper"].values[above]).all()
    assert np.isfinite(data["upper"].values[below]).all()
    assert np.isnan(data["lower"].values[below]).all()
    assert found[12, 12] & CorrectionFlag.INTERPOLATED
    assert np.isfinite(data["temperature"].values[12, 12])


def test_places_of_a_result(chip_and_tool, tmp_path):
    result, _, _ = chip_and_tool
    point = result.at((8 * PITCH, 12 * PITCH))
    row = 24 - 12
    assert float(point.values) == result.data["temperature"][0].values[row, 8]
    stated = result.data["standard_uncertainty"][0].values[row, 8]
    assert float(point.standard_uncertainty) == pytest.approx(stated, rel=1e-7)  # stored as float32
    budget = result.budget((8 * PITCH, 12 * PITCH))
    assert list(budget["standard_uncertainty"]) == sorted(
        budget["standard_uncertainty"], reverse=True
    )
    region = result.at(Region("square", Polygon.rectangle((4.0, 4.0), (8.0, 8.0))))
    noise = point.contribution("noise"), region.contribution("noise")
    assert noise[1] < noise[0]  # that of 16 pixels averages
    with pytest.raises(ValueError, match="outside the image"):
        result.at((-PITCH, 0.0))
    write_correction(result, tmp_path / "corrected.nc")
    again = read_correction(tmp_path / "corrected.nc")
    assert again.data.equals(result.data)
    assert len(result.to_frame()) == 24 * 24
    assert "Correction" in repr(result)


def test_a_notebook_shows_each_frame_of_a_result(chip_and_tool):
    result, _, _ = chip_and_tool
    html = result._repr_html_()
    hottest = float(np.nanmax(result.data["temperature"])) - 273.15
    assert "Correction: 1 frames of 24 x 24 pixels" in html
    assert f"<td>{hottest:.6g}</td>" in html and "<td>576</td>" in html
    assert "Noise" not in html  # which was stated
    frame = result.to_frame()
    assert (frame.measured.values == result.data["measured"][0].values.ravel()).all()
    assert result.flags.shape == (1, 24, 24)


@pytest.mark.parametrize(
    "read",
    [
        lambda result: result.at((1e-5, 1e-5), 1),
        lambda result: result.budget((1e-5, 1e-5), 1),
        lambda result: result.contribution("noise", 1),
        lambda result: result.to_frame(1),
        lambda result: result.plot(1),
    ],
)
def test_a_frame_that_does_not_exist_is_refused(chip_and_tool, read):
    with pytest.raises(ValueError, match="frame: is 1, expected 0 to 0"):
        read(chip_and_tool[0])


def test_the_same_seed_gives_the_same_result(chip_and_tool):
    result, _, image = chip_and_tool
    again = correct(image, CAMERA, zones(image.raster), surroundings=DARK, noise=0.5)
    assert again.data.equals(result.data)


def test_parts_of_the_laboratory():
    pixels = Raster(0.0, 24 * PITCH, PITCH, 24, 24)
    part = half_plane(pixels, EDGE)
    lines = {
        "tool": EmissivityLine.constant(0.58, 0.02),
        "chip": EmissivityLine.constant(0.42, 0.03),
    }
    chip, tool = (one.zone(700.0) for one in known_parts(lines, [part], elsewhere="chip"))
    assert (chip.emissivity, chip.uncertainty, chip.shape) == (0.42, pytest.approx(0.03), None)
    assert (tool.emissivity, tool.uncertainty, tool.shape) == (0.58, pytest.approx(0.02), part)
    outside, _ = known_parts(lines, [part])
    assert outside.zone(700.0).emissivity is None
    with pytest.raises(ValueError, match="'band' has no emissivity"):
        known_parts(lines, [part], elsewhere="band")


def test_outside_the_known_zones_nothing_is_determined():
    kelvins, emissivity, samples, pixels = scene()
    image = measured(kelvins, emissivity, samples, pixels)
    chip, tool = zones(pixels)
    result = correct(image, CAMERA, [replace(chip, emissivity=None), tool], surroundings=DARK)
    unknown = result.data["flags"][0].values & CorrectionFlag.NOT_DETERMINED > 0
    assert unknown.any() and not unknown.all()
    assert np.isnan(result.data["temperature"][0].values[unknown]).all()
    assert np.isfinite(result.data["temperature"][0].values[~unknown]).all()


def test_a_moved_object_is_looked_up_where_it_came_from():
    pixels = Raster(0.0, 24 * PITCH, PITCH, 24, 24)
    stated = ShapedObject(tuple(zones(pixels)), pixels)
    generator = np.random.default_rng(5)
    x, y = generator.uniform(0.0, 24 * PITCH, (2, 200))
    motion = Motion(3e-6, -2e-6, 0.1)
    centre = np.array(stated.centre)
    turn = np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]])
    moved = (np.stack([x, y], axis=1) - centre) @ turn.T + centre + [3e-6, -2e-6]
    labels, _ = stated.look_up(x, y)
    found, _ = stated.moved(motion).look_up(*moved.T)
    assert (found == labels).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"camera": replace(CAMERA, psf=None)}, "no point spread function"),
        ({"camera": CAMERA.in_band(Band(8e-6, 12e-6))}, "3.8 um in the measurement, 8 um in"),
        ({"camera": replace(CAMERA, pitch=5e-6)}, "pitch: 6 um in the measurement, 5"),
        ({"zones": [Zone("plate", None)]}, "no zone has a known emissivity"),
        ({"zones": [Zone("plate", 0.5), Zone("tool", 0.6, AWAY)]}, OUTSIDE),
        ({"psf_uncertainty": -1.0}, "psf_uncertainty is -1.0"),
        ({"outline_uncertainty": np.nan}, "outline_uncertainty is nan"),
    ],
)
def test_refusals(change, message):
    pixels = Raster(0.0, 8 * PITCH, PITCH, 8, 8)
    image = Measurement.from_radiance(np.full((1, 8, 8), 20.0), BAND, np.zeros(1), pixels)
    arguments = {"camera": CAMERA, "zones": [Zone("plate", 0.5)]} | change
    with pytest.raises(ValueError, match=message):
        correct(image, **arguments)


def test_an_image_below_the_range_is_refused():
    pixels = Raster(0.0, 8 * PITCH, PITCH, 8, 8)
    image = Measurement.from_radiance(
        np.full((1, 8, 8), 20.0), BAND, np.zeros(1), pixels, lower_limit=2000.0
    )
    with pytest.raises(ValueError, match="frame 0 has no pixel within the range"):
        correct(image, CAMERA, [Zone("plate", 0.5)])


@pytest.mark.parametrize(
    "settings",
    [{"emissivity": 0.0}, {"emissivity": 1.2}, {"emissivity": 0.5, "uncertainty": -0.1},
     {"emissivity": 0.5, "texture": 1.0}, {"emissivity": 0.5, "grain": 0.0}],
)  # fmt: skip
def test_zones_out_of_limits_are_refused(settings):
    with pytest.raises(ValueError, match="zone plate"):
        Zone("plate", **settings)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a measurement and its point spread function."""
    kelvins, emissivity, samples, pixels = scene(12)
    write_measurement(measured(kelvins, emissivity, samples, pixels), tmp_path / "chip.nc")
    kernel = xr.Dataset({"kernel": (("y", "x"), np.ones((3, 3)) / 9, {"spacing": PITCH})})
    kernel.to_netcdf(tmp_path / "psf.nc", engine="h5netcdf")
    kernel["kernel"].attrs |= {"band_lower": 8e-6, "band_upper": 12e-6}
    kernel.to_netcdf(tmp_path / "long-wave.nc", engine="h5netcdf")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("", "--psf: is missing; give --psf with --emissivity, or --study"),
        ("--psf psf.nc --study s.yaml", "--study: cannot be combined with --psf"),
        ("--psf psf.nc", "--emissivity: give a file of chipglow emissivity, or a number; or --map"),
        ("--psf psf.nc --emissivity 1.7", "emissivity: is 1.7, expected more than 0 to 1"),
        ("--psf psf.nc --emissivity e.nc", "e.nc: there is no such file"),
        ("--psf none.nc --emissivity 0.7", "none.nc: there is no such file"),
        ("--psf psf.nc --emissivity 0", "emissivity: is 0.0, expected more than 0 to 1"),
        (
            "--psf long-wave.nc --emissivity 0.7",
            "long-wave.nc: psf: was measured in the band 8 um to 12 um, expected that of the "
            "camera, 3.8 um to 5.1 um",
        ),
    ],
)
def test_the_command_refuses_in_one_line(folder, options, message):
    assert message in refusal(f"correct chip.nc {options} --out corrected.nc")
    assert not (folder / "corrected.nc").exists()


def test_the_command_refuses_a_tool_outside_the_image(folder):
    text = "tip: [5 mm, 5 mm]\nrake_angle: 0 deg\nclearance_angle: 7 deg\n"
    (folder / "tool.yaml").write_text(text, "utf-8")
    message = refusal("correct chip.nc --psf psf.nc --emissivity 0.42 --tool tool.yaml")
    assert "tool: its tip at (5000, 5000) um is outside the image" in message
    assert "expected a tool that reaches x 0 to 72 um and y 0 to 72 um" in message
    own = read_measurement(folder / "chip.nc").with_tool(AWAY)
    write_measurement(own, folder / "own.nc")
    message = refusal("correct own.nc --psf psf.nc --emissivity 0.42")
    assert "tool: its tip at (5000, 5000) um is outside the image" in message


def test_a_point_spread_function_without_a_band_is_assumed_to_fit(folder):
    said = words(typed("correct chip.nc --psf psf.nc --emissivity 0.42").output)
    assert "psf.nc states no band: it was measured in that of the image." in said
