"""Frames of splines: samples by another way of computing them, files, and the camera's pass."""

from dataclasses import replace
from math import prod
from unittest.mock import Mock

import numba
import numpy as np
import pytest
from scipy.interpolate import BSpline
from tolerances import SINGLE

from chipglow.camera.exposure import SpectralView, expose
from chipglow.io import SceneWriter, StoredScene, open_scene, unfinished_scenes, write_scene
from chipglow.io.packing import read_chunk
from chipglow.io.spline_file import STEPS
from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Raster, Scene, SceneError, ToolGeometry
from chipglow.scene.splines import SPLINE_FIELDS, Lattice, SplineFrame
from chipglow.surface import CHIP_1, CHIP_2, Emissivity, FeatureSurface, UniformSurface

RASTER = Raster(-20e-6, 15e-6, 0.8e-6, 41, 53)
CELL = 4e-6
BAND = Band(3.8e-6, 5.1e-6)
STEP = 0.2e-6
SAMPLED = SPLINE_FIELDS[:7]
RADIANCES = ("mean_radiance", "peak_radiance", "centre_radiance")
LIMITS = {
    "temperature": (293.0, 1400.0),
    "plastic_strain": (0.0, 0.9),
    "plastic_strain_rate": (0.0, 4e4),
    "velocity_x": (0.0, 4.0),
    "velocity_y": (-4.0, 4.0),
    "material_x": (-8e-4, 0.0),
    "material_y": (-1e-4, 1e-4),
    "filled": (0.0, 1.0),
    "tool_temperature": (300.0, 900.0),
}


def a_lattice():
    in_tool = np.zeros(RASTER.shape, bool)
    in_tool[25:, 40:] = True
    return Lattice.within(RASTER, (-100e-6, -103e-6), CELL, in_tool, 290.0)


def a_spline_frame(seed=0, time=0.0):
    lattice, rng = a_lattice(), np.random.default_rng(seed)
    nodes = np.array(
        [rng.uniform(*LIMITS[name], lattice.shape[1:]) for name in SPLINE_FIELDS], np.float32
    )
    nodes[SPLINE_FIELDS.index("filled"), :, 4:] += 0.5  # most of the view shows the workpiece
    # Narrower than the coefficients, so that they count.
    limits = np.array([LIMITS[name] for name in SAMPLED], np.float32)
    middle = limits.mean(axis=1, keepdims=True)
    return SplineFrame(lattice, time, nodes, middle + 0.5 * (limits - middle))


def by_scipy(frame, name):
    """Σ c_ab w_a(y) w_b(x) by scipy's B-splines, in float64."""
    lattice = frame.lattice
    bump = BSpline.basis_element([-1.5, -0.5, 0.5, 1.5], extrapolate=False)

    def weights(places, first, count, step):
        distance = (places[:, None] - (first + step * np.arange(count))) / CELL
        return np.nan_to_num(bump(distance))

    down = weights(RASTER.y, lattice.top, lattice.rows, -CELL)
    across = weights(RASTER.x, lattice.left, lattice.columns, CELL)
    return down @ frame.nodes[SPLINE_FIELDS.index(name)].astype(np.float64) @ across.T


def a_file(path, count=6, **options):
    with SceneWriter(path, RASTER, ToolGeometry(), lattice=a_lattice(), **options) as writer:
        for index in range(count):
            writer.append(a_spline_frame(index, index * STEP).frame())
        writer.forces([0.0, 1e-6], [4e5, 4.5e5], [1.5e5, 2e5], [3e-4, np.nan])
    return path


def in_memory(scene):
    """The samples of a scene as arrays."""
    names = scene.fields
    fields = {name: np.stack([scene.field(name, i) for i in range(len(scene))]) for name in names}
    return Scene.from_fields(scene.raster, scene.times, fields, scene.tool)


def test_samples_are_those_of_the_b_splines():
    frame = a_spline_frame()
    found = frame.frame()
    # Products of float32: a few units in the last place of the largest term.
    assert found.splines is frame
    filled = by_scipy(frame, "filled")
    clear = np.abs(filled - 0.5) > 1e-5
    seen = np.where(filled > 0.5, Material.WORKPIECE, Material.VOID)
    seen[frame.lattice.in_tool] = Material.TOOL
    np.testing.assert_array_equal(found.material[clear], seen[clear])
    assert set(np.unique(found.material)) == {0, 1, 2}
    for number, name in enumerate(SAMPLED):
        expected = np.clip(by_scipy(frame, name), *frame.limits[number].astype(np.float64))
        expected[found.material != Material.WORKPIECE] = 0.0
        if name == "temperature":
            expected[found.material == Material.VOID] = 290.0
            tool = by_scipy(frame, "tool_temperature")
            expected = np.where(frame.lattice.in_tool, tool, expected)
        scale = np.abs(frame.nodes[number]).max()
        # Float32 of values and coefficients: 6e-8 each; 1.3e-7 measured.
        np.testing.assert_allclose(getattr(found, name), expected, rtol=0, atol=4e-7 * scale)


def test_nodes_that_do_not_reach_the_samples_are_refused():
    with pytest.raises(ValueError, match=r"lattice: 5 rows of nodes must extend beyond"):
        replace(a_lattice(), rows=5)
    with pytest.raises(ValueError, match=r"lattice: in_tool has shape \(3, 3\), expected \(41, 53"):
        replace(a_lattice(), in_tool=np.zeros((3, 3), bool))


def test_splines_come_back_within_their_steps(tmp_path):
    scene = open_scene(a_file(tmp_path / "scene.nc"))
    assert scene.fields == (*SAMPLED[:5], "material", *SAMPLED[5:])
    for index in range(len(scene)):
        made, found = a_spline_frame(index, index * STEP), scene.splines(index)
        for number, name in enumerate(SPLINE_FIELDS):
            # Half a step of the packing, and twice the rounding of 32 bits.
            np.testing.assert_allclose(
                found.nodes[number], made.nodes[number], rtol=2 * 2.0**-24, atol=STEPS[name] / 2
            )
        kept, drawn = scene.frame(index), made.frame()
        same = kept.material == drawn.material
        assert same.mean() > 0.995  # a sample on the very border may change
        for name in SAMPLED:
            # Half of a step of the file.
            np.testing.assert_allclose(
                getattr(kept, name)[same],
                getattr(drawn, name)[same],
                rtol=SINGLE,
                atol=STEPS[name] / 2,
            )
    assert scene.tool == ToolGeometry()
    np.testing.assert_array_equal(scene.data["cutting_force"], [4e5, 4.5e5])


def test_a_copy_keeps_the_splines_or_the_samples(tmp_path):
    scene = open_scene(a_file(tmp_path / "scene.nc"))
    write_scene(scene, tmp_path / "copy.nc")
    copy = open_scene(tmp_path / "copy.nc")
    for index in range(len(scene)):
        np.testing.assert_array_equal(copy.splines(index).nodes, scene.splines(index).nodes)
    write_scene(scene, tmp_path / "samples.nc", samples=True)
    sampled = open_scene(tmp_path / "samples.nc")
    assert sampled.splines(0) is None
    found, expected = sampled.frame(2), scene.frame(2)
    np.testing.assert_array_equal(found.material, expected.material)
    # Half a step of the samples' packing.
    np.testing.assert_allclose(found.temperature, expected.temperature, rtol=0, atol=0.0126)
    # Half a step of 20 nm.
    np.testing.assert_allclose(found.material_x, expected.material_x, rtol=SINGLE, atol=10.1e-9)


def test_xarray_sees_the_samples(tmp_path):
    scene = open_scene(a_file(tmp_path / "scene.nc"))
    variable = scene.data["temperature"]
    assert not isinstance(variable.variable._data, np.ndarray)
    assert variable.attrs["units"] == "K"
    np.testing.assert_array_equal(variable[3], scene.frame(3).temperature)
    np.testing.assert_array_equal(
        variable[1:5:2, 4:9, ::-1],
        np.stack([scene.frame(i).temperature[4:9, ::-1] for i in (1, 3)]),
    )
    assert scene.data["material"][2, 5, 7] == scene.frame(2).material[5, 7]
    assert scene.data["velocity_y"].shape == (6, *RASTER.shape)


def test_splines_go_on_from_a_checkpoint(tmp_path):
    def frames(first, last):
        return [a_spline_frame(index, index * STEP).frame() for index in range(first, last)]

    with (
        pytest.raises(KeyboardInterrupt),
        SceneWriter(tmp_path / "scene.nc", RASTER, lattice=a_lattice()) as writer,
    ):
        for frame in frames(0, 3):
            writer.append(frame)
        writer.checkpoint({}, 0.5)
        writer.append(frames(3, 4)[0])  # is lost
        raise KeyboardInterrupt
    (left,) = unfinished_scenes(tmp_path / "scene.nc")
    with SceneWriter(tmp_path / "scene.nc", RASTER, lattice=a_lattice(), resume=left) as writer:
        for frame in frames(3, 6):
            writer.append(frame)
    scene = open_scene(tmp_path / "scene.nc")
    whole = open_scene(a_file(tmp_path / "whole.nc"))
    np.testing.assert_array_equal(scene.times, whole.times)
    for index in range(6):
        one, other = scene.splines(index), whole.splines(index)
        np.testing.assert_array_equal(one.nodes, other.nodes)
        np.testing.assert_array_equal(one.limits, other.limits)


def test_what_stays_in_memory_is_bounded(tmp_path, monkeypatch):
    path = a_file(tmp_path / "scene.nc")
    read = Mock(side_effect=read_chunk)
    monkeypatch.setattr("chipglow.io.scene_file.read_chunk", read)
    one_frame = 2 * 4 * prod(a_lattice().shape)
    monkeypatch.setattr("chipglow.io.scene_file.CACHED_BYTES", one_frame)
    scene = open_scene(path)
    read.reset_mock()
    for index in (3, 3, 4, 3):
        scene.splines(index)
    nodes = [index for (dataset, index), _ in read.call_args_list if dataset.name == "/splines"]
    assert nodes == [3, 4, 3]


def test_a_frame_without_splines_and_one_that_is_not_finite_are_refused(tmp_path):
    frame = a_spline_frame().frame()
    with (
        pytest.raises(SceneError, match=r"the frame at 0 s has no splines of shape \(9, "),
        SceneWriter(tmp_path / "scene.nc", RASTER, lattice=a_lattice()) as writer,
    ):
        writer.append(Frame(frame.time, frame.temperature, frame.material))
    frame.splines.nodes[7, 0, 0] = np.nan
    with (
        pytest.raises(SceneError, match="a spline at 0 s is not finite everywhere"),
        SceneWriter(tmp_path / "scene.nc", RASTER, lattice=a_lattice()) as writer,
    ):
        writer.append(frame)
    assert list(tmp_path.iterdir()) == []


BOUNDED = FeatureSurface(  # near 1: beta distributions, by tables instead of lines
    chip=Emissivity(0.9, 0.08), shear_band=Emissivity(0.95, 0.03), grain=7e-6, seed=3
)


@pytest.mark.parametrize("follow", ["material", "mean", "none"])
def test_a_pass_over_splines_is_that_over_their_samples(tmp_path, follow):
    scene = open_scene(a_file(tmp_path / "scene.nc"))
    samples = in_memory(scene)
    surfaces = [replace(one, follow=follow, grain=7e-6) for one in (CHIP_1, CHIP_2, BOUNDED)]
    for start, duration in ((0.0, 6 * STEP), (0.3 * STEP, 3.1 * STEP)):
        passes = [
            expose(
                one, [SpectralView(s.prepare(one), BAND, 500.0) for s in surfaces], start, duration
            )
            for one in (scene, samples)
        ]
        for found, expected in zip(*passes, strict=True):
            for name in ("peak_temperature", "material_fraction", "centre_temperature"):
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
            for name in ("mean_temperature", *RADIANCES):
                # Sums of three products in another order: units of float32.
                np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=2e-6)


@pytest.mark.parametrize("surface", [CHIP_1, UniformSurface(0.4)], ids=["textured", "uniform"])
def test_a_row_that_begins_later_is_that_of_a_later_exposure(tmp_path, surface):
    scene = open_scene(a_file(tmp_path / "scene.nc"))
    delays = np.repeat([0.0, 0.7, 1.5, 3.0], RASTER.rows)[::4][: RASTER.rows] * STEP
    for one in (scene, in_memory(scene)):
        views = [SpectralView(surface.prepare(one), BAND)]
        (rolling,) = expose(one, views, 0.3 * STEP, 2.2 * STEP, delays)
        for delay in set(delays.tolist()):
            (later,) = expose(one, views, 0.3 * STEP + delay, 2.2 * STEP)
            for name in ("peak_temperature", "mean_temperature", "centre_temperature", *RADIANCES):
                of_row, all_at_once = (getattr(e, name)[delays == delay] for e in (rolling, later))
                np.testing.assert_array_equal(of_row, all_at_once, err_msg=name)


def test_the_pass_does_not_depend_on_the_number_of_threads(tmp_path):
    scene = open_scene(a_file(tmp_path / "scene.nc"))
    before, found = numba.get_num_threads(), []
    try:
        for threads in (1, before):
            numba.set_num_threads(threads)
            found += expose(scene, [SpectralView(CHIP_1.prepare(scene), BAND)], 0.0, 6 * STEP)
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(found[0].mean_radiance, found[1].mean_radiance)
    np.testing.assert_array_equal(found[0].peak_radiance, found[1].peak_radiance)


def test_only_what_a_surface_needs_is_read(tmp_path, monkeypatch):
    write_scene(open_scene(a_file(tmp_path / "first.nc")), tmp_path / "scene.nc", samples=True)
    scene = open_scene(tmp_path / "scene.nc")
    read = []
    whole = StoredScene._read
    monkeypatch.setattr(StoredScene, "_read", lambda s, n, i: read.append((n, i)) or whole(s, n, i))
    for surface, names in (
        (UniformSurface(0.5), {"temperature", "material"}),
        (
            CHIP_1,
            {"temperature", "material", "material_x", "material_y"}
            | {"plastic_strain", "plastic_strain_rate"},
        ),
    ):
        field = surface.prepare(scene)
        read.clear()
        expose(scene, [SpectralView(field, BAND)], 0.0, 6 * STEP)
        assert sorted(read) == sorted((name, index) for name in names for index in range(6))
