"""Emissivity by the angle: Fresnel's equations in closed form, and the slope of a chip's side."""

from math import atan, cos, degrees, pi, radians, sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad
from test_reflections import RASTER, a_scene, apparent
from tolerances import DOUBLE, SINGLE

from chipglow.surface import Fresnel, UniformSurface, Wedge

INDICES = st.floats(1.05, 30.0)


@given(INDICES, st.floats(0.0, 30.0))
def test_at_right_angles_it_is_the_known_form(n, k):
    assert Fresnel(n=n, k=k).emissivity(1.0) == pytest.approx(
        4 * n / ((n + 1) ** 2 + k**2), rel=DOUBLE
    )


@given(INDICES)
def test_at_brewsters_angle_one_polarisation_is_not_reflected(n):
    across = (n**2 - 1) / (n**2 + 1)
    found = Fresnel(n=n, k=0.0).emissivity(cos(atan(n)))
    assert found == pytest.approx(1 - across**2 / 2, rel=DOUBLE)


@given(st.floats(0.1, 30.0), st.floats(0.0, 30.0), st.floats(0.0, 1.0))
def test_it_is_an_emissivity_and_none_at_grazing(n, k, cosine):
    law = Fresnel(n=n, k=k)
    assert -1e-12 <= law.emissivity(cosine) <= 1 + 1e-12
    assert law.emissivity(0.0) == pytest.approx(0.0, abs=DOUBLE)


def test_a_good_metal_emits_four_thirds_into_the_hemisphere():
    """Over all angles ε(θ) 2 cos θ d(cos θ): 4/3 of the normal one as n = k grow."""
    ratios = []
    for n in (1e3, 1e4):
        law = Fresnel(n=n, k=n)
        # Nearly grazing, from cosines of 1/n on, it falls to 0: a place for the quadrature.
        total = quad(lambda c, law=law: 2 * c * law.ratio(c), 0, 1, points=[1 / n, 10 / n])[0]
        ratios.append(total)
    # What is missing goes as ln(n) / n: 6e-4 of it at 1e4.
    assert ratios[1] == pytest.approx(4 / 3, rel=1e-3)
    assert ratios[0] < ratios[1] < 4 / 3


def test_a_metal_grows_with_the_angle_and_an_oxide_falls():
    metal, oxide = Fresnel(n=4.6, k=15.0), Fresnel(n=2.2, k=0.2)
    at_60 = cos(radians(60.0))
    # A metal: nearly the mean of cos θ and 1/cos θ, until that is no longer small.
    assert metal.ratio(at_60) == pytest.approx((0.5 + 2.0) / 2, rel=0.05)
    assert oxide.ratio(at_60) < 1


def test_a_tilted_camera_sees_the_plane_at_that_angle():
    scene = a_scene()
    law = Fresnel(n=4.6, k=15.0, tilt=radians(60.0))
    plain, tilted = (
        surface.prepare(scene).emissivity(scene.frame(0))
        for surface in (UniformSurface(0.3), UniformSurface(0.3).modified(law))
    )
    np.testing.assert_allclose(tilted, plain * law.ratio(0.5), rtol=SINGLE)
    full = UniformSurface(0.95).modified(law).prepare(scene).emissivity(scene.frame(0))
    assert full.max() == 1.0


def test_slopes_of_the_bulge_are_those_of_its_arc():
    elements = Wedge(angle=radians(30.0)).elements
    chip = elements.chip
    # On a circle the depth from where it is flat is R sin of the slope.
    slope = np.arccos(elements.cosines[chip])
    flat = Wedge(angle=radians(30.0))
    # The first element is 0.05 degrees from its foot.
    assert degrees(slope[0]) == pytest.approx(60.0, abs=0.2)
    # Each element is straight: 2.4e-4 measured.
    np.testing.assert_allclose(
        np.sin(slope), np.cos(flat.angle) - elements.depths[chip] / flat.bulge_radius, atol=5e-4
    )


def test_the_steep_side_is_seen_at_its_angle():
    """Before dark surroundings and a cold black tool what is added is the slope's alone."""
    law = Fresnel(n=4.6, k=15.0)
    shape = Wedge(angle=radians(45.0), bulge_radius=60e-6)
    scene = a_scene(tool=300.0)
    diffuse, directional = (
        apparent(scene, bare.modified(shape))
        for bare in (UniformSurface(0.3), UniformSurface(0.3).modified(law))
    )
    gain = np.divide(directional, diffuse, out=np.ones_like(diffuse), where=diffuse > 0)
    changed = np.abs(gain - 1) > 1e-9
    assert changed.any()
    ratio = law.ratio(cos(pi / 4))
    # Kirchhoff: where more is emitted less is reflected, so the gain is under the law's own.
    assert 1.0 < gain.max() < ratio
    assert not changed[:, RASTER.x < -sqrt(0.5) * 60e-6 - RASTER.spacing].any()
