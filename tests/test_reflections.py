"""Reflections: the exchange of radiation in closed forms, and between rake face and chip's side."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from tolerances import DOUBLE

from chipglow.camera import Camera, SpectralView, expose
from chipglow.radiometry import Band
from chipglow.scene import Material, Raster, Scene, ToolGeometry
from chipglow.surface import CHIP_1, CHIP_2, EmissivityStack, Exchange, UniformSurface, Wedge

CHIP, TOOL, HOT, WARM = 0.42, 0.58, 900.0, 700.0
RIGHT = np.pi / 2


# ---- exchange


def lines(*polylines):
    """Starts and ends of the pieces of polylines."""
    lines = [np.asarray(line, float) for line in polylines]
    return np.concatenate([one[:-1] for one in lines]), np.concatenate([one[1:] for one in lines])


def groove(angle, count, grading=2.0):
    """A V-groove with walls of unit length; elements from one far end to the other."""
    part = np.linspace(0, 1, count + 1) ** grading
    left = np.outer(part[::-1], [np.cos(angle), np.sin(angle)])
    return lines(left, np.outer(part, [1.0, 0.0]))


def view_factors(exchange):
    """Fraction of each black element's radiation that first meets each other one, and none."""
    count = len(exchange.lengths)
    factors = exchange.incident(np.eye(count), 1.0).T
    open_sky = exchange.incident(np.zeros(count), 1.0, surroundings=1.0)
    return np.column_stack([factors, open_sky])


def circle(radius, count, inward):
    """A polygon about the origin that sees what is within it, or outside."""
    turn = np.linspace(0, 2 * np.pi, count + 1) * (1 if inward else -1)
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


@pytest.mark.parametrize("angle", [30.0, 45.0, 90.0, 150.0])
def test_view_factor_of_a_groove(angle):
    # Crossed strings: F = 1 - sin(angle / 2) from wall to wall of equal width. Of 2048 rays that
    # are spread evenly some 1e-4 of them land on the wrong side of an edge.
    exchange = Exchange(*groove(np.radians(angle), 12))
    factors, lengths = view_factors(exchange), exchange.lengths
    found = lengths[:12] @ factors[:12, 12:24].sum(axis=1)
    # One of the 2048 rays.
    assert found == pytest.approx(1 - np.sin(np.radians(angle) / 2), abs=1 / 2048)


def test_view_factor_of_opposite_strips():
    exchange = Exchange(*lines([[1, 0.7], [0, 0.7]], [[0, 0], [1, 0]]))
    expected = np.hypot(1, 0.7) - 0.7  # within two of 2048 rays
    # Two of 2048 rays.
    np.testing.assert_allclose(view_factors(exchange)[[0, 1], [1, 0]], expected, atol=1e-3)


@given(st.floats(0.3, 3.0), st.floats(0.1, 0.9), st.integers(2, 9))
@settings(max_examples=25)
def test_rows_have_the_sum_one_and_are_reciprocal(angle, radius, count):
    # A groove with a thin bar across its bisector, which hides a part of each wall.
    toward = np.array([np.cos(angle / 2), np.sin(angle / 2)])
    half = 0.3 * radius * np.sin(angle / 2) * np.array([toward[1], -toward[0]])
    near, far, thick = radius * toward - half, radius * toward + half, 0.01 * radius * toward
    starts, ends = groove(angle, count)
    plate = lines([near + thick, far + thick, far - thick, near - thick, near + thick])
    exchange = Exchange(np.concatenate([starts, plate[0]]), np.concatenate([ends, plate[1]]))
    factors = view_factors(exchange)
    np.testing.assert_allclose(factors.sum(axis=1), 1.0, rtol=DOUBLE)
    sent = exchange.lengths[:, None] * factors[:, :-1]
    # Rays are a lattice whose rows have up to √2048 = 45 points. Where an end of the bar is seen
    # along a row, half of it may count on the wrong side; the bar has two ends.
    np.testing.assert_allclose(sent, sent.T, atol=exchange.lengths.max() / sqrt(exchange.rays))


def test_more_rays_are_more_exact():
    def error(rays):
        exchange = Exchange(*groove(np.radians(45.0), 20), rays=rays)
        sent = exchange.lengths[:, None] * view_factors(exchange)[:, :-1]
        return np.abs(sent - sent.T).max()

    # Evenly spread points: nearly as 1 / rays, where random ones would give the root of 16.
    assert error(8192) < error(512) / 5


@given(
    st.lists(st.floats(0.01, 1.0), min_size=16, max_size=16),
    st.lists(st.floats(0.0, 1.0), min_size=16, max_size=16),
    st.floats(0.2, 3.0),
)
@settings(max_examples=25)
def test_an_isothermal_room_is_a_blackbody(emissivity, mirror, angle):
    exchange = Exchange(*groove(angle, 8), rays=200)
    black = np.full(16, 7.0)
    for found in (
        exchange.incident(black, emissivity, 7.0, mirror),
        exchange.incident(black, emissivity, 7.0, mirror, (0.3, 1.0)),
    ):
        # Rounding, 1 / (1 - 0.99) times.
        np.testing.assert_allclose(found, 7.0, rtol=1e-12)


@pytest.mark.parametrize("angle", [20.0, 45.0, 90.0, 140.0])
def test_vertex_of_an_isothermal_diffuse_groove(angle):
    # A point at the vertex sees the other wall in (1 + cos angle) / 2 of its hemisphere, and that
    # wall is as bright there: B = e + (1 - e) F B (Sparrow and Cess, Radiation Heat Transfer).
    turn = np.radians(angle)
    exchange = Exchange(*groove(turn, 40, grading=3.0))
    found = CHIP + (1 - CHIP) * exchange.incident(np.ones(80), CHIP)[[39, 40]]
    expected = CHIP / (1 - (1 - CHIP) * (1 + np.cos(turn)) / 2)
    # Two of 2048 rays: found are 2e-4 to 4e-4, less with more rays.
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_a_diffuse_groove_along_its_walls():
    # The integral equation by another way: kernel sin² x y / (2 r³), Gauss points that crowd at the
    # vertex, where the first points' place of 1e-4 stands for it.
    turn = np.radians(50.0)
    node, weight = np.polynomial.legendre.leggauss(80)
    u, du = (node + 1) / 2, weight / 2
    x, dx = u**4, 4 * u**3 * du
    distance = x[:, None] ** 2 + x**2 - 2 * np.outer(x, x) * np.cos(turn)
    kernel = np.sin(turn) ** 2 * np.outer(x, x) / 2 / distance**1.5
    bright = np.linalg.solve(np.eye(80) - (1 - CHIP) * kernel * dx, np.full(80, CHIP))
    exchange = Exchange(*groove(turn, 40))
    found = CHIP + (1 - CHIP) * exchange.incident(np.ones(80), CHIP)[40:]
    places = exchange.middles[40:, 0]
    inside = (places > 0.01) & (places < 0.98)
    expected = np.interp(places, x, bright)
    # Two of 2048 rays: found are 4e-4, and 2e-4 with 8192.
    np.testing.assert_allclose(found[inside], expected[inside], atol=1e-3)


@pytest.mark.parametrize("angle", [35.0, 50.0, 70.0, 100.0, 130.0])
def test_a_groove_of_mirrors_by_counting_images(angle):
    # A ray along the bisector goes straight through the images of the wedge, which lie at multiples
    # of the angle: it crosses as many as there are up to half a turn from its own direction.
    turn = np.radians(angle)
    count = int(np.floor(np.pi / turn + 0.5))
    exchange = Exchange(*groove(turn, 30, grading=3.0), rays=64)
    bisector = (np.cos(turn / 2), np.sin(turn / 2))
    found = exchange.incident(np.ones(60), CHIP, 0.0, 1.0, bisector)
    near_vertex = CHIP + (1 - CHIP) * found[25:35]
    np.testing.assert_allclose(near_vertex, 1 - (1 - CHIP) ** count, rtol=DOUBLE)


@pytest.mark.parametrize("mirror", [0.0, 0.4, 1.0])
def test_parallel_plates(mirror):
    # Mirrors at both ends make them endless. q = (L1 - L2) / (1 / e1 + 1 / e2 - 1), however they
    # reflect. Some permille of the rays are so flat that they meet more than 64 mirrors.
    exchange = Exchange(
        *lines([[0, 0], [1, 0]], [[1, 0], [1, 1]], [[1, 1], [0, 1]], [[0, 1], [0, 0]])
    )
    emissivity, black = np.array([0.3, 0.0, 0.6, 0.0]), np.array([5.0, 0.0, 2.0, 0.0])
    found = exchange.incident(black, emissivity, 0.0, [mirror, 1.0, mirror, 1.0])
    flux = emissivity * (black - found)
    expected = 3.0 / (1 / 0.3 + 1 / 0.6 - 1)
    # Those permille, and two of 2048 rays: 0.26 % measured.
    np.testing.assert_allclose(flux[[0, 2]], [expected, -expected], rtol=4e-3)


@pytest.mark.parametrize("mirror", [0.0, 1.0])
def test_a_cylinder_in_a_cylinder(mirror):
    # As a sphere in a sphere: diffuse with the ratio of the areas; mirrors send all that the inner
    # one sent back to it, so that the ratio does not matter (9 % between the two). The circles have
    # 60 sides: a mirror is turned by up to 3°, and some of the rays that just touch miss.
    exchange = Exchange(*lines(circle(1.0, 60, False), circle(2.0, 60, True)), rays=300)
    inner = np.arange(120) < 60
    emissivity, black = np.where(inner, 0.3, 0.6), np.where(inner, 5.0, 2.0)
    found = exchange.incident(black, emissivity, 0.0, np.where(inner, 0.0, mirror))
    flux = emissivity * (black - found)
    ratio = 1.0 if mirror else 0.5
    expected = 3.0 / (1 / 0.3 + ratio * (1 / 0.6 - 1))
    within = 0.02 if mirror else 4e-3
    assert flux[inner].mean() == pytest.approx(expected, rel=within)
    # What the one loses the other receives.
    lost = (exchange.lengths * flux)[inner].sum(), (exchange.lengths * flux)[~inner].sum()
    assert lost[0] == pytest.approx(-lost[1], rel=within)


@given(st.floats(0.05, 1.0), st.floats(0.05, 1.0), st.floats(0.3, 3.0), st.floats(0.0, 9.0))
@settings(max_examples=25)
def test_energy_is_conserved(first, second, angle, surroundings):
    # What the walls lose is what goes to the surroundings less what comes from them.
    exchange = Exchange(*groove(angle, 10))
    emissivity, black = np.repeat([first, second], 10), np.repeat([4.0, 1.0], 10)
    falls = exchange.incident(black, emissivity, surroundings)
    lost = exchange.lengths @ (emissivity * (black - falls))
    leaves = emissivity * black + (1 - emissivity) * falls - surroundings
    out = exchange.lengths @ (view_factors(exchange)[:, -1] * leaves)
    # Of up to 18. A pair of elements lacks reciprocity by 1.5 of 2048 rays (root mean square of
    # 75 000 pairs): of 100 pairs of up to 0.19 long and of a radiosity up to 9, by 0.012 together;
    # eight times as much.
    assert lost == pytest.approx(out, abs=0.1)


# ---- the side of chip and tool


def test_the_wedge_is_as_wide_and_deep_as_its_arc():
    wedge = Wedge(angle=np.radians(30), bulge_radius=80e-6, overhang=5e-6)
    side = wedge.outline
    np.testing.assert_allclose(side[0], [0, -45e-6], atol=DOUBLE * 45e-6)  # rounding
    np.testing.assert_allclose(side[-1], [80e-6 * np.cos(np.radians(30)), -5e-6])
    first = side[1] - side[0]
    # The first chord of 24, graded as the square, is a 1152th of the arc's turn from its tangent.
    assert np.arctan2(first[0], first[1]) == pytest.approx(np.radians(30), abs=1e-3)


def straight(height, depth):
    """Fraction of its hemisphere in which a flat side sees a wall of some height beside it."""
    return (1 - depth / np.hypot(depth, height)) / 2


def test_the_tools_side_sees_a_chip_that_stands_out():
    # A chip 29 um over a tool's side: an arc of 89° and 30 um in the place of a wall. It is farther
    # away, and lower at the face. Far off, few rays meet it.
    wedge = Wedge(angle=np.radians(1.0), bulge_radius=30e-6, overhang=-29e-6)
    elements = wedge.elements
    chip = np.zeros(len(elements.depths))
    chip[elements.chip] = 1.0
    found = elements.exchange.incident(chip, 1.0, eye=(0.0, 1.0))[: elements.tool_side]
    depth = -elements.depths[: elements.tool_side]
    near = depth < 80e-6
    assert near.sum() > 5
    assert (found < straight(29e-6, depth))[near].all()
    assert (found > 0.9 * straight(29e-6, depth + 30e-6))[near].all()
    assert found[-1] > found[0] > 0


def test_finer_elements_change_little(monkeypatch):
    depth, coarse = Wedge().effective_emissivity(CHIP, TOOL)
    monkeypatch.setattr("chipglow.surface.side_flow._SIDE_ELEMENTS", 96)
    monkeypatch.setattr("chipglow.surface.side_flow._RAKE_ELEMENTS", 64)
    finer, fine = Wedge().effective_emissivity(CHIP, TOOL)
    beyond = depth > 1e-6
    expected = np.interp(depth, finer, fine)
    # 1e-3 was seen; an emissivity is measured to 0.01.
    np.testing.assert_allclose(coarse[beyond], expected[beyond], atol=2e-3)


def test_a_mirror_shows_the_rake_face_only_where_the_side_is_steep():
    # The ray from the camera leaves a slope at twice its angle: upward and past the tool's side
    # where the side is flat, down into the wedge where its slope is over 45°.
    wedge = Wedge(angle=np.radians(30), mirror=1.0)
    _, found = wedge.effective_emissivity(CHIP, TOOL, tool_radiance=0.0)
    assert (found >= CHIP - 1e-12).all()
    assert found[0] > CHIP + 0.05
    assert found[-1] == pytest.approx(CHIP, abs=DOUBLE)


# ---- on a scene

RASTER = Raster(left=-120e-6, top=160e-6, spacing=2e-6, rows=75, columns=90)
BAND = Band(3.8e-6, 5.1e-6)
CAMERA = Camera(band=BAND, pitch=2e-6, psf=None, lower_limit=None)


def a_scene(rake=0.0, chip=HOT, tool=WARM, raster=RASTER, gap=0.0):
    """A chip that stands on the rake face of a tool, over its whole height."""
    geometry = ToolGeometry(rake_angle=np.radians(rake))
    x, y = np.meshgrid(raster.x, raster.y)
    distance = geometry.signed_distance(x, y)
    material = np.where(distance < 0, Material.TOOL, Material.WORKPIECE)
    depth = (np.stack([x, y], axis=-1) - geometry.rake_foot) @ np.array(geometry.rake_normal)
    material[(distance >= 0) & ((depth < 0) | (distance < gap))] = Material.VOID
    fields = {
        "temperature": np.where(distance < 0, tool, chip),
        "material": material,
        "plastic_strain": np.ones(x.shape),
        "plastic_strain_rate": np.zeros(x.shape),
        "material_x": x,
        "material_y": y,
    }
    return Scene.from_fields(
        raster, [0.0], {name: value[None] for name, value in fields.items()}, geometry
    )


def apparent(scene, surface, camera=CAMERA):
    return camera.expose(scene, surface, 0.0).mean_radiance


def beside_face(scene):
    """Depth from the rake face, distance along it, and material of the samples."""
    raster, tool = scene.raster, scene.tool
    x, y = np.meshgrid(raster.x, raster.y)
    from_foot = np.stack([x, y], axis=-1) - tool.rake_foot
    material = scene.frame(0).material
    return from_foot @ tool.rake_normal, from_foot @ tool.rake_direction, material


@pytest.mark.parametrize("rake", [0.0, -7.0, 12.0])
def test_what_the_camera_sees_of_a_chip_beside_a_black_tool(rake):
    scene = a_scene(rake)
    wedge = Wedge(angle=RIGHT, overhang=30e-6, rake_emissivity=1.0)
    found = apparent(scene, UniformSurface(CHIP).modified(wedge))
    depth, along, material = beside_face(scene)
    inside = (material == Material.WORKPIECE) & (depth < 200e-6) & (along > 0)
    seen = float(BAND.radiance(WARM)) * straight(30e-6, depth)
    expected = CHIP * float(BAND.radiance(HOT)) + (1 - CHIP) * seen
    # Rays and cells along the face: 0.3 % measured.
    np.testing.assert_allclose(found[inside], expected[inside], rtol=5e-3)
    lit = expected[inside] / (CHIP * float(BAND.radiance(HOT)))
    assert lit.max() > 1.05  # the tolerance is a small part of what is added
    bare = apparent(scene, UniformSurface(CHIP))
    beyond = (along < 0) | (material != Material.WORKPIECE) | (depth > 250e-6)
    np.testing.assert_array_equal(found[beyond], bare[beyond])


@pytest.mark.parametrize("mirror", [0.0, 0.5, 1.0])
def test_an_isothermal_scene_looks_like_a_blackbody(mirror):
    scene = a_scene(-7.0, chip=HOT, tool=HOT)
    camera = replace(CAMERA, reflected=HOT)
    found = apparent(scene, CHIP_1.modified(Wedge(mirror=mirror)), camera)
    there = scene.frame(0).material != Material.VOID
    # The table of the exposure is within 4e-7, emissivities are of 24 bits.
    np.testing.assert_allclose(found[there], float(BAND.radiance(HOT)), rtol=2e-6)


def test_nearly_isothermal_surroundings():
    # The effective emissivity divides by what is left of the sample over its surroundings.
    scene = a_scene(-7.0, chip=HOT, tool=HOT)
    camera = replace(CAMERA, reflected=HOT - 0.5)
    found = apparent(scene, CHIP_1.modified(Wedge()), camera)
    there = scene.frame(0).material != Material.VOID
    limits = BAND.radiance([HOT - 0.5, HOT])
    assert (found[there] >= limits[0] * (1 - 1e-6)).all()
    assert (found[there] <= limits[1] * (1 + 1e-6)).all()


def test_a_hot_tool_makes_more_light_than_a_blackbody_would():
    scene = a_scene(-7.0, chip=WARM, tool=HOT)
    surface = UniformSurface(0.3).modified(Wedge(rake_emissivity=1.0))
    field = CAMERA.prepare(surface, scene)
    emissivity = field.emissivity(scene.frame(0))
    assert emissivity.max() > 1.5
    radiance = apparent(scene, surface)
    depth, along, material = beside_face(scene)
    near = (material == Material.WORKPIECE) & (depth < 3e-6) & (along > 10e-6)
    assert (radiance[near] > float(BAND.radiance(WARM))).all()
    assert (radiance <= float(BAND.radiance(HOT))).all()


@pytest.mark.parametrize("camera", [CAMERA, replace(CAMERA, reflected=293.0)])
def test_where_nothing_touches_the_face_all_is_as_without(camera):
    scene = a_scene(-7.0, gap=10e-6)
    reflecting = CHIP_1.modified(Wedge())
    np.testing.assert_array_equal(
        apparent(scene, reflecting, camera), apparent(scene, CHIP_1, camera)
    )


def test_it_reads_no_more_of_a_scene_than_the_bare_surface():
    scene = a_scene()
    for bare in (CHIP_1, UniformSurface(CHIP)):
        field = CAMERA.prepare(bare.modified(Wedge()), scene)
        assert EmissivityStack([field, field]).required_fields == bare.prepare(scene).fields


def test_several_surfaces_are_seen_as_each_alone():
    scene = a_scene(-7.0)
    surfaces = [chip.modified(Wedge()) for chip in (CHIP_1, CHIP_2)]
    surfaces += [CHIP_1.modified(Wedge(mirror=1.0)), CHIP_2]
    views = [SpectralView(CAMERA.prepare(surface, scene), BAND) for surface in surfaces]
    for chosen in (slice(0, 2), slice(0, 4)):
        together = expose(scene, views[chosen], 0.0, 1e-5)
        for exposure, surface in zip(together, surfaces[chosen], strict=True):
            np.testing.assert_array_equal(exposure.mean_radiance, apparent(scene, surface))
