"""Edge preparations and outlines from points: their distances, faces and cuts."""

from dataclasses import replace
from math import cos, degrees, hypot, pi, radians, sin, tan

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from matplotlib.path import Path as Polygon
from tolerances import DOUBLE

from chipglow.cutting import CuttingConditions, CuttingSimulation, Numerics, OutputWindow
from chipglow.io import SceneWriter, open_scene, read_tool_outline, write_scene
from chipglow.scene import (
    FIELD_UNITS,
    Chamfer,
    Hone,
    Material,
    Raster,
    Scene,
    ToolGeometry,
    ToolOutline,
)
from chipglow.scene.tool_surface import surface_bound, surface_distance

INTERSECTION = 1e-9
"""Relative rounding of lengths between intersections, of lines at small angles too."""

CHAMFERED = ToolGeometry(chamfer=Chamfer(100e-6, radians(20.0)))
WATERFALL = ToolGeometry(hone=Hone(80e-6, 40e-6))
BREAKER = ToolOutline.placed(
    1e-6 * np.array([(60, 600), (60, 200), (120, 130), (0, 20), (0, 0), (500, 60)])
)
"""A tool with a groove behind its edge: corners of both kinds."""


def sampled(tool, count=129, length=1e-3):
    """Points on a rounded wedge: the ends of its faces and the arc."""
    angle = np.linspace(pi - tool.rake_angle, 1.5 * pi + tool.clearance_angle, count)
    arc = tool.corners[0] + tool.edge_radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    top = arc[0] + length * np.array(tool.rake_direction)
    right = arc[-1] + length * np.array(tool.clearance_direction)
    return np.concatenate([top[None], arc, right[None]])


def sharp_edge(tool):
    """Where the lines of both faces cross."""
    foot, rake = tool.rake_foot, np.array(tool.rake_direction)
    clearance = np.array(tool.clearance_direction)
    outline = tool.outline(1e-3)
    along, _ = np.linalg.solve(np.stack([rake, -clearance], axis=1), outline[-1] - foot)
    return foot + along * rake


@st.composite
def chamfered(draw):
    tool = ToolGeometry(
        radians(draw(st.floats(-30, 20))), radians(draw(st.floats(2, 15))), draw(RADIUS)
    )
    angle = radians(draw(st.floats(5, 40)))
    rest = pi / 2 + tool.rake_angle + tool.clearance_angle - angle
    corners = tool.edge_radius * (tan(angle / 2) + tan(rest / 2))
    return replace(tool, chamfer=Chamfer(corners + draw(st.floats(1e-6, 100e-6)), angle))


@st.composite
def outlines(draw):
    """Edges of a few corners, convex or not, between straight faces."""
    count = draw(st.integers(0, 6))
    steps = draw(st.lists(st.tuples(WIDTH, WIDTH), min_size=count, max_size=count))
    edge = np.cumsum([(0.0, 0.0), *((x, -y) for x, y in steps)], axis=0)
    top = edge[0] + [draw(st.floats(-100e-6, 100e-6)), 400e-6]
    right = edge[-1] + [400e-6, draw(st.floats(20e-6, 100e-6))]
    return ToolOutline.placed(np.concatenate([top[None], edge, right[None]]))


RADIUS = st.floats(2e-6, 40e-6)
WIDTH = st.floats(2e-6, 40e-6)
HONED = st.builds(
    lambda rake, clearance, length, factor: ToolGeometry(
        radians(rake), radians(clearance), hone=Hone(length * factor, length)
    ),
    st.floats(-30, 30),
    st.floats(2, 20),
    st.floats(5e-6, 40e-6),
    st.floats(0.15, 7.0),
)
WEDGES = st.builds(
    lambda rake, clearance, radius: ToolGeometry(radians(rake), radians(clearance), radius),
    st.floats(-30, 30),
    st.floats(2, 20),
    st.floats(2e-6, 60e-6),
)
TOOLS = st.one_of(WEDGES, chamfered(), HONED, outlines())
FEW = settings(max_examples=60)


def places(seed, count=300):
    return np.random.default_rng(seed).uniform(-200e-6, 300e-6, (count, 2))


def distances(tool, points):
    return tool.signed_distance(points[:, 0], points[:, 1])


def densely(line, step=0.25e-6):
    """Points along a line, a step apart or less."""
    lengths = np.hypot(*np.diff(line, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    even = np.unique(np.concatenate([along, np.arange(0.0, along[-1], step)]))
    return np.stack([np.interp(even, along, line[:, axis]) for axis in (0, 1)], axis=1)


@given(TOOLS, st.integers(0, 2**32))
@example(BREAKER, 0)
@FEW
def test_distance_is_that_to_the_nearest_of_many_points_on_the_outline(tool, seed):
    line, points = tool.outline(600e-6), places(seed, 100)
    samples = densely(line)
    nearest = np.array([np.hypot(*(samples - point).T).min() for point in points])
    inside = Polygon(np.concatenate([line, [[1e-3, 1e-3]]])).contains_points(points)
    found = distances(tool, points)
    # Samples a quarter of a micrometre apart, on chords that stay within 0.03 % of the radius.
    tolerance = 0.13e-6 + 1e-3 * tool.corner_radius
    np.testing.assert_allclose(np.abs(found), nearest, rtol=0, atol=tolerance)
    clear = nearest > tolerance
    np.testing.assert_array_equal(found[clear] < 0, inside[clear])


@given(TOOLS, st.integers(0, 2**32))
@example(BREAKER, 0)
@FEW
def test_the_normal_is_the_gradient_and_leads_from_the_surface(tool, seed):
    for x, y in places(seed, 50):
        distance, nx, ny = surface_distance(x, y, tool.surface)
        assert hypot(nx, ny) == pytest.approx(1.0, abs=DOUBLE)
        foot = (x - distance * nx, y - distance * ny)
        assert abs(tool.signed_distance(*foot)) < 2e-16  # rounding of 1 mm, in m
        # Half-way to the surface the nearest place and the normal are the same.
        half = (x - 0.5 * distance * nx, y - 0.5 * distance * ny)
        if abs(distance) > 1e-9:
            # Places are rounded to 1e-20 m, which turns a normal over 1e-9 m by 1e-11.
            assert surface_distance(*half, tool.surface) == pytest.approx(
                (0.5 * distance, nx, ny), abs=1e-10
            )


@pytest.mark.parametrize("tool", [CHAMFERED, WATERFALL, ToolGeometry()])
def test_outside_a_convex_tool_the_normal_turns_without_a_jump(tool):
    """On the line of points that touch, 3 um off the surface, a hundredth of a micrometre apart."""
    line = densely(tool.outline(200e-6), 0.01e-6)
    normals = []
    for x, y in line:
        distance, nx, ny = surface_distance(x - 3e-6, y - 3e-6, tool.surface)
        if 0 < distance < 6e-6:
            normals.append((nx, ny))
    turns = np.hypot(*np.diff(normals, axis=0).T)
    # The sharpest curve there, 3 um round the sharpest corner of the surface, or of the chain.
    assert len(normals) > 10_000
    assert turns.max() < 0.011e-6 / min(3e-6, tool.corner_radius)


@given(TOOLS, st.integers(0, 2**32))
@example(ToolGeometry(), 0)
@FEW
def test_the_bound_is_never_over_the_distance(tool, seed):
    points = places(seed)
    bound = np.array([surface_bound(x, y, tool.surface) for x, y in points])
    assert (bound <= distances(tool, points) + 1e-15).all()
    far = [(-1e-3, 0.0), (0.0, -1e-3)]
    assert all(surface_bound(x, y, tool.surface) > 500e-6 for x, y in far)


@given(TOOLS, st.floats(0.0, 1e-3))
@example(BREAKER, 1e-4)
@FEW
def test_rake_points_lie_on_the_straight_rake_face(tool, distance):
    x, y = tool.rake_point(distance)
    # The straight face of an outline stays within 0.2 um of its points.
    tolerance = 0.2e-6 if isinstance(tool, ToolOutline) else 1e-15
    assert abs(tool.signed_distance(x, y)) <= tolerance
    below = tool.rake_point(-1e-6)
    if not isinstance(tool, ToolOutline):
        assert tool.signed_distance(*below) > 0


@given(TOOLS)
@example(BREAKER)
@FEW
def test_the_lowest_point_is_on_the_cut_surface(tool):
    lowest = tool.outline(1e-4)[:, 1].min()
    # A hone's chain has its corners where they fall, an arc of 1.4 degrees its ends.
    tolerance = 0.0 if isinstance(tool, ToolOutline) else 1e-3 * tool.corners.max()
    assert -1e-15 <= lowest <= tolerance + 1e-15
    under = np.array([[x, -50e-6] for x in np.linspace(-1e-4, 5e-4, 50)])
    assert distances(tool, under).min() >= 50e-6 - 1e-15


def test_the_middle_of_a_round_edge_is_its_edge_point():
    tool = ToolGeometry()
    np.testing.assert_allclose(
        tool.edge_point, tool.edge_radius * (1 - 1 / np.sqrt(2)), rtol=DOUBLE
    )
    # In m; places of 1e-4 m are rounded to 1e-20 m.
    assert BREAKER.signed_distance(*BREAKER.edge_point) == pytest.approx(0.0, abs=1e-15)


@given(chamfered())
@FEW
def test_width_and_angle_of_the_chamfer_are_those_of_the_sharp_outline(tool):
    upper, lower = tool.corners
    land = (upper - lower) / np.hypot(*(upper - lower))
    normal = np.array([-land[1], land[0]])
    on_land = lower + tool.edge_radius * normal
    assert np.hypot(*(upper - lower)) == pytest.approx(tool.land, rel=INTERSECTION, abs=0)
    assert land @ np.array(tool.rake_direction) == pytest.approx(cos(tool.chamfer.angle))
    corners = []
    for foot, direction in (
        (tool.rake_foot, tool.rake_direction),
        (tool.outline(1e-3)[-1], tool.clearance_direction),
    ):
        along, _ = np.linalg.solve(np.stack([land, -np.array(direction)], axis=1), foot - on_land)
        corners.append(along)
    assert corners[0] - corners[1] == pytest.approx(tool.chamfer.width, rel=INTERSECTION, abs=0)
    # The flat between its rounded corners is on the surface, with the land's normal.
    for fraction in (0.01, 0.5, 0.99):
        place = lower + fraction * (upper - lower) + (tool.edge_radius + 1e-6) * normal
        assert surface_distance(*place, tool.surface) == pytest.approx((1e-6, *normal), abs=DOUBLE)


@given(HONED)
@FEW
def test_a_hone_leaves_the_faces_where_it_should(tool):
    sharp, outline = sharp_edge(tool), tool.outline(1e-3)
    assert np.hypot(*(tool.rake_foot - sharp)) == pytest.approx(
        tool.hone.rake, rel=INTERSECTION, abs=0
    )
    foot = outline[-1] - 1e-3 * np.array(tool.clearance_direction)
    assert np.hypot(*(foot - sharp)) == pytest.approx(tool.hone.clearance, rel=INTERSECTION, abs=0)
    # The ellipse as a rational curve of Bezier: the weight sin(wedge / 2) makes K = 1 a circle.
    wedge = pi / 2 - tool.rake_angle - tool.clearance_angle
    u = np.linspace(0.0, 1.0, 33)
    weights = np.stack([(1 - u) ** 2, 2 * u * (1 - u) * sin(wedge / 2), u**2], axis=1)
    curve = weights @ np.array([tool.rake_foot, sharp, foot]) / weights.sum(axis=1)[:, None]
    # 64 chords of the curve; at a form factor of 7 the sharp end has few of them.
    assert np.abs(distances(tool, curve)).max() < 2e-3 * min(tool.hone.rake, tool.hone.clearance)


def test_faces_of_a_sampled_wedge_are_found():
    tool = ToolGeometry(radians(6.0), radians(9.0), 30e-6)
    outline = ToolOutline.placed(sampled(tool) + np.array([3e-3, -2e-3]))
    # Up to 0.2 um of the arc belongs to a face of 1 mm.
    assert outline.rake_angle == pytest.approx(tool.rake_angle, abs=0.3e-3)
    # The other face, the same.
    assert outline.clearance_angle == pytest.approx(tool.clearance_angle, abs=0.3e-3)
    # Along the face, where the arc leaves it: 3.4 um measured.
    assert np.hypot(*(outline.rake_foot - tool.rake_foot)) < 4e-6
    points = places(5)
    # Chords of the sampled arc: 1.4e-9 m measured.
    np.testing.assert_allclose(
        distances(outline, points), distances(tool, points), rtol=0, atol=1e-8
    )


def test_a_worn_flank_is_part_of_the_edge():
    tool = ToolOutline.placed(1e-6 * np.array([(-5, 400), (0, 0), (80, 0), (400, 40)]))
    assert degrees(tool.clearance_angle) == pytest.approx(degrees(np.arctan2(40, 320)))
    # In m: far below any outline.
    np.testing.assert_allclose(tool.rake_foot, [0.0, 0.0], atol=1e-12)
    assert tool.signed_distance(40e-6, -7e-6) == pytest.approx(7e-6)


def tool(**changed):
    return replace(ToolGeometry(), **changed)


REFUSED = {
    "rake_angle: 80 deg, expected more than -60 deg": lambda: tool(rake_angle=radians(80.0)),
    "clearance_angle: 0 rad, expected more than 0": lambda: tool(clearance_angle=0.0),
    "wedge of less than 5": lambda: ToolGeometry(radians(50.0), radians(40.0)),
    "chamfer width: more than 17.* got 10 um": lambda: tool(chamfer=Chamfer(10e-6, 0.35)),
    "chamfer angle: expected less than 83 degrees": lambda: tool(chamfer=Chamfer(1e-4, 1.5)),
    "chamfer and hone: cannot be combined": lambda: tool(
        chamfer=Chamfer(1e-4, 0.3), hone=Hone(1e-5, 1e-5)
    ),
    "Chamfer.width: 0 m, expected more than 0 m": lambda: Chamfer(0.0, 0.3),
    "Chamfer.angle: -0.1 rad, expected more than 0 rad": lambda: Chamfer(1e-4, -0.1),
    "form factor rake / clearance is 100, expected 0.1 to 10": lambda: Hone(1e-4, 1e-6),
    "lowest point at y 10 um, expected 0 um": lambda: ToolOutline(
        ((0.0, 400e-6), (0.0, 10e-6), (400e-6, 50e-6))
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_tool_that_cannot_be_is_refused(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()


GOOD = "0,500\n0,20\n20,0\n600,60\n"


@pytest.mark.parametrize(
    "content",
    [
        b"x_um,y_um\n" + GOOD.encode(),
        b"x_mm,y_mm\n0,0.5\n0,0.02\n0.02,0\n0.6,0.06\n",
        b"\xef\xbb\xbfx_um, y_um\r\n1000, 500\r\n1000,20\r\n1020,0\r\n1600,60\r\n\r\n",
    ],
)
def test_an_outline_is_read_in_any_unit_of_length_and_from_any_origin(content, tmp_path):
    (tmp_path / "edge.csv").write_bytes(content)
    expected = 1e-6 * np.array([(0, 500), (0, 20), (20, 0), (600, 60)])
    corners = read_tool_outline(tmp_path / "edge.csv").corners
    # In m: some roundings of 6e-4 m, each 7e-20 m.
    np.testing.assert_allclose(corners, expected, atol=1e-18)


HEAD = "x_um,y_um\n"
BAD = {
    "there is no number in it": "",
    "line 1: 'x' has no unit, expected a name such as x_um": "x,y\n" + GOOD,
    "line 1: unknown column '0', expected x_um, y_um": GOOD,
    "line 3: y is 'ten', expected a number": HEAD + "0,500\n0,ten\n",
    "line 4: 2 points, expected 3 to 1000": HEAD + "0,500\n\n600,60\n",
    "line 3: 2 points, expected 3 to 1000": HEAD + "0,500\n20,0\n",
    "line 3: y is 'nan', expected a number": HEAD + "0,500\n0,nan\n600,60\n",
    "line 4: the same point as the one before": HEAD + "0,500\n0,20\n0,20\n600,60\n",
    "line 3: the line turns back": HEAD + "0,500\n0,20\n0,90\n600,95\n",
    "line 2: outline 8999.98 mm long, expected up to": HEAD + "0,9e6\n0,20\n600,60\n",
    "line 6: the piece from point 2 crosses that from point 5": (
        HEAD + "0,500\n0,100\n90,0\n-50,60\n20,-5\n600,60\n"
    ),
    "line 2: rake_angle: .* got 84.* degrees; points go from the rake face": (
        HEAD + "600,60\n20,0\n0,20\n0,500\n"
    ),
    "line 2: clearance_angle: expected more than 0 and less than 45 degrees, got -2.8": (
        HEAD + "0,500\n0,0\n600,-30\n"
    ),
    "line 1002: 1001 points, expected 3 to 1000": HEAD + 1001 * "0,500\n",
    "250000 points, expected 3 to 1000": HEAD + 250_000 * "0,1\n",
    "line 2: has 1 cell separated by ',', expected 2": HEAD + "\xff\xfe\n",
}


@pytest.mark.parametrize("message", BAD)
def test_a_bad_file_is_one_line_with_file_line_value_and_expectation(message, tmp_path):
    path = tmp_path / "edge.csv"
    path.write_bytes(BAD[message].encode("latin-1"))
    with pytest.raises(ValueError, match=message) as caught:
        read_tool_outline(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("tool", [ToolGeometry(), CHAMFERED, WATERFALL, BREAKER])
def test_a_tool_survives_in_a_scenes_file(tool, tmp_path):
    raster = Raster(-4e-6, 4e-6, 2e-6, 4, 4)
    fields = {name: np.zeros((1, 4, 4)) for name in FIELD_UNITS}
    fields["temperature"] += 300.0
    scene = Scene.from_fields(raster, [0.0], fields, tool=tool)
    assert scene.tool == tool
    if tool == ToolGeometry():  # as other programs and earlier files have it
        values = (tool.rake_angle, tool.clearance_angle, tool.edge_radius)
        names = ("tool_rake_angle", "tool_clearance_angle", "tool_edge_radius")
        assert [scene.data.attrs[name] for name in names] == list(values)
    with SceneWriter(tmp_path / "scene.nc", raster, tool, fields=tuple(FIELD_UNITS)) as writer:
        writer.append(scene.frame(0))
    stored = open_scene(tmp_path / "scene.nc")
    assert stored.tool == tool
    write_scene(stored, tmp_path / "copy.nc")
    stored.data.close()
    with open_scene(tmp_path / "copy.nc").data as copy:
        assert Scene(copy).tool == tool


RASTER = Raster(left=-200e-6, top=250e-6, spacing=5e-6, rows=60, columns=60)
LENGTH = 0.1e-3


def cut(tool):
    """Forces, last frame and points of a short, coarse cut."""
    frames, kept = [], []
    simulation = CuttingSimulation(
        conditions=CuttingConditions(feed=0.15e-3, cutting_length=LENGTH),
        tool=tool,
        numerics=Numerics(cell=25e-6),
    )
    window = OutputWindow(start=0.9 * LENGTH, end=LENGTH, interval=2e-6, later_bands=0)
    history = simulation.run(
        window, RASTER, frames.append, on_checkpoint=lambda state: kept.append(state.arrays)
    )
    return history, frames[-1], kept[-1]["points"]


@pytest.mark.parametrize("tool", [CHAMFERED, BREAKER])
def test_a_cut_with_corners_runs_and_leaves_no_point_in_the_tool(tool):
    history, frame, points = cut(tool)
    assert history.cutting[-1] > 1e5
    inside = tool.signed_distance(*np.meshgrid(RASTER.x, RASTER.y)) < 0
    np.testing.assert_array_equal(frame.material == Material.TOOL, inside)
    assert tool.signed_distance(points["x"], points["y"]).min() > 0
    work = history.energy
    assert work.friction_work[-1] > 0
    assert frame.temperature[inside].max() > 293.15 + 1.0


def test_a_chamfer_raises_the_thrust():
    """A land of -27 degrees pushes the workpiece down: more thrust than the round edge has."""
    assert cut(CHAMFERED)[0].thrust[-1] > 1.1 * cut(ToolGeometry())[0].thrust[-1]
