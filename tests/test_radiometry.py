"""In-band radiance against values computed with 30 digits, and its inverse."""

import csv
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from tolerances import DOUBLE, SINGLE

from chipglow.radiometry import Band, ObjectParameters, TabulatedResponse
from chipglow.radiometry.band import FIRST_RADIATION_CONSTANT, SECOND_RADIATION_CONSTANT

REFERENCE = Path(__file__).parent / "reference" / "inband_radiance.csv"
MID_WAVE = Band(3.8e-6, 5.1e-6)

CUBICS = 1.6e-10
"""Relative error of the cubics that invert the radiance: the stated bound."""


def reference_bands():
    lines = [line for line in REFERENCE.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    for limits, group in groupby(rows, key=lambda row: (row["lower_um"], row["upper_um"])):
        values = [(float(row["temperature_K"]), float(row["radiance"])) for row in group]
        yield pytest.param(limits, np.array(values), id="-".join(limits))


@pytest.mark.parametrize(("limits", "values"), list(reference_bands()))
def test_radiance_against_30_digits(limits, values):
    band = Band(float(limits[0]) * 1e-6, float(limits[1]) * 1e-6)
    temperature, radiance = values.T
    # design: under 1e-6, relative
    np.testing.assert_allclose(band.radiance(temperature), radiance, rtol=1e-6)
    np.testing.assert_allclose(band.temperature(radiance), temperature, rtol=CUBICS)


def test_table_is_as_good_as_the_integral_between_its_nodes():
    temperature = np.random.default_rng(1).uniform(250, 6000, 5000)
    exact = MID_WAVE._integrate(temperature)
    # Hermite cubics over 0.25 K: h⁴/384 (c₂/(λT²))⁴ = 1.4e-10 at 250 K and 3.8 µm.
    np.testing.assert_allclose(MID_WAVE.radiance(temperature), exact, rtol=1.4e-10)


NOTCHED = TabulatedResponse(
    (2.9e-6, 3.2e-6, 4.1e-6, 4.26e-6, 4.3e-6, 4.9e-6, 5.3e-6), (0.0, 0.8, 1.0, 0.2, 0.95, 1.0, 0.0)
)


@pytest.mark.parametrize(
    "band",
    [MID_WAVE, Band(0.9e-6, 1.7e-6), Band(7.5e-6, 14e-6), Band(2.9e-6, 5.3e-6, NOTCHED)],
    ids=["mid", "short", "long", "response"],
)
def test_the_table_of_the_inverse_is_as_good_as_newtons_method(band):
    coldest, hottest = band._integrate(np.array([200.0, 6000.0]))
    radiance = np.geomspace(coldest * (1 + 1e-12), hottest, 5003)
    exact = band._invert(radiance)
    # Newton's method and rounding leave under 1e-12.
    np.testing.assert_allclose(band.temperature(radiance), exact, rtol=CUBICS)
    single = radiance[radiance > 1e-35].astype(np.float32)
    again = band._invert(single.astype(np.float64))
    # The result in float32 is rounded by up to half a unit.
    np.testing.assert_allclose(band.temperature(single), again, rtol=2.0**-24 + CUBICS)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_an_array_may_hold_what_is_in_the_table_beyond_it_and_nothing(kind):
    temperature = np.array([[900.0, 150.0, 400.0], [8000.0, 6000.5, 199.5]])
    radiance = np.array(MID_WAVE._integrate(temperature.ravel()), kind).reshape(2, 3)
    given = np.vstack([radiance, np.array([[0.0, np.nan, -1e-3]], kind)])
    found = MID_WAVE.temperature(given[:, ::-1])[:, ::-1]
    assert found.dtype == kind
    np.testing.assert_allclose(
        found[:2], temperature, rtol=SINGLE if kind is np.float32 else CUBICS
    )
    assert np.isnan(found[2]).all()


def test_a_band_that_hardly_sees_the_cold_is_inverted_too():
    ultraviolet = Band(0.2e-6, 0.25e-6)
    temperature = np.array([300.0, 700.0, 2500.0, 5999.0])
    # That of 300 K is 8e-76 W/(m² sr), far under what the table holds.
    found = ultraviolet.temperature(ultraviolet._integrate(temperature))
    np.testing.assert_allclose(found, temperature, rtol=CUBICS)


@pytest.mark.parametrize("temperature", [60.0, 150.0, 7000.0, 20000.0])
def test_beyond_the_table_the_integral_is_used(temperature):
    radiance = MID_WAVE.radiance(temperature)
    assert radiance > 0
    assert MID_WAVE.temperature(radiance) == pytest.approx(temperature, rel=DOUBLE)


def test_float32_stays_float32_and_keeps_the_shape():
    temperature = np.linspace(300, 1500, 12, dtype=np.float32).reshape(3, 4)
    radiance = MID_WAVE.radiance(temperature)
    assert radiance.dtype == np.float32
    assert radiance.shape == (3, 4)
    # float32 has 24 bits: at 1500 K its step is 0.1 mK, and the radiance adds as much.
    np.testing.assert_allclose(MID_WAVE.temperature(radiance), temperature, atol=3e-4)


def test_what_has_no_answer_is_nan():
    assert np.isnan(MID_WAVE.radiance([0.0, -5.0, np.nan])).all()
    assert np.isnan(MID_WAVE.temperature([0.0, -1.0, np.nan, np.inf])).all()


def test_response_is_applied():
    whole = Band(3e-6, 5e-6, response=lambda w: np.where(w > 4e-6, 1.0, 0.0))
    # The step lies between two of 64 panels: rounding.
    assert whole.radiance(900.0) == pytest.approx(Band(4e-6, 5e-6).radiance(900.0), rel=DOUBLE)
    half = Band(3e-6, 5e-6, response=lambda w: np.full_like(w, 0.5))
    assert half.radiance(900.0) == pytest.approx(0.5 * Band(3e-6, 5e-6).radiance(900.0), rel=DOUBLE)


def test_wide_band_obeys_stefan_boltzmann():
    wide = Band(0.1e-6, 999e-6)
    sigma_over_pi = FIRST_RADIATION_CONSTANT * np.pi**4 / 15 / SECOND_RADIATION_CONSTANT**4
    # All but 1e-6 of the radiation of 1000 K lies in the band.
    assert wide.radiance(1000.0) == pytest.approx(sigma_over_pi * 1000.0**4, rel=2e-6)


@given(
    st.floats(400.0, 2000.0),
    st.floats(0.05, 1.0),
    st.floats(200.0, 400.0),
    st.floats(0.3, 1.0),
    st.floats(250.0, 330.0),
)
def test_object_parameters_are_taken_back(temperature, emissivity, reflected, transmittance, air):
    told = ObjectParameters(emissivity, reflected, transmittance, air)
    received = told.apparent_radiance(temperature, MID_WAVE)
    # The inverse of the band's table: 7e-11 measured.
    assert told.temperature(received, MID_WAVE) == pytest.approx(temperature, rel=1e-9)


def test_a_gray_object_without_surroundings_sends_its_share_of_a_black_body():
    told = ObjectParameters(emissivity=0.4, reflected=1.0, transmittance=0.5, atmosphere=1.0)
    assert told.apparent_radiance(800.0, MID_WAVE) == pytest.approx(0.2 * MID_WAVE.radiance(800.0))
