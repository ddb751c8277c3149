import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial import Delaunay

from chipglow.io.sources.meshes.triangles import NOTHING, rasterise, split_quads
from chipglow.scene import Raster

RASTER = Raster(left=-2.0, top=7.0, spacing=0.25, rows=32, columns=40)
X, Y = np.meshgrid(RASTER.x, RASTER.y)


def linear(points):
    return 300.0 + 7.0 * points[..., 0] - 3.0 * points[..., 1]


def mesh_of(seed, count, on_samples):
    """Delaunay's triangles; on_samples puts nodes and edges on the centres of samples."""
    random = np.random.default_rng(seed)
    points = random.uniform((-1.5, -0.5), (7.5, 6.5), (count, 2))
    if on_samples:
        points = np.unique(np.round(points * 4 - 0.5) / 4 + 0.125, axis=0)
    return points, Delaunay(points).simplices


meshes = st.builds(mesh_of, st.integers(0, 10**6), st.integers(8, 60), st.booleans())


def coverings(points, triangles):
    """How many triangles cover each sample, each drawn alone."""
    alone = [rasterise(RASTER, points, [triangle])[1] != NOTHING for triangle in triangles]
    return np.sum(alone, axis=0)


@settings(max_examples=40)
@given(meshes, st.integers(0, 10**6))
def test_a_linear_field_is_exact_whatever_the_triangles(mesh, seed):
    points, triangles = mesh
    turned = np.random.default_rng(seed).permuted(triangles, axis=1)
    fields, element = rasterise(RASTER, points, turned, linear(points))
    inside = element != NOTHING
    expected = linear(np.stack((X, Y), axis=-1))
    # float32 holds 24 bits: 300 to 2e-5.
    np.testing.assert_allclose(fields[0][inside], expected[inside], atol=4e-5)
    assert np.isnan(fields[0][~inside]).all()


@settings(max_examples=25)
@given(meshes)
def test_every_sample_of_the_hull_is_covered_once_and_none_outside(mesh):
    points, triangles = mesh
    counts = coverings(points, triangles)
    assert counts.max() <= 1  # covered once
    hull = Delaunay(points)
    inside = hull.find_simplex(np.stack((X - 1e-9, Y + 1e-9), axis=-1)) >= 0
    near = np.zeros_like(inside)
    for dx, dy in ((1e-6, 0), (-1e-6, 0), (0, 1e-6), (0, -1e-6)):
        near |= (hull.find_simplex(np.stack((X + dx, Y + dy), axis=-1)) >= 0) != inside
    np.testing.assert_array_equal((counts == 1)[~near], inside[~near])


def test_elements_have_their_own_value_without_blending():
    points, triangles = mesh_of(5, 30, on_samples=False)
    values = np.random.default_rng(1).uniform(0, 1, (len(triangles), 2)).astype(np.float32)
    fields, element = rasterise(RASTER, points, triangles, linear(points), values)
    inside = element != NOTHING
    assert fields.shape == (3, *RASTER.shape)
    np.testing.assert_array_equal(fields[1:, inside].T, values[element[inside]])


BAD = [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e120]


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("axis", [0, 1])
def test_a_position_that_is_none_hides_its_triangle_only(bad, axis):
    points = np.array([(0.0, 0.0), (2.0, 0.0), (0.0, 2.0), (5.0, 5.0)])
    points[3, axis] = bad
    _, element = rasterise(RASTER, points, [(0, 1, 2), (1, 3, 2), (3, 3, 3)], np.ones(4))
    assert set(np.unique(element)) == {NOTHING, 0}


def test_triangles_without_area_and_far_away_cover_nothing():
    points = np.array([(0.0, 0.0), (1.0, 1.0), (3.0, 3.0), (1e9, 0.0), (1e9, 1.0), (2e9, 0.5)])
    _, element = rasterise(RASTER, points, [(0, 1, 2), (0, 0, 1), (3, 4, 5)], np.ones(6))
    assert (element == NOTHING).all()


def test_a_triangle_much_larger_than_the_raster_fills_it():
    points = np.array([(-1e7, -1e7), (1e7, -1e7), (0.0, 1e7)])
    fields, element = rasterise(RASTER, points, [(0, 1, 2)], linear(points))
    assert (element == 0).all()
    # Weights are rounded to 1e-16, values of the nodes are 1e8.
    np.testing.assert_allclose(fields[0], linear(np.stack((X, Y), -1)), atol=1e-4)


def test_values_in_a_needle_stay_between_those_of_its_nodes():
    random = np.random.default_rng(0)
    base = random.uniform(0, 6, (500, 1, 2))
    points = (base + random.normal(0, 1, (500, 1, 2)) * [[[0.0], [1.0], [2.0]]]).reshape(-1, 2)
    points += random.normal(0, 1e-15, points.shape)
    values = random.uniform(0.0, 1.0, len(points))
    triangles = np.arange(len(points)).reshape(-1, 3)
    fields = rasterise(RASTER, points, triangles, values)[0]
    assert np.nanmin(np.append(fields, 0.5)) >= 0.0
    assert np.nanmax(np.append(fields, 0.5)) <= 1.0


def test_the_highest_triangle_is_seen():
    points = np.array([(0.0, 0.0), (6.0, 0.0), (0.0, 6.0)] * 2)
    heights = [0.0, 2.0, 0.0, 1.0, 0.0, 1.0]
    _, element = rasterise(RASTER, points, [(0, 1, 2), (3, 4, 5)], height=heights)
    inside = element != NOTHING
    first = 2.0 * X / 6.0 > 1.0 - X / 6.0
    np.testing.assert_array_equal(element[inside] == 0, first[inside])
    assert first[inside].any() and not first[inside].all()


def test_a_quad_is_split_where_it_is_shorter():
    # An arrow's head: the long diagonal runs outside.
    points = np.array([(0.0, 0.0), (4.0, 2.0), (0.0, 4.0), (1.0, 2.0)])
    counts = coverings(points, split_quads(points, np.array([(0, 1, 2, 3)])))
    assert counts.max() == 1
    # Samples on opposite borders balance: rounding.
    assert counts.sum() * RASTER.spacing**2 == pytest.approx(6.0, rel=1e-12)
