"""Uncertainty budgets: closed forms, the paper's figure, the whole analysis, and the command."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from analytic_chip import AnalyticChip
from command import chipglow, refused
from drawn import in_a_notebook
from figure6 import figure_6
from GTC import multiple_ureal, set_correlation, ureal
from scipy import stats
from scipy.special import ndtr
from tolerances import DOUBLE

from chipglow.analysis import Plan, SingleReadings, analyse
from chipglow.analysis.single import ACROSS, DOWN, MEASURED, REFERENCE
from chipglow.camera import Camera, GaussianPSF
from chipglow.io import write_measurement, write_scene
from chipglow.quantities import changed
from chipglow.radiometry import Band
from chipglow.scene import Raster, Scene
from chipglow.study import Study, load_study, study_budget
from chipglow.surface import CHIP_1, CHIP_2, UniformSurface
from chipglow.uncertainty import Input, Inputs, budget, first_order
from chipglow.uncertainty.budget import VALIDATED, _sobol
from chipglow.uncertainty.surrogate import Surrogate

GENERATOR = 1995

HOT, COLD, EMISSIVITY, FWHM = 1000.0, 600.0, 0.6, 12e-6


def computed(model, inputs, correlations=(), **options):
    generator = np.random.default_rng(GENERATOR)
    return budget(model, Inputs(inputs, correlations), generator, **options)


def test_sobol_indices_of_ishigamis_function():
    # Ishigami and Homma (1990): a = 7, b = 0.1.
    inputs = [Input(name, 0.0, np.pi / np.sqrt(3.0), "rectangular") for name in "xyz"]

    def model(rows):
        x, y, z = rows.T
        return (np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x))[:, None]

    found = computed(model, inputs, samples=2**15).indices
    # The error of as many independent samples; quasi-random ones are nearer.
    tolerance = 1 / np.sqrt(2**15)
    np.testing.assert_allclose(found.first_order[0], [0.3139, 0.4424, 0.0], atol=tolerance)
    np.testing.assert_allclose(found.total_order[0], [0.5576, 0.4424, 0.2437], atol=tolerance)
    assert (found.total_order_low < found.total_order_high).all()


def test_a_correlated_linear_model_is_exact():
    inputs = [
        Input("a", 1.0, 2.0, "normal", group="both"),
        Input("b", 3.0, 0.5, "rectangular"),
        Input("c", -1.0, 1.0, "normal", 8.0, group="both"),
    ]
    slopes = np.array([1.0, 4.0, -2.0])
    found = computed(lambda rows: rows @ slopes[:, None], inputs, [("a", "c", 0.6)])
    estimate = found.estimate
    # JCGM 100:2008, 5.2.2.
    both = 2.0**2 + 2.0**2 - 2 * 0.6 * 2.0 * 2.0
    a, c = multiple_ureal([1.0, -1.0], [2.0, 1.0], np.inf)
    set_correlation(0.6, a, c)
    peer = a + 4.0 * ureal(3.0, 0.5) - 2.0 * c
    assert estimate.values == pytest.approx(peer.x)
    assert estimate.standard_uncertainty == pytest.approx(peer.u)
    np.testing.assert_allclose(found.sensitivity[:, 0], slopes)
    np.testing.assert_allclose(estimate.values, 1.0 + 12.0 + 2.0)
    np.testing.assert_allclose(estimate.standard_uncertainty, np.sqrt(both + 2.0**2))
    assert set(estimate.names) == {"a, c", "b"}
    np.testing.assert_allclose(estimate.contribution("a, c"), np.sqrt(both))
    assert found.indices.group.values.tolist() == ["both", "b"]
    # 3 standard deviations of an index of 256 samples, by the bootstrap's own interval.
    spread = found.indices.total_order_high - found.indices.total_order_low
    np.testing.assert_array_less(abs(found.indices.total_order[0] - [0.44, 0.56]), 1.5 * spread[0])


@pytest.mark.parametrize(
    ("distribution", "freedoms", "peer"),
    [
        ("normal", np.inf, stats.norm()),
        ("normal", 4.0, stats.t(4)),
        ("rectangular", np.inf, stats.uniform(-np.sqrt(3), 2 * np.sqrt(3))),
        ("triangular", np.inf, stats.triang(0.5, -np.sqrt(6), 2 * np.sqrt(6))),
        ("arcsine", np.inf, stats.arcsine(-np.sqrt(2), 2 * np.sqrt(2))),
    ],
)
def test_quantiles_of_the_distributions(distribution, freedoms, peer):
    numbers = np.linspace(0.01, 0.99, 99)
    one = Input("a", 5.0, 0.5, distribution, freedoms)
    np.testing.assert_allclose(one.at(numbers), 5.0 + 0.5 * peer.ppf(numbers), rtol=DOUBLE)


def test_random_and_discrete_inputs_count_by_their_scatter():
    inputs = [
        Input("phase"),
        Input("lens", 2.0, np.std([1.0, 2.0, 3.0]), "discrete", values=(1.0, 2.0, 3.0)),
    ]
    found = computed(lambda rows: rows @ [[12.0], [1.0]], inputs)
    assert np.isnan(found.sensitivity).all()
    # 448 degrees of freedom: 3 standard deviations of 1 / sqrt(2 * 448).
    np.testing.assert_allclose(found.estimate.standard_uncertainty, np.sqrt(12 + 2 / 3), rtol=0.1)
    # The same.
    np.testing.assert_allclose(found.estimate.contribution("phase"), np.sqrt(12.0), rtol=0.1)
    # Half the mean square of 64 differences: 1/sqrt(64) of the variance at worst.
    np.testing.assert_allclose(found.estimate.contribution("lens"), np.sqrt(2 / 3), rtol=0.3)


def test_interacting_inputs_count_once_and_their_scatter_is_in_the_degrees_of_freedom():
    """Variances in closed form; the scatter of u over 100 seeds is what the freedoms state."""
    random = [Input("a"), Input("b"), Input("c")]
    mixed = [Input("a", 0.0, 1.0, "normal"), Input("b"), Input("c")]
    for inputs, model, variance in (
        # A product of two centred uniform numbers, and a third.
        (random, lambda a, b, c: (a - 0.5) * (b - 0.5), 1 / 144),
        (random, lambda a, b, c: (a - 0.5) * (b - 0.5) + c / 6, 1 / 144 + 1 / 432),
        # A random slope of a normal input: E[b²] Var a.
        (mixed, lambda a, b, c: a * b, 1 / 3),
        (mixed, lambda a, b, c: 2.0 * a + b + c, 4.0 + 2 / 12),
    ):
        found = [
            first_order(
                lambda rows, model=model: model(*rows.T)[:, None],
                Inputs(inputs),
                np.random.default_rng(seed),
            )[0]
            for seed in range(100)
        ]
        sizes = np.array([float(one.standard_uncertainty[0]) for one in found]) / np.sqrt(variance)
        scatter = 1 / np.sqrt(2 * found[0].degrees_of_freedom[0])
        # The mean of 100 has a tenth of the scatter; 4 standard deviations of both.
        assert abs(sizes.mean() - 1) < 4 * scatter / 10
        # Freedoms of a product's heavier tails are overstated, of a uniform number understated.
        assert sizes.std() < scatter * (1 + 4 / np.sqrt(200)) * 1.3


@pytest.mark.parametrize("uncertainty", [9.9, 10.0, 19.0, 99.0, 100.0])
@pytest.mark.parametrize(("distribution", "agrees"), [("normal", True), ("rectangular", False)])
def test_the_verdict_on_the_gum_does_not_depend_on_the_size_of_u(uncertainty, distribution, agrees):
    # The GUM's ends are beyond those of a rectangular distribution by 0.315 u.
    found = computed(lambda rows: rows, [Input("a", 0.0, uncertainty, distribution)], samples=2)
    assert found.monte_carlo.is_stable.all()
    assert found.monte_carlo.validates(found.estimate, VALIDATED) == [agrees]


def test_one_reading_and_one_group():
    found = computed(lambda rows: rows, [Input("a", 0.0, 1.0, "normal")], samples=256)
    assert found.indices.total_order.shape == (1, 1)
    # 256 points of a Sobol sequence: about 1 % of the variance.
    assert found.indices.total_order.item() == pytest.approx(1.0, abs=0.03)


def test_indices_are_those_of_scipy():
    generator = np.random.default_rng(GENERATOR)
    results = generator.standard_normal((5, 2, 64))  # (function, output, sample)
    functions = {"f_A": results[0], "f_B": results[1], "f_AB": results[2:]}
    peer = stats.sobol_indices(func=functions, n=64)
    np.testing.assert_allclose(_sobol(results), [peer.first_order, peer.total_order], rtol=DOUBLE)


def test_without_a_variance_there_are_no_indices():
    inputs = [Input("a", 0.0, 1.0, "normal", 1.5), Input("b", 0.0, 1.0, "rectangular")]
    found = computed(lambda rows: rows @ [[1.0], [2.0]], inputs, samples=16)
    assert np.isnan(found.indices.first_order).all() and np.isnan(found.indices.total_order).all()
    assert np.isfinite(found.monte_carlo.low).all()
    assert found.estimate.standard_uncertainty == pytest.approx(np.sqrt(5.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"distribution": "lognormal"},
            "a: distribution: 'lognormal', expected one of normal, rec",
        ),
        ({"standard_uncertainty": -0.5}, "a: standard_uncertainty: -0.5, expected more than 0"),
        ({"standard_uncertainty": np.inf}, "a: standard_uncertainty: inf, expected more than 0"),
        ({"value": np.nan}, "a: value: nan, expected a number"),
        ({"value": 1.1, "high": 1.0}, "a: value: 1.1, expected a number from -inf to 1"),
        ({"degrees_of_freedom": 0.0}, "a: degrees_of_freedom: 0.0, expected more than 0"),
        (
            {"distribution": "rectangular", "degrees_of_freedom": 3.0},
            "3 of a rectangular distribution, expected a normal one",
        ),
        ({"distribution": "discrete", "values": (1.0,)}, r"values: \[1.0\], expected 2 or more"),
        (
            {"value": 0.5, "standard_uncertainty": 2.0, "low": 0.0, "high": 1.0},
            r"a: 80 % of its distribution is impossible \(below 0 or above 1\), expected half",
        ),
    ],
)
def test_impossible_distributions_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        Input(
            "a", **{"value": 0.0, "standard_uncertainty": 1.0, "distribution": "normal"} | options
        )


@pytest.mark.parametrize(
    ("distribution", "freedoms", "peer"),
    [
        ("normal", np.inf, stats.norm()),
        ("normal", 3.0, stats.t(3)),
        ("rectangular", np.inf, stats.uniform(-np.sqrt(3), 2 * np.sqrt(3))),
        ("triangular", np.inf, stats.triang(0.5, -np.sqrt(6), 2 * np.sqrt(6))),
        ("arcsine", np.inf, stats.arcsine(-np.sqrt(2), 2 * np.sqrt(2))),
    ],
)
def test_limits_truncate_the_distribution(distribution, freedoms, peer):
    one = Input("a", 0.98, 0.05, distribution, freedoms, low=0.9, high=1.0)
    below, above = peer.cdf(-1.6), peer.sf(0.4)
    assert one.outside == pytest.approx((below, above))
    numbers = np.linspace(0.0, 1.0, 101)
    values = one.at(numbers)
    assert values.min() >= 0.9 and values.max() <= 1.0  # the stated limits
    inside = peer.ppf(below + (1 - below - above) * numbers[1:-1])
    np.testing.assert_allclose(values[1:-1], 0.98 + 0.05 * inside, rtol=DOUBLE)
    assert all(0.9 < end < 1.0 for end in one.one_apart)
    far = Input("a", 0.98, 0.05, distribution, freedoms, low=-1e9, high=1e9)
    assert far.one_apart == pytest.approx((0.93, 1.03))


@pytest.mark.parametrize(
    ("correlations", "message"),
    [
        ([("a", "b", 0.5)], "a is in the group 'a', b in 'b'; both must be in the same group"),
        ([("a", "z", 0.5)], "'z' is not a continuous input"),
        ([("c", "e", 0.5)], "'e' is not a continuous input"),
        ([("c", "c", 0.25)], "c with itself, expected two inputs"),
        ([("c", "d", 0.5), ("d", "c", -0.5)], "d and c are stated twice, expected once"),
        ([("c", "d", 0.5), ("c", "d", 0.5)], "c and d are stated twice, expected once"),
        ([("c", "d", 1.01)], "1.01 of c and d, expected a number from -1 to 1"),
        ([("c", "d", np.nan)], "nan of c and d, expected a number from -1 to 1"),
        (
            [("c", "d", 0.9), ("d", "f", 0.9), ("c", "f", -0.9)],
            "contradict each other, expected a positive semidefinite matrix",
        ),
    ],
)
def test_impossible_correlations_are_refused(correlations, message):
    parts = [
        Input(name, 0.0, 1.0, "normal", group=group)
        for name, group in zip("abcdf", "abccc", strict=True)
    ]
    parts.append(Input("e", 0.0, 1.0, "discrete", values=(0.0, 1.0), group="c"))
    with pytest.raises(ValueError, match=message):
        Inputs(parts, correlations)


@pytest.mark.parametrize("correlation", [1.0, -1.0, 0.999999999])
def test_complete_correlation_is_possible(correlation):
    inputs = [Input("a", 1.0, 2.0, "normal", group="g"), Input("b", 3.0, 0.5, "normal", group="g")]
    inputs.append(Input("c", 0.0, 1.0, "normal", group="g"))
    found = computed(lambda rows: rows.sum(axis=1)[:, None], inputs, [("a", "b", correlation)])
    a, b = multiple_ureal([1.0, 3.0], [2.0, 0.5], np.inf)
    set_correlation(correlation, a, b)
    peer = a + b + ureal(0.0, 1.0)
    assert found.estimate.standard_uncertainty == pytest.approx(peer.u, rel=DOUBLE)
    generator = np.random.default_rng(GENERATOR)
    rows = Inputs(inputs, [("a", "b", correlation)]).at(generator.random((1000, 3)))
    drawn = np.corrcoef(rows.T)
    # The factor of a singular matrix is rounded by √1e-16.
    assert drawn[0, 1] == pytest.approx(correlation, abs=1e-8)
    assert abs(drawn[0, 2]) < 4 / np.sqrt(1000)  # 4 standard deviations of a correlation of 0


def test_the_surrogate_is_the_simplest_that_predicts():
    generator = np.random.default_rng(GENERATOR)
    points = generator.standard_normal((16, 2))
    x, y = points.T
    terms = np.column_stack([np.ones(16), x, y, x**2, y**2, x * y])
    noise = generator.standard_normal(16)
    noise -= terms @ np.linalg.lstsq(terms, noise)[0]  # no polynomial predicts the rest
    constant = Surrogate.fit(points, 3.0 + noise)
    assert constant.form == "constant"
    # The mean of the others is off by n / (n - 1) of each point's own residual.
    assert constant.error == pytest.approx(16 / 15 * np.sqrt(np.mean(noise**2)))
    plane = Surrogate.fit(points, points @ [2.0, -10.0] + 1.0 + 0.1 * noise)
    assert plane.form == "plane"
    np.testing.assert_allclose(plane.at(np.eye(2)), [3.0, -9.0])
    exact = Surrogate.fit(points, points[:, 0] * points[:, 1] * 5.0)
    assert exact.form == "quadratic" and exact.error < 1e-9


def test_windows_read_what_the_whole_analysis_reads():
    scene = AnalyticChip(frames=60).scene()
    surfaces = {"chip 1": CHIP_1, "chip 2": CHIP_2}
    camera = Camera.paper()
    plan = Plan(exposures=3, phases=2, textures=2, psf_widths=(8e-6,))
    readings = SingleReadings(scene, surfaces, camera, plan)
    data = analyse(scene, surfaces, camera, plan).data
    assert readings.names == tuple(data.reading.values)
    for phase in range(4):
        read = readings.read(camera, surfaces, {ACROSS: phase % 2 / 2, DOWN: phase // 2 / 2})
        whole = data.isel(exposure=0, texture=0, pixel_phase=phase)
        # Rounding in K.
        np.testing.assert_allclose(read[:, REFERENCE], whole.reference, atol=1e-10)
        # The light from beyond the window is interpolated between pixels: seen 3 mK.
        np.testing.assert_allclose(read[:, MEASURED], whole.measured.sel(effects="all"), atol=0.02)


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """A uniform plate at 900 K."""
    raster = Raster(left=-40e-6, top=40e-6, spacing=1e-6, rows=80, columns=80)
    path = tmp_path_factory.mktemp("plate") / "plate.nc"
    temperature = np.full((1, *raster.shape), 900.0)
    write_scene(Scene.from_fields(raster, [0.0], {"temperature": temperature}), path)
    return path


def study_of(plate, **inputs):
    return Study(
        scene=str(plate),
        surface={"kind": "uniform", "emissivity": 0.6},
        camera={"psf": {"kind": "gaussian", "fwhm": "8 um"}, "lower_limit": None},
        analysis={"reference": "true-maximum", "points": {"middle": ("0 um", "0 um")}},
        uncertainty={"inputs": inputs},
    )


def test_the_budget_of_a_plate_is_the_closed_form(plate, few_draws):
    study = study_of(
        plate,
        **{
            "surface.emissivity": {"standard": "2 %", "degrees_of_freedom": 9.0},
            "camera.pitch": {"half_width": "0.1 um", "source": "grid"},
        },
    )
    found = study_budget(study, ("middle",), trials=100, samples=8)
    band = Band(*study.camera.band)
    temperature = band.temperature(0.6 * band.radiance(900.0))
    slope = band.radiance(900.0) / band.slope(temperature)  # of Equation 3, by the emissivity
    assert found.readings == ("middle, pixel",)
    row = found.summary().iloc[0]
    # The table of the radiance and its inverse: 6e-6 K measured.
    assert row.error_K == pytest.approx(temperature - 900.0, abs=1e-4)
    # The difference over 2 % to both sides is exact to second order: 6e-5 measured.
    assert row.standard_uncertainty_K == pytest.approx(0.02 * 0.6 * slope, rel=5e-4)
    assert row.degrees_of_freedom == pytest.approx(9.0, rel=1e-12)  # of the only input
    assert row.validated == "undecided"  # 100 trials are too few for the ends of a Student's t
    frame = found.to_frame().set_index("input")
    # Rounding of a sum of squares.
    assert frame.loc["surface.emissivity"].variance_percent == pytest.approx(100.0, abs=1e-9)
    assert frame.loc["camera.pitch"].source == "grid"
    assert frame.loc["camera.pitch"].standard_uncertainty == pytest.approx(0.1e-6 / np.sqrt(3.0))


def test_intervals_hold_the_truth_of_the_literal_figure_6(plate, few_draws):
    # 200 experiments with hidden emissivities and PSF widths, seen by the paper's Figure 6.
    raster, band = Raster(-45e-6, 45e-6, 1e-6, 90, 90), Band(3.8e-6, 5.1e-6)
    x = np.broadcast_to(raster.x, raster.shape)
    temperature = 900.0 + 300.0 * np.exp(-((x / 12e-6) ** 2))
    path = plate.with_name("ridge.nc")
    write_scene(Scene.from_fields(raster, [0.0], {"temperature": temperature[None]}), path)
    study = replace(
        study_of(
            path,
            **{
                "surface.emissivity": {"standard": 0.03},
                "camera.psf.fwhm": {"half_width": "2 um"},
            },
        ),
        camera={
            "pitch": "9 um", "psf": {"kind": "gaussian", "fwhm": "14 um"},
            "psf_order": "detector", "lower_limit": None,
        },
    )  # fmt: skip
    # The camera's pixels have the corner of the scene in both.
    readings = study_budget(study, ("middle",), trials=500, samples=2)
    generator = np.random.default_rng(GENERATOR)
    low, high = readings.budget.monte_carlo.low[0], readings.budget.monte_carlo.high[0]
    held = 0
    for emissivity, width, (right, down) in zip(
        generator.normal(0.6, 0.03, 200),
        generator.uniform(12e-6, 16e-6, 200),
        generator.integers(9, size=(200, 2)),
        strict=True,
    ):
        part = (slice(down, down + 81), slice(right, right + 81))
        kernel = GaussianPSF(width).kernel(9e-6)
        seen = figure_6(
            [temperature[part]], [np.full((81, 81), emissivity)], band.radiance,
            band.temperature, kernel,
        )  # fmt: skip
        row, column = (int((45 - corner) // 9) for corner in (down, right))
        truth = temperature[part][9 * row : 9 * row + 9, 9 * column : 9 * column + 9].max()
        held += low <= seen[row, column] - truth <= high
    # 95 % of 200, of which the standard deviation is 1.5 %; the ends of 500 trials add 1 %.
    assert 0.92 <= held / 200 <= 0.98


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"title": {"standard": 1.0}}, "'title', expected a path in camera, surface, cutting"),
        ({"camera.pich": {"standard": "1 um"}}, "camera.pich: no such setting"),
        ({"camera.pitch": {"standard": 0.5}}, "camera.pitch: 0.5 has no unit, expected a length"),
        ({"camera.pitch": {"standard": "-1 um"}}, "camera.pitch: '-1 um', expected more than 0"),
        ({"camera.psf_order": {"standard": 1.0}}, "is 'detector', expected a number"),
        (
            {"surface.emissivity": {"standard": 0.8}},
            r"54 % .* is impossible \(below 0 or above 1\)",
        ),
        (
            {"camera.integration_time": {"standard": "1 ms"}},
            "a draw is impossible: camera.* s is longer than the frame period",
        ),
        ({"camera.lower_limit": {"standard": "2 %"}}, "'2 %' of a temperature depends on its unit"),
        ({"camera.lower_limit": {"half_width": "2 %"}}, "expected a difference such as 2 K"),
        ({"camera.pitch": {"standard": "2,5 %"}}, "'2,5 %', expected a percentage such as 3 %"),
        ({"surface.emissivity": {"standard": "2 um"}}, "'2 um', expected a number without a unit"),
        (
            {"surface.emissivity": {"half_width": 0.1, "degrees_of_freedom": 3.0}},
            "degrees_of_freedom: requires a standard uncertainty that is normal",
        ),
        ({"camera.pitch": {}}, "must have one of standard, half_width and values"),
        ({"cutting.feed": {"standard": "1 um"}}, "the scene is a file, expected a study that cuts"),
    ],
)
def test_impossible_inputs_are_refused(plate, inputs, message):
    study = study_of(plate)
    if "camera.lower_limit" in inputs:  # by default it has none
        study = changed(study, {"camera.lower_limit": "500 degC"})
    with pytest.raises(ValueError, match=message):
        study_budget(changed(study, {"uncertainty": {"inputs": inputs}}))


def test_an_unknown_place_is_refused(plate):
    with pytest.raises(
        ValueError, match=r"edge: no such place or reading, expected one of .*middle"
    ):
        study_budget(study_of(plate, **{"camera.pitch": {"standard": "1 um"}}), ("edge",))


def test_settings_of_the_cut_act_by_a_surrogate(plate, few_draws, monkeypatch):
    """Scenes of the cut are plates, hotter with the friction; the emissivity is known."""
    made = {}

    def cut(study, *options):
        friction = study.cutting.friction.coefficient
        path = plate.with_name(f"plate-{friction}.nc")
        raster = Raster(left=-40e-6, top=40e-6, spacing=1e-6, rows=80, columns=80)
        temperature = np.full((1, *raster.shape), 900.0 + 400.0 * (friction - 0.5))
        if len(made) == 5:  # of too few pixels for the point
            raster = Raster(left=-40e-6, top=40e-6, spacing=1e-6, rows=20, columns=80)
            temperature = temperature[:, :20]
        write_scene(Scene.from_fields(raster, [0.0], {"temperature": temperature}), path)
        made[friction] = path
        return path

    for room in ("budgets", "running"):
        monkeypatch.setattr(f"chipglow.study.{room}.cut", cut)
    study = Study(
        surface={"kind": "uniform", "emissivity": 0.6},
        camera={"psf": {"kind": "gaussian", "fwhm": "8 um"}, "lower_limit": None},
        analysis={"reference": "true-maximum", "points": {"middle": ("0 um", "0 um")}},
        uncertainty={"inputs": {"cutting.friction.coefficient": {"standard": 0.05}}},
    )
    found = study_budget(study, ("middle",), trials=100, samples=2, scenes=12)
    assert len(made) == 13
    assert any("1 of 12 scenes show no shear band" in text for text in found.notes.warnings)
    one = found.surrogates["middle, pixel"]
    band = Band(*study.camera.band)

    def error(temperature):
        return band.temperature(0.6 * band.radiance(temperature)) - temperature

    # One standard uncertainty of the friction is 20 K.
    ends = np.array([error(880.0), error(920.0)])
    # Between its points the surrogate is off by 0.0005 K.
    np.testing.assert_allclose(one.at(np.array([[-1.0], [1.0]])), ends, atol=0.002)
    assert one.error < 0.05
    frame = found.to_frame().set_index("input")
    part = frame.loc["cutting.friction.coefficient"]
    # The surrogate, as above.
    assert part.contribution_K == pytest.approx(abs(ends[1] - ends[0]) / 2, abs=0.002)
    assert part.group == "scene" and part.variance_percent > 99.0


def test_the_command_prints_and_writes_the_budget(plate, few_draws, tmp_path):
    (tmp_path / "study.yaml").write_text(
        f"""
scene: {plate}
surface: {{kind: uniform, emissivity: 0.6}}
camera: {{psf: {{kind: gaussian, fwhm: 8 um}}, lower_limit: none}}
analysis: {{reference: true-maximum, points: {{middle: [0 um, 0 um]}}}}
uncertainty:
  inputs:
    surface.emissivity: {{standard: 2 %, source: heated chips}}
""",
        encoding="utf-8",
    )
    table, picture = tmp_path / "budget.csv", tmp_path / "budget.png"
    arguments = ["budget", tmp_path / "study.yaml", "--at", "middle"]
    arguments += ["--samples", 2, "--trials", 100]
    printed = chipglow("--json", *arguments, "--out", table, "--plot", picture)
    result = json.loads(printed.stdout)
    (row,) = result["tables"]["summary"]
    # The factor 1.959964 is rounded.
    assert row["expanded_uncertainty_K"] == pytest.approx(
        1.96 * row["standard_uncertainty_K"], rel=3e-5
    )
    assert "heated chips" in table.read_text(encoding="utf-8")
    assert picture.stat().st_size > 10_000
    refused([*map(str, arguments), "--at", "edge"], "edge: no such place or reading")


def strip_radiance_temperature(band, x, fwhm):
    """Return the radiance temperature of pixels of 6 um, centred at x, on the strip."""
    within = x[:, None] + (np.arange(200) - 99.5) / 200 * 6e-6
    sigma = fwhm / np.sqrt(8 * np.log(2))
    share = (ndtr((within + 10e-6) / sigma) - ndtr((within - 10e-6) / sigma)).mean(axis=1)
    hot, cold = band.radiance(np.array([HOT, COLD]))
    return band.temperature(EMISSIVITY * (cold + (hot - cold) * share))


@pytest.fixture(scope="module")
def strip(tmp_path_factory):
    """A strip of 1000 K, 20 um wide, on 600 K, with its image and a study of it."""
    folder = tmp_path_factory.mktemp("strip")
    raster = Raster(left=-60e-6, top=60e-6, spacing=1e-6, rows=120, columns=120)
    temperature = np.where(abs(raster.x) < 10e-6, HOT, COLD) * np.ones((1, 120, 1))
    scene = Scene.from_fields(raster, [0.0], {"temperature": temperature})
    write_scene(scene, folder / "strip.nc")
    camera = Camera(psf=GaussianPSF(FWHM), lower_limit=None, offset=(2e-6, 1e-6))
    image = camera.measure(scene, UniformSurface(EMISSIVITY), 0.0)
    write_measurement(image, folder / "image.nc")
    corners = "[[-4 um, -14 um], [2 um, -14 um], [2 um, 10 um], [-4 um, 10 um]]"
    regions = f"regions: {{strip: {{polygon: {corners}}}}}"
    (folder / "regions.yaml").write_text(regions, encoding="utf-8")
    (folder / "study.yaml").write_text(
        """
scene: strip.nc
surface: {kind: uniform, emissivity: 0.6}
camera:
  psf: {kind: gaussian, fwhm: 12 um}
  psf_order: optics
  lower_limit: none
  detector:
    response: {kind: photon, quantum_efficiency: 0.8, element: 15 um, f_number: 2.5}
    full_well: 1e8
    bits: 16
    terms: [{kind: shot-noise}]
analysis:
  regions:
    strip: {polygon: [[-3 um, -12 um], [3 um, -12 um], [3 um, 12 um], [-3 um, 12 um]]}
uncertainty: {inputs: {camera.psf.fwhm: {standard: 5 %}}}
""",
        encoding="utf-8",
    )
    return folder


def test_a_measured_temperature_is_corrected_with_the_whole_budget(strip):
    arguments = [strip / "image.nc", "--regions", strip / "regions.yaml", "--emissivity", 0.6]
    arguments += ["--emissivity-uncertainty", 0.012, "--study", strip / "study.yaml"]
    printed = chipglow("--json", "temperature", *arguments, "--table", strip / "table.csv")
    tables, band = json.loads(printed.stdout)["tables"], Band(3.8e-6, 5.1e-6)
    parts = {part["input"]: part["contribution_K"] for part in tables["budget"]}
    (row,) = pd.read_csv(strip / "table.csv").itertuples()
    # The pixels of the image are at -1 um; the study does not know where, and takes every place.
    x = np.linspace(-3e-6, 3e-6, 61)
    measured = strip_radiance_temperature(band, x, FWHM)
    ideal = band.temperature(EMISSIVITY * band.radiance(HOT))
    true = band.temperature(band.radiance(measured[20]) / EMISSIVITY)
    gain = band.slope(measured[20]) / (EMISSIVITY * band.slope(true))
    wider, narrower = (strip_radiance_temperature(band, x, FWHM * f) for f in (1.05, 0.95))
    # The image is rounded to counts: 0.02 K measured.
    assert row.true_temperature_K == pytest.approx(true, abs=0.05)
    # Over the 64 draws of the position the mean differs by less than 3.2 K / sqrt(64).
    corrected = true + gain * (ideal - measured.mean())
    # That limit; 0.05 K measured.
    assert row.corrected_temperature_K == pytest.approx(corrected, abs=0.4)
    assert HOT - true > row.expanded_uncertainty_K
    assert abs(HOT - row.corrected_temperature_K) < row.corrected_expanded_uncertainty_K
    blur = gain * (narrower - wider).mean() / 2
    # The mean is over 64 positions: 0.4 % measured.
    assert parts["camera.psf.fwhm"] == pytest.approx(blur, rel=0.01)
    # From 64 pairs of draws: 1 / sqrt(64) of the variance at worst.
    assert parts["pixel position across"] == pytest.approx(gain * measured.std(), rel=0.07)
    assert parts["noise"] == 0.0  # the measurement's, not that of the study's detector
    total = np.sqrt(sum(part**2 for part in parts.values()))
    assert row.corrected_uncertainty_K == pytest.approx(total, abs=0.002)  # printed in mK


def test_a_study_of_another_measurement_is_refused(strip):
    arguments = ["temperature", strip / "image.nc", "--regions", strip / "regions.yaml"]
    arguments += ["--emissivity", 0.6, "--study", strip / "other.yaml"]
    text = (strip / "study.yaml").read_text(encoding="utf-8")
    for old, new, message in (
        ("strip: {polygon", "edge: {polygon", "strip: no such place or reading"),
        ("psf_order: optics", "band: 3.8-4.9 um", "5.1 um in the measurement, 4.9 um"),
        ("psf_order: optics", "pitch: 5 um", "pitch: 6 um in the measurement, 5"),
    ):
        (strip / "other.yaml").write_text(text.replace(old, new), encoding="utf-8")
        refused(list(map(str, arguments)), message)


def test_impossible_parts_of_distributions_and_missing_sources_are_stated(
    plate, few_draws, tmp_path
):
    (tmp_path / "study.yaml").write_text(
        f"""
scene: {plate}
surface: {{kind: uniform, emissivity: 0.98}}
camera: {{psf: none, lower_limit: none}}
analysis: {{reference: true-maximum, points: {{middle: [0 um, 0 um]}}}}
uncertainty:
  inputs:
    surface.emissivity: {{standard: 0.05}}
    camera.pitch: {{half_width: 0.1 um}}
    camera.fill_factor: {{values: [0.8, 0.9]}}
""",
        encoding="utf-8",
    )
    printed = chipglow(
        "budget", tmp_path / "study.yaml", "--at", "middle", "--samples", 2, "--trials", 100,
        "--out", tmp_path / "budget.csv",
    )  # fmt: skip
    text = (
        "surface.emissivity: the distribution is truncated, as 34 % of it is impossible (above 1)"
    )
    assert printed.output.count(text) == 1
    assert printed.output.index(text) < printed.output.index("Monte Carlo")
    frame = pd.read_csv(tmp_path / "budget.csv").set_index("input")
    assert frame.loc["surface.emissivity"].source == "not stated"
    assert frame.loc["camera.pitch"].source == frame.loc["camera.fill_factor"].source
    assert frame.loc["pixel position down"].source == "drawn at random"
    band = Band(3.8e-6, 5.1e-6)
    peer = stats.truncnorm(-0.98 / 0.05, 0.02 / 0.05, 0.98, 0.05)
    low, high = (
        band.temperature(peer.ppf(p) * band.radiance(900.0)) - 900.0 for p in (0.025, 0.975)
    )
    found = study_budget(load_study(tmp_path / "study.yaml"), ("middle",), trials=500, samples=2)
    # Ends of 500 trials: the standard deviation of the lower one is 8 % of half the interval.
    assert found.budget.monte_carlo.low[0] == pytest.approx(low, abs=0.3 * (high - low))
    # The density ends at the limit: the upper end hardly scatters; twice 0.004 of these few draws.
    assert found.budget.monte_carlo.high[0] == pytest.approx(high, abs=0.008 * (high - low))


def test_a_true_temperature_has_a_possible_emissivity(strip):
    arguments = [strip / "image.nc", "--regions", strip / "regions.yaml", "--emissivity", 0.98]
    arguments += ["--emissivity-uncertainty", 0.05, "--camera-uncertainty", "0 K"]
    printed = chipglow("--json", "temperature", *arguments)
    result = json.loads(printed.stdout)
    assert any(
        "emissivity: the distribution is truncated, as 34 % of it is impossible (above 1)" in one
        for one in result["warnings"]
    )
    (row,) = result["tables"]["regions"]
    (radiance,) = {one["radiance_temperature_K"] for one in result["tables"]["regions"]}
    # An emissivity of 1 at most: not below the radiance temperature, but for the pixels' scatter.
    scatter = 2 * row["standard_deviation_K"] / np.sqrt(row["pixels"])
    assert row["low_K"] > radiance - scatter


def test_readings_without_a_temperature_are_stated(plate, few_draws):
    study = study_of(plate, **{"surface.emissivity": {"standard": "2 %"}})
    study = changed(study, {"camera.lower_limit": "900 K"})  # 835 K are seen
    (warning,) = study_budget(study, ("middle",), 100, 2).notes.warnings
    assert warning.startswith("middle, pixel: 100 % of the pixels there are below the lower")
    small = {"hot": {"circle": {"centre": ("0 um", "0 um"), "radius": "2 um"}}}
    study = changed(study, {"camera.lower_limit": None, "analysis.regions": small})
    notes = study_budget(study, ("hot",), 100, 2).notes
    assert any("hot, mean: in some draws the place has no pixel" in one for one in notes.warnings)


def test_a_budget_is_drawn_as_a_figure_and_shown_by_its_summary(plate, few_draws):
    study = study_of(plate, **{"surface.emissivity": {"standard": "0.02"}})
    found = study_budget(study, ("middle",), trials=100, samples=8)
    (axes,) = found.plot().axes
    widths = [bar.get_width() for bar in axes.patches]
    assert widths[-1] == found.budget.estimate.standard_uncertainty[0]  # all together
    assert widths[0] == found.to_frame().contribution_K.max()
    indices = found.indices()
    assert list(indices.reading.values) == ["middle, pixel"]
    np.testing.assert_array_equal(indices.total_order, found.budget.indices.total_order)
    columns, rows, sentences = in_a_notebook(found)
    assert columns == list(found.summary().columns)
    assert rows[0][:2] == ["middle, pixel", f"{found.budget.estimate.values[0]:.6g}"]
    assert sentences == [*found.notes.warnings, *found.notes.assumed]
