"""From a source to a scene: what is missing is made up as said, what goes wrong is one error."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from moving_block import RATE, SPEED, UP, Broken, MovingBlock, strain_at
from tolerances import SINGLE

from chipglow.io import open_scene, unfinished_scenes
from chipglow.io.completion import Completion, complete, optical_flow, strain_rate_along
from chipglow.io.importing import (
    FieldOfView,
    Import,
    import_scene,
    kept_import,
    prospect,
    read_scene,
)
from chipglow.io.sandbox import Isolated, Sandbox
from chipglow.io.sources import SourceError, Units
from chipglow.io.sources.grids.grid import GridSource
from chipglow.quantities.units import CELSIUS
from chipglow.scene import FILLED, Material, Raster, SampledFrame, SceneError, ToolGeometry

RASTER = Raster(0.0, 100e-6, 2e-6, 50, 60)
WHOLE = ("temperature", "plastic_strain", "plastic_strain_rate", "velocity_x", "velocity_y")


@pytest.fixture
def worker_finds_tests(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)


def inner(frame):
    """Samples whose material was there a frame ago too, and is no neighbour of an edge."""
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    return (x > 25e-6) & (y > 25e-6) & (x < 95e-6) & (y < 75e-6)


def test_a_whole_source_comes_through_as_it_is(tmp_path):
    looked = import_scene(Import(MovingBlock(WHOLE)), tmp_path / "scene.nc")
    scene = open_scene(tmp_path / "scene.nc")
    assert looked.notes.assumed == []
    assert scene.raster == RASTER
    frame = scene.frame(5)
    solid = frame.material == Material.WORKPIECE
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    assert frame.temperature[solid] == pytest.approx((400 + 1e6 * x + 5e5 * y)[solid], rel=SINGLE)
    # Differences of float32 strains: 6e-5 measured.
    assert frame.plastic_strain[solid] == pytest.approx(strain_at(x, y, 5e-6)[solid], rel=1e-4)
    assert (frame.temperature[~solid] == np.float32(293.15)).all()
    assert (frame.plastic_strain[~solid] == 0).all()
    assert (frame.quality == 0).all()


def test_missing_strain_rate_is_the_change_of_strain_along_the_motion():
    scene = read_scene(MovingBlock())
    for frame in scene.frames():
        rate = frame.plastic_strain_rate[inner(frame)]
        # The strain's pattern is far wider than a sample: the cubic spline is right to 1e-5 of it.
        assert np.abs(rate - RATE).max() < 0.02 * RATE
    assert "Plastic strain rate: from the change" in scene.data.attrs["assumed"]


def test_strain_rate_of_material_that_was_not_there_is_nought():
    strain = np.full(RASTER.shape, 2.0, np.float32)
    before = strain.copy()
    before[:, :10] = np.nan
    velocity = (np.full(RASTER.shape, SPEED, np.float32), np.zeros(RASTER.shape, np.float32))
    strain[:, :5] = 3.0
    rate = strain_rate_along(strain, before, velocity, 1e-6, RASTER.spacing)
    assert (rate[:, :5] == 0).all()


def test_optical_flow_finds_the_motion_of_a_pattern():
    pytest.importorskip("skimage")
    x, y = np.meshgrid(RASTER.x, RASTER.y)

    def pattern(at):
        x0, y0 = x - SPEED * at, y - UP * at
        return (2 + np.sin(x0 / 6e-6) * np.cos(y0 / 5e-6)).astype(np.float32)

    across, up = optical_flow(pattern(0.0), pattern(0.5e-6), 0.5e-6, RASTER.spacing)
    # The method prefers flows without change: its own bias is 0.15 % here.
    assert np.median(across[10:-10, 10:-10]) == pytest.approx(SPEED, rel=0.02)
    # UP is a sixth of SPEED: 0.06 % of SPEED measured.
    assert np.median(up[10:-10, 10:-10]) == pytest.approx(UP, abs=0.02 * SPEED)


def test_velocity_is_the_flow_in_the_chip_and_the_cutting_speed_before_it():
    pytest.importorskip("skimage")
    # So short that the pattern moves more than it changes.
    source = MovingBlock(("temperature", "plastic_strain"), count=6, interval=0.2e-6)
    scene = read_scene(Import(source, completion=Completion(cutting_speed=4.0)))
    frame = scene.frame(5)
    # A pattern that is as wide as the picture: the method then makes the motion too small.
    assert np.median(frame.velocity_x[inner(frame)]) == pytest.approx(SPEED, rel=0.3)
    unstrained = replace(frame_of(source), fields={
        "temperature": frame_of(source).fields["temperature"],
        "plastic_strain": np.zeros(RASTER.shape, np.float32),
    })  # fmt: skip
    given = next(iter(complete([unstrained], RASTER, Completion(cutting_speed=4.0))))
    solid = given.material == Material.WORKPIECE
    assert (given.velocity_x[solid] == 4.0).all()
    assert (given.velocity_x[~solid] == 0.0).all()


def frame_of(source, number=0):
    return list(source.frames(RASTER))[number]


def test_without_strain_the_chip_is_the_outline_that_was_given():
    box = ((40e-6, 30e-6), (80e-6, 30e-6), (80e-6, 60e-6), (40e-6, 60e-6))
    source = MovingBlock(("temperature", "velocity_x", "velocity_y"), count=2)
    scene = read_scene(Import(source, completion=Completion(chip=box)))
    frame = scene.frame(1)
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    inside = (x > 40e-6) & (x < 80e-6) & (y > 30e-6) & (y < 60e-6)
    assert np.array_equal(frame.plastic_strain, inside.astype(np.float32))
    assert frame.plastic_strain_rate is None
    assert "chip's outline" in scene.data.attrs["assumed"]


def test_the_tool_of_the_description_is_tool():
    tool = ToolGeometry(rake_angle=0.0)
    raster = Raster(-60e-6, 60e-6, 2e-6, 60, 60)
    fields = {"temperature": np.full(raster.shape, 700.0, np.float32)}
    x, y = np.meshgrid(raster.x, raster.y)
    in_tool = tool.signed_distance(x, y) < 0
    fields["temperature"][in_tool] = np.nan
    material = np.where(in_tool, Material.VOID, Material.WORKPIECE).astype(np.uint8)
    sampled = SampledFrame(0.0, fields, material)
    frame = next(iter(complete([sampled], raster, Completion(tool=tool, surroundings=300.0))))
    assert np.array_equal(frame.material == Material.TOOL, in_tool)
    assert (frame.temperature[in_tool] == 300.0).all()
    assert (frame.quality[in_tool] == FILLED).all()
    assert (frame.temperature[~in_tool] == 700.0).all()


def test_a_tool_that_is_only_drawn_has_the_temperature_of_the_surroundings():
    sampled = frame_of(MovingBlock(WHOLE))
    material = sampled.material.copy()
    material[30:, 30:] = Material.TOOL
    temperature = sampled.fields["temperature"].copy()
    temperature[30:, 30:] = np.nan
    fields = {**sampled.fields, "temperature": temperature}
    drawn = replace(sampled, fields=fields, material=material)
    frame = next(iter(complete([drawn], RASTER, Completion(surroundings=310.0))))
    assert (frame.temperature[30:, 30:] == 310.0).all()
    # One that has temperatures keeps them, and a hole in it takes its neighbours'.
    temperature[30:, 30:] = 500.0
    temperature[40, 40] = np.nan
    frame = next(iter(complete([drawn], RASTER, Completion(surroundings=310.0))))
    assert (frame.temperature[30:, 30:] == 500.0).all()
    assert frame.quality[40, 40] == FILLED


def test_holes_are_filled_from_the_nearest_and_flagged():
    sampled = frame_of(MovingBlock(WHOLE))
    fields = {name: values.copy() for name, values in sampled.fields.items()}
    fields["temperature"][20, 30] = np.nan
    frame = next(iter(complete([replace(sampled, fields=fields)], RASTER, Completion())))
    assert frame.quality[20, 30] == FILLED
    assert (frame.quality == FILLED).sum() == 1
    near = sampled.fields["temperature"][19:22, 29:32]
    assert near.min() <= frame.temperature[20, 30] <= near.max()


def test_a_material_without_temperature_is_refused():
    sampled = frame_of(MovingBlock(WHOLE))
    nothing = {**sampled.fields, "temperature": np.full(RASTER.shape, np.nan, np.float32)}
    with pytest.raises(SceneError, match="temperature is not known in"):
        list(complete([replace(sampled, fields=nothing)], RASTER, Completion()))


@dataclass(frozen=True)
class InMillimetres(MovingBlock):
    """Millimetres that were taken for metres."""

    def survey(self):
        return replace(super().survey(), extent=(0.0, 120.0, 0.0, 100.0), spacing=2.0)


def test_a_size_that_no_chip_has_is_said():
    assert not any(
        "units.length" in text for text in prospect(Import(MovingBlock(WHOLE))).notes.assumed
    )
    (said,) = prospect(Import(InMillimetres(WHOLE))).notes.assumed
    assert "The source is 120 m large" in said


@pytest.mark.parametrize(
    ("source", "wrong"),
    [
        (MovingBlock(("plastic_strain",)), "no field is known as temperature"),
        (MovingBlock(WHOLE, count=0), "has no frame"),
        (MovingBlock(WHOLE, interval=-1e-6), "does not ascend, frame 1 is at -1e-06 s"),
        (MovingBlock(WHOLE, interval=float("nan")), "times are not finite"),
    ],
)
def test_sources_of_which_no_scene_can_be_made(source, wrong):
    with pytest.raises(SourceError, match=wrong):
        prospect(Import(source))


def test_read_elsewhere_is_read_the_same(worker_finds_tests):
    source = MovingBlock(WHOLE)
    here, there = source.survey(), Isolated(source, Sandbox("block")).survey()
    assert (there.kind, there.extent, there.found) == (here.kind, here.extent, here.found)
    assert np.array_equal(there.times, here.times)
    pairs = zip(
        source.frames(RASTER, 3), Isolated(source, Sandbox("block")).frames(RASTER, 3), strict=True
    )
    for one, other in pairs:
        assert one.time == other.time
        assert np.array_equal(one.material, other.material)
        for name in WHOLE:
            assert np.array_equal(one.fields[name], other.fields[name], equal_nan=True)


@pytest.mark.parametrize(
    ("how", "wrong"),
    [
        ("crash", "block: its reader ended with code -6"),
        ("hang", "block: its reader had no answer in 3 s"),
        ("devour", "block: needs more memory than a reader may take"),
        ("refuse", "^block.vtu: frame 2 has no temperature"),
        ("stumble", r"block: cannot be read, .* \(KeyError: 'offset"),
    ],
)
def test_a_reader_that_goes_wrong_leaves_one_error_and_no_file(
    how, wrong, tmp_path, worker_finds_tests
):
    patience = 3.0 if how == "hang" else 120.0
    source = Isolated(Broken(WHOLE, how=how), Sandbox("block", patience, 10**9))
    with pytest.raises(SourceError, match=wrong):
        import_scene(Import(source), tmp_path / "scene.nc")
    assert not list(tmp_path.iterdir())


def test_what_a_library_prints_does_not_mix_with_the_frames(worker_finds_tests):
    source = Broken(WHOLE, how="chatter")
    frames = list(Isolated(source, Sandbox("block")).frames(RASTER))
    assert len(frames) == source.count


def test_an_import_that_was_ended_goes_on_to_the_same_file(tmp_path, monkeypatch):
    monkeypatch.setattr("chipglow.io.importing._CHECKPOINT_INTERVAL", 0.0)
    wanted = Import(MovingBlock(), description={"source": "block"})

    def stop(fraction):
        if fraction > 0.6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as ended:
        import_scene(wanted, tmp_path / "scene.nc", stop)
    assert not (tmp_path / "scene.nc").exists()
    kept = len(unfinished_scenes(tmp_path / "scene.nc")[0].frames()[0])
    assert 0 < kept < 8
    assert str(ended.value) == f"{kept} frames are kept"
    left = kept_import(wanted, prospect(wanted), tmp_path / "scene.nc")
    assert left.progress == kept / 8
    other = replace(wanted, description={"source": "block", "units": "mm"})
    assert kept_import(other, prospect(other), tmp_path / "scene.nc") is None
    fractions = []
    import_scene(wanted, tmp_path / "scene.nc", fractions.append, resume=left)
    assert len(fractions) == 8 - kept
    import_scene(wanted, tmp_path / "whole.nc")
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["scene.nc", "whole.nc"]
    one, other = open_scene(tmp_path / "scene.nc"), open_scene(tmp_path / "whole.nc")
    for a, b in zip(one.frames(), other.frames(), strict=True):
        for name in WHOLE:
            assert np.array_equal(getattr(a, name), getattr(b, name))


READY = "import os; os.write(1, (15).to_bytes(8, 'little') + b'[\"ready\", null]'); "


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import os; os._exit(4)", "ended with code 4"),
        (f"{READY} os.close(0); os._exit(3)", "ended with code 3"),
        (f"{READY} os.write(1, bytes(8)); os.close(0)", "gave no answer"),
    ],
    ids=["no start", "no answer", "other bytes"],
)
def test_a_reader_that_does_not_answer_as_it_should_is_one_error(monkeypatch, program, message):
    monkeypatch.setattr("chipglow.io.sandbox._CHILD", ("-c", program))
    # More than a pipe holds.
    source = MovingBlock(tuple("x" * 1_000_000 for _ in range(2)))
    with pytest.raises(SourceError, match=f"block: its reader {message}"):
        Isolated(source, Sandbox("block")).survey()


def test_nothing_beside_the_data_is_taken_for_a_module(tmp_path, monkeypatch, worker_finds_tests):
    (tmp_path / "json.py").write_text("raise SystemExit(7)")
    monkeypatch.chdir(tmp_path)
    assert Isolated(MovingBlock(WHOLE), Sandbox("block")).survey().found


def a_stack(folder, values, unit="K"):
    np.save(folder / "T.npy", np.broadcast_to(values, (3, 4, 5)))
    units = Units(temperature=CELSIUS) if unit == "degC" else Units()
    grid = GridSource(str(folder / "T.npy"), spacing=5e-6, interval=1e-6, units=units)
    return Import(grid, description={"units": {"temperature": unit}})


@pytest.mark.parametrize(
    ("values", "unit", "said"),
    [
        (np.nan, "K", "T: every value is missing"),
        (np.inf, "K", "T: has infinite numbers"),
        (-5.0, "K", "T: temperature -5 K, expected 200 to 6000 K"),
        (-500.0, "K", "T: temperature -500 K, expected 200 to 6000 K"),
        (25.0, "K", "T: temperature 25 K, expected .* such as degC"),
        (-120.0, "degC", "T: temperature 153.15 K, .*; units.temperature is degC"),
    ],
)
def test_what_no_import_could_take_is_refused_at_the_first_look(tmp_path, values, unit, said):
    with pytest.raises(SourceError, match=said):
        prospect(a_stack(tmp_path, values, unit))


def test_a_source_may_have_a_temperature_in_the_middle_of_its_time_only(tmp_path):
    values = np.full((3, 1, 1), np.nan)
    values[1] = 500.0
    assert prospect(a_stack(tmp_path, values)).survey.temperatures == (500.0, 500.0)


def test_what_is_out_of_view_may_be_colder(tmp_path):
    values = np.full((1, 1, 5), 500.0)
    values[..., 0] = 0.0
    wanted = a_stack(tmp_path, values)
    with pytest.raises(SourceError, match="T: temperature 0 K, expected"):
        prospect(wanted)
    prospect(replace(wanted, view=FieldOfView(left=6e-6)))
