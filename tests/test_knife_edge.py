"""The knife edge: what made a synthetic edge is returned within its stated uncertainty."""

from dataclasses import replace
from math import cos, degrees, radians, sqrt

import numpy as np
import pytest
from drawn import in_a_notebook
from synthetic_edge import (
    FWHM_PER_SIGMA,
    PITCH,
    WAVELENGTH,
    annular_edge,
    blurred_disc_edge,
    disc_edge,
    edge_radiance,
    gaussian_aperture,
    gaussian_edge,
    gaussian_transfer,
    image_of,
    measurement_of,
    moffat_edge,
    ring_edge,
    tailed_edge,
)

from chipglow.camera import AnnularAperturePSF, Flag, GaussianPSF, MeasuredPSF
from chipglow.laboratory.psf import NoEdgeError, edge_image, knife_edge, psf_kernel
from chipglow.laboratory.psf.linearity import asymmetry
from chipglow.laboratory.psf.psf_models import (
    AnnularModel,
    DefocusedDiscModel,
    DefocusedRingModel,
    GaussianModel,
    GaussianTailModel,
    MoffatModel,
    PSFModel,
    edge_response,
)

FWHM = 10e-6


def blurred_ring_edge(outer, inner, blur):
    large, small = blurred_disc_edge(outer, blur), blurred_disc_edge(inner, blur)
    fraction = (inner / outer) ** 2
    return lambda u: (large(u) - fraction * small(u)) / (1 - fraction)


GAUSSIAN = gaussian_edge(FWHM)
MIRROR = (0.28, 0.35)
CASES = {
    "gaussian": (GaussianModel(), [FWHM], GAUSSIAN),
    "tail": (GaussianTailModel(), [8e-6, 0.2, 2.5], tailed_edge(8e-6, 0.2, 20e-6)),
    "annular": (AnnularModel(WAVELENGTH), [MIRROR[0], MIRROR[1] ** 2], None),
    "moffat": (MoffatModel(), [FWHM, 2.5], moffat_edge(FWHM, 2.5)),
    "disc": (DefocusedDiscModel(), [16e-6, 8e-6], blurred_disc_edge(16e-6, 8e-6)),
    "ring": (DefocusedRingModel(), [24e-6, 4e-6, 0.25], blurred_ring_edge(24e-6, 12e-6, 4e-6)),
}


def truth_of(name):
    """Model, parameters and edge-spread function."""
    model, values, edge = CASES[name]
    return model, np.array(values), edge or annular_edge(WAVELENGTH, *MIRROR)


def an_image(normal=5.0, edge=GAUSSIAN, noise=0.05, seed=0, saturation=None, name="edge", **more):
    return image_of(edge_radiance(edge, normal, **more), noise, seed, saturation, name)


@pytest.fixture(scope="module")
def clean():
    return knife_edge([an_image()])


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("normal", [0.0, 5.0, 33.0, 45.0])
def test_a_model_with_the_sensor_is_the_mean_over_its_square(name, normal):
    model, values, edge = truth_of(name)
    measured = edge_radiance(edge, normal, 24, background=0.0, step=1.0)
    image = image_of(measured)
    x, y = np.meshgrid(image.x - image.x.mean(), image.y - image.y.mean())
    angle = radians(normal)
    distance = x * cos(angle) + y * np.sin(angle) - 1e-6
    response = edge_response(model, tuple(values), angle, PITCH, 250e-6)
    # Tails of diffraction that wrap around the table are the largest of the errors.
    np.testing.assert_allclose(response(distance), measured, atol=1e-5)


@pytest.mark.parametrize(
    "made",
    [
        {"normal": 2.0},
        {"normal": 88.0},
        {"normal": 178.0},
        {"normal": -130.0, "noise": 0.5},
        {"noise": 0.005},
        {"background": 0.0, "step": 500.0},
        {"saturation": 6.0},
        {"fwhm": 5e-6},
        {"fwhm": 25e-6, "side": 60},
    ],
    ids=str,
)
def test_a_gaussian_is_returned_within_its_uncertainty(made):
    made = dict(made)
    fwhm = made.pop("fwhm", FWHM)
    found = knife_edge([an_image(edge=gaussian_edge(fwhm), **made)])
    assert found.best.model.name == "gaussian"
    assert abs(found.fwhm - fwhm) < 3 * found.edge_uncertainty
    # Noise of 10 % of the step is known to be the worst of these: 0.6 um.
    assert found.edge_uncertainty < 0.08 * fwhm
    assert found.psf() == GaussianPSF(found.fwhm)


@pytest.mark.parametrize("saturation", [None, 6.6])
@pytest.mark.parametrize("normal", [5.0, -140.0])
def test_diffraction_is_returned_within_its_uncertainty(normal, saturation):
    edge = truth_of("annular")[2]
    found = knife_edge([an_image(normal, edge, 0.02, 3, saturation)])
    assert found.best.model.name == "annular aperture"
    psf = found.psf()
    assert isinstance(psf, AnnularAperturePSF)
    aperture, area = found.best.uncertainties
    assert abs(psf.numerical_aperture - MIRROR[0]) < 3 * aperture < 0.012
    assert abs(psf.obscuration**2 - MIRROR[1] ** 2) < 3 * area < 0.02
    true = AnnularAperturePSF(WAVELENGTH, *MIRROR).fwhm
    assert abs(found.fwhm - true) < 3 * found.edge_uncertainty < 0.05 * true
    assert bool(saturation) == any("saturated" in warning for warning in found.notes.warnings)


def test_a_tail_is_told_from_a_wider_core():
    model, values, edge = truth_of("tail")
    found = knife_edge([an_image(edge=edge, side=64)])
    assert found.best.model.name == "gaussian with tail"
    apart = np.abs(found.best.values - values) / found.best.uncertainties
    assert (apart < 3).all()
    assert found.fit("gaussian").bic - found.best.bic > 100
    assert abs(found.fwhm - model.fwhm(values)) < 3 * found.edge_uncertainty
    psf = found.psf()
    assert isinstance(psf, MeasuredPSF)
    # Straight lines between samples an eighth of the width apart.
    assert psf.fwhm == pytest.approx(found.fwhm, rel=0.01)


def test_edge_line_and_mtf_of_the_bins_are_those_that_made_the_edge(clean):
    edge = clean.edges[0]
    curves = {name: curve.values for name, curve in edge.curves.items()}
    # Bins hold pixels at any distance: 0.5 % measured.
    assert np.median(np.diff(curves["distance"])) == pytest.approx(PITCH / 4, rel=0.01)
    assert curves["pixels"].sum() == 40 * 40
    assert np.mean(np.abs(curves["esf_residual"]) < 2 * curves["esf_uncertainty"]) > 0.9
    frequency = curves["frequency"]
    true = gaussian_transfer(frequency, FWHM, 5.0)
    assert curves["mtf"][0] == pytest.approx(1.0)
    away = np.abs(curves["mtf"] - true)
    assert (away < 4 * curves["mtf_uncertainty"] + 1e-9)[1:33].all()
    sigma = sqrt((FWHM / FWHM_PER_SIGMA) ** 2 + PITCH**2 / 12)
    # Of a Gaussian and a square, nearly a Gaussian; the square alone would have 6 um.
    assert edge.line_fwhm == pytest.approx(sigma * FWHM_PER_SIGMA, rel=0.02)
    light = np.sum(curves["lsf"] * np.diff(curves["distance"]))
    assert light == pytest.approx(1.0, abs=0.02)  # the noise of both ends: 0.6 % measured


def test_a_round_spread_is_found_from_edges_of_several_orientations(clean):
    found = knife_edge([an_image(5.0), an_image(97.0, seed=1), an_image(-130.0, seed=2)])
    assert found.best.model.name == "gaussian"
    assert abs(found.fwhm - FWHM) < 3 * found.edge_uncertainty
    # Three images: 1/√3 of the uncertainty of one.
    ratio = found.edge_uncertainty / clean.edge_uncertainty
    # Uncertainties follow from the residuals of each: 22 % measured.
    assert ratio == pytest.approx(1 / sqrt(3), rel=0.25)


def test_an_elliptical_spread_is_told_from_a_round_one():
    # 14 um along 30 deg, 8 um across it.
    largest, least, direction = 14e-6, 8e-6, radians(30.0)

    def width(normal):
        turned = radians(normal) - direction
        return sqrt((largest * cos(turned)) ** 2 + (least * np.sin(turned)) ** 2)

    normals = (4.0, 64.0, 126.0)
    images = [an_image(n, gaussian_edge(width(n)), seed=k) for k, n in enumerate(normals)]
    found = knife_edge(images)
    assert found.best.model.name == "elliptical gaussian"
    x, y, both = found.best.values
    squares, axes = np.linalg.eigh([[x**2, both * x * y], [both * x * y, y**2]])
    # By the noise: 0.3 % measured.
    assert np.sqrt(squares) == pytest.approx((least, largest), rel=0.01)
    # In degrees, by the noise: 0.4 measured.
    assert degrees(np.arctan(axes[1, 1] / axes[0, 1])) == pytest.approx(30.0, abs=1.0)
    for edge, normal in zip(found.edges, normals, strict=True):
        assert abs(edge.fwhm - width(normal)) < 3 * edge.fwhm_uncertainty
    kernel = found.psf().kernel(1e-6)
    x = np.arange(len(kernel)) - len(kernel) // 2
    # First row on top: y goes up as the row number goes down.
    across = np.sum(kernel * x * -x[:, None]) * 1e-12
    expected = (largest**2 - least**2) / 2 * np.sin(2 * direction) / FWHM_PER_SIGMA**2
    assert across == pytest.approx(expected, rel=0.02)  # the same, and samples of 1 um: 0.5 %
    flat = knife_edge([an_image(4.0, gaussian_edge(12e-6)), an_image(94.0, gaussian_edge(9e-6))])
    assert flat.best.model.name == "elliptical gaussian"
    # By the noise: 0.2 % measured.
    assert flat.best.values == pytest.approx([12e-6, 9e-6], rel=0.01)


def test_where_no_model_fits_all_count_alike():
    """Half of the light in a disc, the other half in a narrow core: 6.9 um wide."""
    disc, core = disc_edge(20e-6), gaussian_edge(6e-6)
    found = knife_edge([an_image(5.0, lambda u: (disc(u) + core(u)) / 2, 0.02, side=64)])
    assert any("No model fits" in warning for warning in found.notes.warnings)
    assert found.weights == (1 / len(found.fits),) * len(found.fits)
    assert abs(found.fwhm - 6.0e-6) < 1.96 * found.edge_uncertainty


@pytest.mark.parametrize(
    ("edge", "model", "fwhm"),
    [
        (moffat_edge(FWHM, 2.0), "moffat", FWHM),
        (moffat_edge(FWHM, 3.0), "moffat", FWHM),
        (disc_edge(12e-6), "defocused disc", 24e-6),
        (ring_edge(6e-6, 12e-6), "defocused ring", 24e-6),
    ],
)
def test_tails_of_a_power_and_a_disc_out_of_focus_are_models(edge, model, fwhm):
    found = knife_edge([an_image(5.0, edge, 0.02)])
    assert found.best.model.name == model
    assert abs(found.fwhm - fwhm) < 3 * found.edge_uncertainty < 0.06 * fwhm
    assert found.notes.warnings == []
    if model != "defocused ring":
        # Of a ring the camera's kernel counts the lit area only.
        assert found.psf().fwhm == pytest.approx(found.fwhm, rel=0.01)


@pytest.mark.parametrize(
    ("normals", "oval", "text"),
    [
        ((5.0,), 0.2, "do not show an oval point spread function of up to 2:1"),
        ((5.0, 40.0), 0.2, "edges of three orientations would"),
        ((5.0, 95.0), 0.064, "do not show an oblique oval point spread function of up to 2:1"),
        ((5.0, 95.0, 50.0), 0.0, ""),
    ],
)
def test_an_oval_that_the_edges_do_not_show_is_uncertain(normals, oval, text):
    """Axes of 14 and 8 um at 45 degrees: across both edges it is as wide as one of 11.4 um."""

    def edge(normal):
        turned = radians(normal - 45.0)
        return gaussian_edge(np.hypot(14e-6 * cos(turned), 8e-6 * np.sin(turned)))

    found = knife_edge([an_image(one, edge(one), seed=k) for k, one in enumerate(normals)])
    assert found.oval == pytest.approx(oval, abs=0.001)  # by the noise: 0.0004 measured
    assert text in " ".join(found.notes.assumed)
    true = sqrt(14e-6 * 8e-6)
    assert abs(found.fwhm - true) < 1.96 * found.fwhm_uncertainty
    if text.startswith("do not show"):
        # Without the term no interval holds it: the error is many times the fit's uncertainty.
        assert abs(found.fwhm - true) > 4 * found.edge_uncertainty
    kernel = psf_kernel(found).estimate
    assert ("psf oval" in kernel.names) == bool(oval)


def test_apertures_tell_of_tails_that_an_edge_does_not():
    # A tail as long as half of the image: alone it is taken for background.
    edge = tailed_edge(8e-6, 0.1, 60e-6)
    images = [an_image(edge=edge, noise=0.2)]
    holes = [
        gaussian_aperture(8e-6, size, 0.1, 60e-6, noise=0.01, seed=k, side=161)
        for k, size in enumerate((40e-6, 80e-6, 160e-6, 320e-6, 800e-6))
    ]
    alone, together = knife_edge(images), knife_edge(images, holes)
    fraction = together.fit("gaussian with tail")
    assert together.best is fraction
    # The images of apertures have no footprint, which adds under 1 % at the smallest.
    assert fraction.values[1] == pytest.approx(0.1, abs=0.01)
    # By the noise: 0.06 % measured.
    assert fraction.values[2] * fraction.values[0] == pytest.approx(60e-6, rel=0.01)
    unsure = alone.fit("gaussian with tail").uncertainties[1]
    assert fraction.uncertainties[1] < 0.3 * unsure


def test_apertures_that_contradict_the_edge_are_doubtful():
    sizes = (60e-6, 120e-6, 240e-6, 300e-6)
    holes = [gaussian_aperture(FWHM, size, noise=0.01, seed=5) for size in sizes]
    assert knife_edge([an_image()], holes).notes.warnings == []
    # A tail that the edge does not have, in the apertures alone.
    holes = [gaussian_aperture(FWHM, size, 0.2, 40e-6, noise=0.01, seed=5) for size in sizes]
    warnings = knife_edge([an_image(noise=0.01, side=64)], holes).notes.warnings
    assert any("contradict each other" in warning for warning in warnings)


def bar():
    return edge_radiance(GAUSSIAN, 5.0, position=-60e-6) - edge_radiance(
        GAUSSIAN, 5.0, position=50e-6, background=0.0
    )


@pytest.mark.parametrize(
    ("radiance", "noise", "text"),
    [
        (np.full((40, 40), 3.0), 0.0, "all pixels have the same radiance"),
        (np.full((40, 40), 3.0), 0.1, "no edge stands out of the noise"),
        (edge_radiance(GAUSSIAN, 5.0, position=1e-3), 0.05, "no edge stands out of the noise"),
        (edge_radiance(GAUSSIAN, 5.0, position=118e-6), 0.05, "the image reaches"),
        (edge_radiance(gaussian_edge(600e-6), 5.0), 0.05, "the image reaches"),
        (bar(), 0.05, "more than one straight edge"),
        (
            edge_radiance(GAUSSIAN, 5.0) + edge_radiance(GAUSSIAN, 95.0, step=2.0),
            0.05,
            "more than one straight edge",
        ),
        (np.full((40, 40), np.nan), 0.0, "0 usable pixels"),
    ],
    ids=["flat", "noise", "outside", "border", "ramp", "bar", "corner", "dead"],
)
def test_without_one_edge_there_is_one_error(radiance, noise, text):
    image = image_of(radiance, noise, name="edge.nc")
    with pytest.raises(NoEdgeError, match=r"^edge\.nc: ") as caught:
        knife_edge([replace(image, dead=~np.isfinite(radiance))])
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("normal", "aliased"), [(0.0, True), (45.0, True), (90.0, True), (5.0, False)]
)
def test_tilts_that_sample_the_edge_too_coarsely_are_doubtful(normal, aliased):
    found = knife_edge([an_image(normal)])
    assert any("aliased" in warning for warning in found.notes.warnings) is aliased


def test_without_noise_the_truth_is_returned_and_nothing_is_doubtful(clean):
    found = knife_edge([an_image(noise=0.0)])
    assert found.fwhm == pytest.approx(FWHM, rel=2e-5)  # kernels and table of the edge: 3e-6
    assert found.notes.warnings == clean.notes.warnings == []


def test_noise_that_grows_with_the_light_is_weighed():
    """Of a dark side with a tenth of the noise, the width is known better than from the other."""
    radiance = edge_radiance(GAUSSIAN, 5.0)
    fraction = (radiance - 2.0) / 5.0
    found = knife_edge([image_of(radiance, 0.02 + 0.18 * fraction, 3)])
    assert found.edges[0].noise < 0.06
    assert abs(found.fwhm - FWHM) < 3 * found.edge_uncertainty
    even = knife_edge([image_of(radiance, 0.2, 3)])
    assert found.edge_uncertainty < 0.8 * even.edge_uncertainty


def doubts(image):
    return " ".join(knife_edge([image]).notes.warnings)


def test_bent_and_short_and_unresolved_edges_are_doubtful():
    angle, place = radians(5.0), np.arange(60) - 29.5
    bow = 4e-6 * (place[:, None] / 30) ** 2
    distance = PITCH * (place * cos(angle) + place[::-1, None] * np.sin(angle)) - bow
    bent = image_of(2.0 + 5.0 * gaussian_edge(12e-6)(distance), 0.05)
    assert "bent" in doubts(bent)
    short = an_image(5.0, position=100e-6)
    assert "Only" in doubts(short)
    sharp = an_image(5.0, gaussian_edge(0.5e-6))
    assert "hardly seen" in doubts(sharp)


def test_clipped_sides_are_left_out_and_seen_without_a_flag():
    bright, dark = an_image(saturation=6.0), an_image()
    hidden = replace(bright, saturated=np.zeros_like(bright.saturated))
    below = replace(dark, below=dark.radiance < 2.5)
    for image, text in ((hidden, "saturated"), (below, "below the camera's lower range limit")):
        found = knife_edge([image])
        assert any(text in warning for warning in found.notes.warnings)
        assert abs(found.fwhm - FWHM) < 3 * found.edge_uncertainty


def test_dead_pixels_change_nothing_flagged_or_not(clean):
    image = an_image()
    radiance = image.radiance.copy()
    radiance[[3, 17, 30], [8, 20, 35]] = 60.0, 0.0, -40.0
    found = knife_edge([replace(image, radiance=radiance)])
    assert any("3 pixels far from the others" in warning for warning in found.notes.warnings)
    # Three pixels of 1600 are missing: 1/30 measured.
    assert found.fwhm == pytest.approx(clean.fwhm, abs=clean.edge_uncertainty / 8)
    dead = np.zeros_like(image.dead)
    dead[[3, 17, 30], [8, 20, 35]] = True
    flagged = knife_edge([replace(image, radiance=radiance, dead=dead)])
    assert flagged.notes.warnings == []


def test_models_are_weighed_and_named(clean):
    assert sum(clean.weights) == pytest.approx(1.0)
    # Moffat's function of a large exponent is nearly a Gaussian.
    assert clean.weights[0] > 0.75
    assert [fit.bic for fit in clean.fits] == sorted(fit.bic for fit in clean.fits)
    assert clean.edge_uncertainty >= clean.best.fwhm_uncertainty
    # The tail takes part of the noise: 0.8 % measured.
    assert clean.psf(model="gaussian with tail").fwhm == pytest.approx(FWHM, rel=0.03)
    assert all(isinstance(fit.model, PSFModel) for fit in clean.fits)


def test_a_measurement_becomes_an_image():
    radiance = edge_radiance(GAUSSIAN, 5.0, background=500.0, step=2000.0)
    flags = np.zeros((1, *radiance.shape), np.uint8)
    flags[0, 0, :3] = Flag.DEAD, Flag.SATURATED, Flag.REPLACED
    measurement = measurement_of(radiance, flags)
    image = edge_image(measurement, "m", (slice(0, 20), slice(0, 30)))
    assert image.radiance.shape == (20, 30)
    assert np.flatnonzero(~image.usable.ravel()).tolist() == [0, 1, 2]
    assert image.wavelength == pytest.approx(WAVELENGTH)
    assert image.footprint == pytest.approx(PITCH)
    assert any("fill factor 1" in note for note in image.notes.assumed)
    measurement.data.attrs |= {"fill_factor": 0.81, "psf_order": "detector"}
    measurement.data.attrs |= {"assumed": "No pixel is saturated.", "warnings": "A few are old."}
    told = edge_image(measurement, "m")
    assert told.notes.warnings == ["A few are old."]
    assert told.footprint == pytest.approx(0.9 * PITCH)
    assert told.notes.assumed[0] == "No pixel is saturated."
    assert "acts twice" in told.notes.assumed[1]


@pytest.mark.slow
def test_symmetric_edges_are_not_called_curved_and_a_known_curve_is():
    """Of 30 standard normal numbers, one is beyond 4 with a probability of 0.2 %."""
    edges = [GAUSSIAN, tailed_edge(8e-6, 0.2, 20e-6), disc_edge(12e-6)]
    scores = []
    for seed in range(10):
        for edge in edges:
            found = knife_edge([an_image(3.0 + seed, edge, 0.05, seed)])
            scores.append(_asymmetry(found))
    z = [one.value / one.standard_uncertainty for one in scores]
    assert max(map(abs, z)) < 4  # four standard deviations of all scores; 2.2 measured
    assert np.std(z) < 1.3  # 0.93 measured; it scatters by 1 / sqrt(2 n)
    assert not any(one.is_clear for one in scores)
    # E + q 4 E (1 − E): the curve is in part a shift of the edge, which takes away some of q.
    fraction = edge_radiance(GAUSSIAN, 5.0, background=0.0, step=1.0)
    curved = image_of(2.0 + 5.0 * (fraction + 0.1 * 4 * fraction * (1 - fraction)), 0.01)
    found = _asymmetry(knife_edge([curved]))
    assert found.is_clear
    assert found.value == pytest.approx(0.1, rel=0.25)  # the shift takes that away: 0.0175 measured


def _asymmetry(found):
    response = found.best.response(0, found.edges[0].pixels)
    return asymmetry(found.edges[0].curves, response, response.slope, found.edges[0].line_fwhm)


def test_tails_of_a_model_that_does_not_fit_do_not_stop_the_kernel():
    """A gamma leaves all models alike; the exponential tail of one reaches over 3.4 mm."""
    radiance = edge_radiance(gaussian_edge(12e-6), 5.0, 48, background=0.1, step=0.8)
    found = knife_edge([image_of(np.round(255 * radiance ** (1 / 2.2)))])
    assert found.unexplained
    kernel = psf_kernel(found)
    assert kernel.weights.sum() == pytest.approx(1.0)
    assert {part.cause.name for part in kernel.components} >= {"psf fit", "psf model"}


def test_a_width_on_a_node_of_its_table_is_found():
    """A tail of no light: the width is 50 of the table's steps, but for rounding."""
    model = GaussianTailModel()
    for fwhm in np.linspace(8e-6, 16e-6, 200):
        # The width is solved for.
        assert model.fwhm(np.array([fwhm, 0.0, 0.72])) == pytest.approx(fwhm, rel=1e-9)


def test_a_knife_edge_is_drawn_as_a_figure_and_shown_as_a_table(clean):
    titles = [axes.get_title(loc="left") for axes in clean.plot().axes]
    assert {"edge-spread function", "line-spread function", "modulation transfer function"} <= set(
        titles
    )
    columns, rows, sentences = in_a_notebook(clean)
    assert columns[:2] == ["model", "fwhm_um"]
    assert rows[0][:2] == [clean.best.model.name, f"{1e6 * clean.fwhm:.6g}"]
    assert sentences == [*clean.notes.warnings, *clean.notes.assumed]
