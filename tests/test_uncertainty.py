"""Estimates: the GUM's own examples, exact bookkeeping of errors, draws, files, speed."""

import time
import tracemalloc

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st
from scipy.special import stdtrit
from tolerances import DOUBLE

from chipglow.uncertainty import Cause, Component, Estimate, draw, from_xarray, propagate, to_xarray

# JCGM 100:2008, annex H, as printed

NM = 1e-6
"""Nanometres in mm."""


def exact(value, name, spread, freedom=np.inf, **more):
    return Estimate(value).with_component(name, spread, degrees_of_freedom=freedom, **more)


def end_gauge():
    """H.1: the inputs of Table H.1, and the length in mm by Equation H.3."""
    standard = exact(50.000623, "calibration of the standard", 25 * NM, 18)
    difference = (
        exact(215 * NM, "repeated observations", 5.8 * NM, 24)
        .with_component("random effects of comparator", 3.9 * NM, degrees_of_freedom=5)
        .with_component("systematic effects of comparator", 6.7 * NM, degrees_of_freedom=8)
    )
    away = exact(-0.1, "mean temperature of bed", 0.2).with_component("cyclic variation", 0.35)
    expansion = exact(11.5e-6, "expansion of standard", 1.2e-6)
    of_expansion = exact(0.0, "difference of expansions", 0.58e-6, 50)
    of_temperature = exact(0.0, "difference of temperatures", 0.029, 2)
    return standard, difference, expansion, away, of_expansion, of_temperature


def length(standard, difference, expansion, away, of_expansion, of_temperature):
    return standard + difference - standard * (of_expansion * away + expansion * of_temperature)


def test_h1_the_end_gauge():
    inputs = end_gauge()
    found = length(*inputs)
    # Half of the last printed digit. So below, unless stated.
    assert found.values == pytest.approx(50.000838, abs=5e-7)
    # Half of the last printed digit.
    assert inputs[1].standard_uncertainty / NM == pytest.approx(9.7, abs=0.05)
    # Printed from the rounded 9.7 nm: 25.6; 25.4 without rounding.
    assert inputs[1].degrees_of_freedom == pytest.approx(25.6, abs=0.2)
    # Table H.1, column of |c u(x)| in nm.
    for name, expected in (
        ("calibration of the standard", 25.0),
        ("difference of expansions", 2.9),
        ("difference of temperatures", 16.6),
        ("expansion of standard", 0.0),
        ("mean temperature of bed", 0.0),
    ):
        # The difference of temperatures is printed from the rounded 0.029 °C: 16.7.
        assert found.contribution(name) / NM == pytest.approx(expected, abs=0.1)
    # Half of the last printed digit.
    assert found.standard_uncertainty / NM == pytest.approx(32, abs=0.5)
    # Printed from rounded uncertainties: 16.75 without rounding.
    assert found.degrees_of_freedom == pytest.approx(16.7, abs=0.1)
    # H.1.6: t for 99 % and 16 degrees of freedom is 2.92.
    assert np.floor(found.degrees_of_freedom) == 16
    # U is 93 nm; half of the last printed digit.
    assert stdtrit(16, 0.995) * found.standard_uncertainty / NM == pytest.approx(93, abs=0.5)
    # 16.75 degrees of freedom give 0.015 less; 0.005 is the rounding of the printed number.
    assert found.coverage_factor(0.99) == pytest.approx(2.92, abs=0.02)


VOLTS = [5.007, 4.994, 5.005, 4.990, 4.999]
AMPERES = [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3]
RADIANS = [1.0456, 1.0438, 1.0468, 1.0428, 1.0433]


def impedance(observed):
    """H.2: R, X and Z of Equation H.7 from means that were observed together."""
    volts, amperes, phase = observed
    ratio = volts / amperes
    resistance = propagate(lambda z, a: z * np.cos(a), ratio, phase)
    reactance = propagate(lambda z, a: z * np.sin(a), ratio, phase)
    return Estimate.stack([resistance, reactance, ratio])


def test_h2_resistance_and_reactance():
    observed = Estimate.from_observations(np.transpose([VOLTS, AMPERES, RADIANS]), "repeated")
    # Table H.2
    np.testing.assert_allclose(observed.values, [4.9990, 19.6610e-3, 1.04446], rtol=1e-7)
    # Printed with two digits: 0.75e-3 may be 0.745e-3.
    np.testing.assert_allclose(
        observed.standard_uncertainty, [0.0032, 0.0095e-3, 0.00075], rtol=0.016
    )
    among = observed.correlation()
    # Half of the last printed digit.
    assert among[[0, 0, 1], [1, 2, 2]] == pytest.approx([-0.36, 0.86, -0.65], abs=0.005)
    # Table H.3
    found = impedance([observed[0], observed[1], observed[2]])
    # Half of the last printed digit.
    np.testing.assert_allclose(found.values, [127.732, 219.847, 254.260], atol=5e-4)
    # Half of the last printed digit; but 0.29558 is printed as 0.295.
    np.testing.assert_allclose(found.standard_uncertainty, [0.071, 0.295, 0.236], atol=6e-4)
    among = found.correlation()
    # Half of the last printed digit.
    assert among[[0, 0, 1], [1, 2, 2]] == pytest.approx([-0.588, -0.485, 0.993], abs=5e-4)
    np.testing.assert_allclose(found.degrees_of_freedom, 4.0)


def test_a_covariance_of_values_of_very_different_sizes_is_kept():
    """A variance of 1e-24 beside one of 4e8 is below the rounding of the greater."""
    correlation = np.array([[1.0, 0.6, 0.3], [0.6, 1.0, -0.2], [0.3, -0.2, 1.0]])
    sizes = np.array([2e4, 1e-12, 1.0])
    matrix = correlation * np.outer(sizes, sizes)
    found = Estimate.from_covariance([1.0, 1.0, 1.0], matrix, "fit")
    np.testing.assert_allclose(found.covariance(), matrix, rtol=DOUBLE)
    np.testing.assert_allclose(found.correlation(), correlation, rtol=DOUBLE)


CELSIUS = [21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511]
CORRECTIONS = [
    -0.171, -0.169, -0.166, -0.159, -0.164, -0.165, -0.156, -0.157, -0.159, -0.161, -0.160,
]  # fmt: skip


def test_h3_calibration_of_a_thermometer():
    design = np.stack([np.ones(11), np.array(CELSIUS) - 20.0], axis=1)
    solve = np.linalg.pinv(design)
    residual = np.array(CORRECTIONS) - design @ (solve @ CORRECTIONS)
    scatter = np.sqrt(residual @ residual / 9)
    # Half of the last printed digit.
    assert scatter == pytest.approx(0.0035, abs=5e-5)
    observed = Estimate(CORRECTIONS).with_component(
        "scatter about the line", scatter, per_element=True, degrees_of_freedom=9
    )
    line = observed.linear(solve)
    # Half of the last printed digit of the first.
    np.testing.assert_allclose(line.values, [-0.1712, 0.00218], atol=5e-5)
    # Half of the last printed digit.
    assert line.values[1] == pytest.approx(0.00218, abs=5e-6)
    # Half of the last printed digit.
    assert line.standard_uncertainty[0] == pytest.approx(0.0029, abs=5e-5)
    # Half of the last printed digit.
    assert line.standard_uncertainty[1] == pytest.approx(0.00067, abs=5e-6)
    # Half of the last printed digit.
    assert line.correlation()[0, 1] == pytest.approx(-0.930, abs=5e-4)
    # H.3.4: the correction at 30 °C, 0.0041 with nine degrees of freedom.
    at_30 = line[0] + line[1] * 10.0
    # Half of the last printed digit.
    assert at_30.values == pytest.approx(-0.1494, abs=5e-5)
    # Half of the last printed digit.
    assert at_30.standard_uncertainty == pytest.approx(0.0041, abs=5e-5)
    assert at_30.degrees_of_freedom == pytest.approx(9.0)


# Errors that are the same, and errors that are not

ESTIMATES = st.builds(
    lambda values, spreads, fractions: (
        Estimate(values)
        .with_component("calibration", spreads, identity="camera")
        .with_component("noise", fractions, per_element=True)
        .with_component("place", fractions[0])
    ),
    *(
        st.lists(st.floats(low, 100.0), min_size=4, max_size=4).map(np.array)
        for low in (0.5, -100.0, 0.0)
    ),
)


@given(ESTIMATES)
@settings(max_examples=50)
def test_what_is_equal_has_no_difference(one):
    for difference in (one - one, one + one - 2 * one, one / one, one[::-1] - one[[3, 2, 1, 0]]):
        # Of values up to 100.
        np.testing.assert_allclose(difference.standard_uncertainty, 0.0, atol=100 * DOUBLE)
    total = one[0] + one[1] + one[2] + one[3] - one.sum()
    assert total.standard_uncertainty == pytest.approx(0.0, abs=100 * DOUBLE)  # of values up to 100


@given(ESTIMATES, st.integers(0, 1000))
@settings(max_examples=15)
def test_linear_propagation_is_that_of_draws(one, seed):
    other = Estimate([1.0, 2.0]).with_component("calibration", [-3.0, 4.0], identity="camera")
    weights = np.array([[1.0, -2.0, 0.5, 0.0], [0.0, 1.0, 1.0, 1.0]])
    drawn = draw([one, other], 20_000, np.random.default_rng(seed))
    found = one.linear(weights) - 3 * other
    shown = np.cov((drawn[0] @ weights.T - 3 * drawn[1]).T)
    scale = np.sqrt(np.outer(*2 * [np.diag(found.covariance())])) + 1e-12
    # A covariance of 20 000 draws is known to 1/√20000 = 0.7 % of its scale, at most √2 of that:
    # six standard deviations.
    assert np.abs((shown - found.covariance()) / scale).max() < 0.06


def test_only_components_of_one_name_and_identity_are_the_same():
    """Equal names are no reason to cancel: the difference of two results is uncertain."""
    for each in (False, True):
        one, two = (
            Estimate([1.0, 2.0]).with_component("drift", 3.0, per_element=each) for _ in range(2)
        )
        for found in (one + two, one - two):
            np.testing.assert_allclose(found.standard_uncertainty, 3 * 2**0.5)
            assert found.names == ("drift",)
            np.testing.assert_allclose(found.contribution("drift"), 3 * 2**0.5)
    again = Estimate(1.0).with_component("drift", 3.0, identity="day 2")
    same = Estimate(5.0).with_component("drift", 4.0, identity="day 2")
    assert (again - same).standard_uncertainty == pytest.approx(1.0)


def test_signs_decide_what_is_left():
    one = Estimate(10.0).with_component("temperature", 2.0, identity="sensor")
    other = Estimate(20.0).with_component("temperature", -1.5, identity="sensor")
    assert (one + other).standard_uncertainty == pytest.approx(0.5)
    assert (one - other).standard_uncertainty == pytest.approx(3.5)
    assert (one + other).effect("temperature") == pytest.approx(0.5)
    assert (one * other).effect("temperature") == pytest.approx(20 * 2.0 - 10 * 1.5)
    assert (one / other).effect("temperature") == pytest.approx(2 / 20 + 10 * 1.5 / 400)
    assert (4 / one).effect("temperature") == pytest.approx(-8 / 100)
    assert (1 - one**2).effect("temperature") == pytest.approx(-40)
    assert (-one).effect("temperature") == -2.0
    assert one.effect("something else") == 0.0


def test_shapes_broadcast():
    rows = Estimate(np.zeros((3, 1))).with_component("noise", 1.0, per_element=True)
    columns = Estimate(np.zeros(2)).with_component("noise", 1.0, per_element=True)
    total = (rows + columns).reshape(6)
    np.testing.assert_allclose(total.standard_uncertainty, 2**0.5)
    # Neighbours in a row share the error of the row: half of the variance.
    assert total.correlation()[0, 1] == pytest.approx(0.5)
    assert total.correlation()[0, 3] == pytest.approx(0.0)
    np.testing.assert_allclose((np.arange(3.0) + rows[:, 0]).values, np.arange(3.0))


def test_degrees_of_freedom_are_of_each_error_or_of_all():
    values = Estimate(np.zeros(10))
    more = {"per_element": True, "degrees_of_freedom": 4}
    together = values.with_component("noise", 1.0, **more).mean()
    apart = values.with_component("noise", 1.0, pooled=False, **more).mean()
    assert together.degrees_of_freedom == pytest.approx(4.0)
    assert apart.degrees_of_freedom == pytest.approx(40.0)
    # Printed with six decimals.
    assert Estimate(1.0).coverage_factor() == pytest.approx(1.959964, abs=1e-6)


def test_remarks_travel():
    one = Estimate(1.0).with_unevaluated("drift").with_warnings("The left half is hidden.")
    two = exact(2.0, "place", 0.1).with_unevaluated("drift", "noise")
    for found in (one + two, two / one, Estimate.stack([one, two]), propagate(np.hypot, one, two)):
        assert found.warnings == ("The left half is hidden.",)
        assert found.unevaluated == ("drift", "noise")
    assert np.isnan(found.contribution("drift"))
    assert found.standard_uncertainty > 0


def test_the_budget_is_a_table():
    found = length(*end_gauge()).with_unevaluated("form of the surfaces")
    table = found.budget().to_dataframe()
    assert table.fraction.sum() == pytest.approx(1.0)
    assert table.standard_uncertainty["calibration of the standard"] == pytest.approx(25 * NM)
    assert table.degrees_of_freedom["calibration of the standard"] == pytest.approx(18)
    assert np.isnan(table.standard_uncertainty["form of the surfaces"])
    several = Estimate([1.0, 2.0]).with_component("truth", [1.0, -1.0]).budget()
    assert several.standard_uncertainty.dims == ("cause", "dim_0")


def test_parts_of_a_component_share_its_degrees_of_freedom():
    """A mean of 3 with u² = 0.3² + 0.4²: one analysis of variance, two lines of the budget."""
    cause = Cause("random", "image", 2, 2, parts=("repeatability", "noise"))
    one = Estimate(3.0, (Component(cause, np.array([[0.3, 0.4]])),)).with_unevaluated("drift")
    assert one.names == ("repeatability", "noise", "drift")
    assert one.contribution("noise") == pytest.approx(0.4)
    assert one.budget().fraction.sel(cause="noise") == pytest.approx(0.64)
    assert one.degrees_of_freedom == pytest.approx(2.0)
    other = one.renamed("random", "emissivity")
    assert other.names == ("emissivity", "drift")
    assert other.contribution("emissivity") == pytest.approx(0.5)
    assert one.without("random").standard_uncertainty == 0.0
    assert (one.only("random") - one).standard_uncertainty == 0.0
    back = from_xarray(to_xarray(one.reshape(1), "t"), "t")
    assert back.names == one.names
    assert (back - one).standard_uncertainty == 0.0


# Derivatives


def test_derivatives_of_any_function():
    one = Estimate([1.0, 2.0]).with_component("truth", [1e-4, -2e-4])
    two = exact(3.0, "place", 1e-3)
    analytic = propagate(
        np.power, one, two,
        derivatives=[lambda x, p: p * x ** (p - 1), lambda x, p: x**p * np.log(x)],
    )  # fmt: skip
    found = propagate(np.power, one, two)
    # Slopes over one standard uncertainty err by its square, 1e-7.
    np.testing.assert_allclose(found.covariance(), analytic.covariance(), rtol=1e-6)
    unknown = propagate(np.add, Estimate([1.0, np.nan]), two)
    np.testing.assert_array_equal(unknown.values, [4.0, np.nan])


# Draws


def test_draws_are_those_of_the_seed():
    one = Estimate([1.0, 2.0]).with_component("noise", 0.1, per_element=True)
    two = one + exact(0.0, "gain", 0.2)
    first, second = (draw([one, two], 50, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    # What both have in common is the same in each draw.
    np.testing.assert_allclose(np.ptp(first[1] - first[0], axis=1), 0.0, atol=1e-12)


def test_of_a_part_of_an_image_only_that_is_drawn():
    image = Estimate(np.zeros((400, 500))).with_component("noise", 1.0, per_element=True)
    part = image[10, :3]
    (drawn,) = draw([part], 20_000, np.random.default_rng(4))
    expected = np.random.default_rng(4).standard_normal((20_000, 3))
    np.testing.assert_array_equal(drawn, expected)
    other, whole = draw([part, image], 2, np.random.default_rng(4))
    np.testing.assert_array_equal(whole[:, 10, :3], other)


def half_width(drawn):
    low, high = np.quantile(drawn, [0.025, 0.975])
    return (high - low) / 2


def test_draws_have_their_distribution():
    (drawn,) = draw([exact(0.0, "cause", 1.0)], 200_000, np.random.default_rng(2))
    # Five standard deviations, each 1/√(2 · 200 000) = 0.16 %.
    assert drawn.std() == pytest.approx(1.0, rel=0.008)
    # The ends of 200 000 draws are known to about 0.005.
    assert half_width(drawn) == pytest.approx(1.95996, abs=0.02)
    one = exact(0.0, "cause", 1.0, 5)
    (drawn,) = draw([one], 200_000, np.random.default_rng(2))
    # Five standard deviations: of both ends, √(0.025 · 0.975 / 200 000 / 2) over the density at
    # the end is 0.3 % of it.
    assert half_width(drawn) == pytest.approx(float(one.coverage_factor()), rel=0.016)


def test_draws_of_infinite_variance_are_made_if_asked_for():
    one = exact(0.0, "cause", 1.0, 2)
    (drawn,) = draw([one], 200_000, np.random.default_rng(2), heavy_tails=True)
    # Six standard deviations, each 0.5 % with two degrees of freedom.
    assert half_width(drawn) == pytest.approx(float(one.coverage_factor()), rel=0.03)


# Files


def read_back(estimate, tmp_path):
    to_xarray(estimate, "t", units="K").to_netcdf(tmp_path / "t.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "t.nc", engine="h5netcdf") as data:
        return from_xarray(data.load(), "t")


@given(ESTIMATES, st.booleans())
@settings(max_examples=20)
def test_files_keep_all(tmp_path_factory, one, square):
    one = one.with_component("mean", 1.0, degrees_of_freedom=3)
    one = one.with_warnings("It is far away.").with_unevaluated("drift", "noise")
    one = one + Estimate.from_observations(np.vander(np.arange(1.0, 4.0), 4), "repeated")
    one = one.reshape(2, 2) if square else one
    found = read_back(one, tmp_path_factory.mktemp("file"))
    np.testing.assert_array_equal(found.values, one.values)
    np.testing.assert_array_equal((found - one).standard_uncertainty, 0.0)
    np.testing.assert_allclose(found.degrees_of_freedom, one.degrees_of_freedom)
    assert (found.warnings, found.unevaluated) == (one.warnings, one.unevaluated)
    assert [part.cause for part in found.components] == [part.cause for part in one.components]


def test_attributes_are_those_of_obsarray():
    one = (
        Estimate(np.zeros((2, 3)))
        .with_component("calibration", -2.0)
        .with_component("noise", 0.5, per_element=True)
    )
    data = to_xarray(one, "temperature", ["y", "x"], "K")
    assert data.temperature.attrs["unc_comps"] == ["u_calibration_temperature",
                                                   "u_noise_temperature"]  # fmt: skip
    for label, form in (("calibration", "systematic"), ("noise", "random")):
        attributes = data[f"u_{label}_temperature"].attrs
        assert attributes["units"] == "K"
        assert attributes["pdf_shape"] == "gaussian"
        for number, dim in enumerate(("y", "x"), 1):
            start = f"err_corr_{number}"
            assert [attributes[f"{start}_{key}"] for key in ("dim", "form", "params", "units")] == [
                dim, form, [], [],
            ]  # fmt: skip


def test_datasets_of_obsarray_are_read():
    """Random along time, systematic along place, in per cent; and a matrix."""
    random = {"err_corr_1_dim": "time", "err_corr_1_form": "random", "units": "%"}
    mixed = random | {"err_corr_2_dim": ["x"], "err_corr_2_form": "systematic"}
    values = xr.Dataset(
        {
            "t": (("time", "x"), [[100.0, 200.0], [100.0, 100.0]], {"unc_comps": "u_t"}),
            "u_t": (("time", "x"), np.ones((2, 2)), mixed),
        }
    )
    found = from_xarray(values, "t").covariance()
    np.testing.assert_allclose(found[:2, :2], [[1.0, 2.0], [2.0, 4.0]])
    np.testing.assert_allclose(found[:2, 2:], 0.0)
    matrix = {"err_corr_1_dim": "x", "err_corr_1_form": "err_corr_matrix",
              "err_corr_1_params": ["r"]}  # fmt: skip
    values = xr.Dataset(
        {
            "t": ("x", [1.0, 2.0], {"unc_comps": ["u_t"]}),
            "u_t": ("x", [3.0, 4.0], matrix),
            "r": (("x", "x2"), [[1.0, -0.5], [-0.5, 1.0]]),
        }
    )
    np.testing.assert_allclose(from_xarray(values, "t").covariance(), [[9.0, -6.0], [-6.0, 16.0]])
    values["u_t"].attrs["err_corr_1_form"] = "ensemble"
    with pytest.raises(ValueError, match="u_t: its errors correlate as ensemble"):
        from_xarray(values, "t")
    with pytest.raises(ValueError, match="u_t is missing"):
        from_xarray(values.drop_vars("u_t"), "t")
    with pytest.raises(ValueError, match="q: there is no such variable"):
        from_xarray(values, "q")


# Speed


def test_an_image_takes_less_than_a_second_and_a_gigabyte():
    """640 × 512 pixels with 12 correlated components, through Planck's law; usually 0.2 s."""
    shape, generator = (512, 640), np.random.default_rng(0)
    tracemalloc.start()
    image = Estimate(generator.uniform(600.0, 1500.0, shape))
    for number in range(12):
        effect = generator.normal(0.0, 1.0, shape)
        image = image.with_component(f"cause {number}", effect, identity="")
    emissivity = exact(0.5, "cause 3", 0.01, identity="")

    start = time.perf_counter()
    found = propagate(lambda t, e: e / np.expm1(2877.0 / t), image, emissivity)
    spread = found.standard_uncertainty
    taken = time.perf_counter() - start
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.isfinite(spread).all()
    # The machine of the tests may be busy.
    assert taken < 1.0
    assert peak < 1e9


# What is impossible


ONE, ZEROS = Estimate([1.0, 2.0]), Estimate(np.zeros(2))
PIXELS, OTHER = (
    ZEROS.with_component("noise", 1.0, identity="", degrees_of_freedom=freedom)
    for freedom in (3, np.inf)
)
IMAGE = Estimate(np.zeros(30_000)).with_component("noise", 1.0, per_element=True)
SAME = "they must be the same errors wherever its name"


def of_covariance(matrix):
    return Estimate.from_covariance([1.0, 2.0], matrix, "noise")


REFUSED = {
    "noise: an effect is not finite": lambda: ONE.with_component("noise", [1.0, np.nan]),
    "a component occurs twice": lambda: OTHER.with_component("noise", 2.0, identity=""),
    "has effects on 3 values, expected 2": lambda: Estimate(
        ONE.values, (Component(Cause("noise"), np.ones((3, 1))),)
    ),
    r"effects have shape \(2,\)": lambda: Component(Cause("noise"), np.ones(2)),
    "its name is ' '": lambda: Cause(" "),
    "has 0 errors": lambda: Cause("noise", errors=0),
    "degrees of freedom are 0.0": lambda: Cause("noise", degrees_of_freedom=0.0),
    "has 1 parts, expected 2": lambda: Cause("random", "image", 2, 2, parts=("noise",)),
    SAME: lambda: PIXELS + OTHER,
    f"{SAME}|draw": lambda: draw([PIXELS, OTHER], 2, np.random.default_rng(1)),
    f"{SAME}|propagate": lambda: propagate(np.add, PIXELS, OTHER),
    "1 observations, expected 2 or more": lambda: Estimate.from_observations([1.0], "noise"),
    r"covariance has shape \(3, 3\), expected \(2, 2\)": lambda: of_covariance(np.eye(3)),
    "covariance is not symmetric": lambda: of_covariance([[1.0, 0.5], [0.0, 1.0]]),
    "has a variance of -1 in one direction": lambda: of_covariance([[1.0, 2.0], [2.0, 1.0]]),
    "level of confidence: is 95": lambda: ONE.coverage_factor(95),
    "t: has 2 dimensions named, expected 1": lambda: to_xarray(ONE, "t", ["y", "x"]),
    "read-only": lambda: ONE.values.__setitem__(0, 3.0),
    "derivatives: 1 of a function of 2 inputs": lambda: propagate(
        np.add, ONE, ZEROS, derivatives=[np.exp]
    ),
    "cause: draws with 2 degrees of freedom have no finite": lambda: draw(
        [exact(0.0, "cause", 1.0, 2)], 10, np.random.default_rng(2)
    ),
    r"9\.0e\+08 effects of single errors": lambda: IMAGE - IMAGE.mean(),
    "expected 1000 or fewer in a file": lambda: to_xarray(IMAGE[1:] - IMAGE[:-1], "t"),
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_impossible_is_refused(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()
