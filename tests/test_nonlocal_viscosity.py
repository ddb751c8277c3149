"""Nonlocal viscosity: the Gaussian mean of the strain rate, and the layer that fails."""

from dataclasses import replace
from math import exp, pi

import numpy as np
import pytest
from solver import Block

from chipglow.cutting import AISI_1045, NonlocalViscosity
from chipglow.cutting.mean_rate import average_rates

LENGTH = 20e-6


def averaged(block, rate, length=LENGTH, duration=1e-6):
    """Mean rates of a block's points that have had a rate (1/s) for a time."""
    points = block.points
    points["strain"] = points["averaged_strain"] + rate * duration
    average_rates(points, block.count, block.grid, duration, length)
    return points["mean_rate"].copy()


@pytest.mark.parametrize("cell", [30e-6, 20e-6, 7e-6])
def test_an_even_rate_is_its_own_mean_up_to_free_surfaces(cell):
    block = Block((20 * cell, 10 * cell), cell=cell)
    mean = averaged(block, 4e4)
    # Sums of products: rounding alone.
    np.testing.assert_allclose(mean, 4e4, rtol=1e-12)


def amplitude(values, x, wave):
    """Amplitude of a cosine in the middle of 640 um, beside a parabola that the ends may make."""
    place = (x - 320e-6) / 160e-6
    terms = np.stack([np.ones_like(x), place, place**2, np.cos(wave * x)], axis=-1)
    inner = np.abs(place) < 1
    return np.linalg.lstsq(terms[inner], values[inner], rcond=None)[0][3]


@pytest.mark.parametrize("waves", [1, 2])
def test_a_wave_of_the_rate_is_averaged_as_by_a_gaussian(waves):
    """Its amplitude falls by exp(−k²ℓ²/2), the better the finer the cell: to second order."""
    wavelength = 160e-6 / waves
    wave = 2 * pi / wavelength
    errors = []
    for cell in (10e-6, 5e-6):
        block = Block((640e-6, 40e-6), cell=cell)
        x = block.points["x"]
        mean = averaged(block, 1e5 * (1 + np.cos(wave * x))) / 1e5 - 1
        errors.append(amplitude(mean, x, wave) - exp(-((wave * LENGTH) ** 2) / 2))
    assert abs(errors[1]) < 0.003  # by the cell, a quarter of the width
    # Second order in the cell; 7 % measured.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_a_cell_too_coarse_for_the_length_averages_over_itself():
    block = Block((400e-6, 400e-6), cell=40e-6)
    rate = np.arange(float(block.count))
    np.testing.assert_array_equal(averaged(block, rate, 1e-6), averaged(block, rate, 20e-6))


def test_where_there_is_no_material_nothing_counts():
    """The mean at a free surface is that of the material alone: a step is seen there too."""
    block = Block((200e-6, 200e-6))
    rate = np.where(block.points["y"] > 100e-6, 1e5, 0.0)
    mean = averaged(block, rate)
    top = block.points["y"] > 195e-6
    # 95 um from the step are five lengths: the mean is the rate but for a millionth.
    np.testing.assert_allclose(mean[top], 1e5, rtol=1e-5)


def test_a_failing_layer_is_as_thick_as_the_band_if_it_has_a_width():
    local = replace(AISI_1045, nonlocal_viscosity=None)
    assert local.failing_layer(10e-6) == pytest.approx(20e-6)
    with_length = replace(AISI_1045, nonlocal_viscosity=NonlocalViscosity(1e3, 30e-6))
    assert with_length.failing_layer(10e-6) == with_length.failing_layer(5e-6) == 60e-6
