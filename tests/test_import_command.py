"""The command import: its description, what it says, what it writes, what it refuses."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from command import run, settings_of

from chipglow.io import (
    ImportDescription,
    import_text,
    load_import,
    open_scene,
    prospect,
    read_measurement,
)
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.io.sources.movies.movie import MovieSource
from chipglow.io.sources.points.cloud import CloudSource
from chipglow.scene import Material, ToolGeometry

pytestmark = pytest.mark.usefixtures("read_here")


@pytest.fixture
def arrays(tmp_path):
    """Temperature in °C and strain on a grid of 5 um in mm and ms, x against the cut."""
    x, y = np.meshgrid(5e-3 * np.arange(30), 5e-3 * np.arange(20))
    temperature = np.stack([100 + 1000 * x + 500 * y + 10 * t for t in range(4)])
    np.savez(tmp_path / "cut.npz", NT11=temperature, PEEQ=np.full(temperature.shape, 0.8))
    return tmp_path / "cut.npz"


SETTINGS = [
    "fields.temperature=NT11", "units={length: mm, temperature: degC}", "interval=2 us",
    "grid.spacing=5 um", "grid.top_first=false", "completion.cutting_speed=250 m/min",
]  # fmt: skip


def test_a_grid_becomes_a_scene_and_the_command_says_what_it_assumed(arrays, tmp_path):
    out = tmp_path / "scene.nc"
    said = " ".join(run("import", arrays, "--out", out, *settings_of(SETTINGS)).split())
    assert "NT11" in said
    assert "Assumed: Velocity: the cutting speed where the strain is small" in said
    scene = open_scene(out)
    assert list(scene.times) == pytest.approx([0.0, 2e-6, 4e-6, 6e-6])
    frame = scene.frame(3)
    assert (frame.material == Material.WORKPIECE).all()
    # Row 0 of the file is the lowest: 100 + 30 °C, and 0.5 K a sample up the picture.
    assert frame.temperature[-1, 0] == pytest.approx(403.15, abs=0.02)
    assert frame.temperature[0, 0] == pytest.approx(403.15 + 19 * 2.5, abs=0.02)
    assert frame.temperature[-1, 29] == pytest.approx(403.15 + 29 * 5.0, abs=0.02)
    assert "Plastic strain rate: from the change" in scene.data.attrs["assumed"]
    assert "NT11" in scene.data.attrs["import"]


def test_what_the_file_says_is_told_from_what_is_assumed(arrays, tmp_path):
    with h5py.File(tmp_path / "cut.h5", "w") as file:
        file["T"] = np.load(arrays)["NT11"]
        file["T"].attrs["units"] = "degC"
    settings = ["fields.temperature=T", *SETTINGS[2:], "units.length=mm"]
    out = tmp_path / "scene.nc"
    said = run("import", tmp_path / "cut.h5", "--out", out, *settings_of(settings))
    assert "T is in 'degC'.\n" in said
    assert "degC" not in " ".join(said.split("Assumed: ")[1:])
    assert open_scene(out).data.attrs["remarks"] == "T is in 'degC'."


def test_without_out_the_command_only_looks(arrays, tmp_path):
    assert "30 x 20 samples" in run("import", arrays, *settings_of(SETTINGS))
    assert [path.name for path in tmp_path.iterdir()] == ["cut.npz"]


def test_a_description_in_a_file_means_the_same(arrays, tmp_path):
    (tmp_path / "import.yaml").write_text(
        "source: cut.npz\n"
        "fields: {temperature: NT11}\n"
        "units: {length: mm, temperature: degC}\n"
        "interval: 2 us\n"
        "grid: {spacing: 5 um, top_first: false}\n"
        "completion: {cutting_speed: 250 m/min}\n"
    )
    assert load_import(tmp_path / "import.yaml") == load_import(arrays, SETTINGS)
    changed = load_import(tmp_path / "import.yaml", ["interval=1 us"])
    assert changed.interval == pytest.approx(1e-6)


def test_the_view_and_the_placement_say_what_is_sampled(arrays):
    view = "{left: -100 um, right: 0 um, bottom: -20 um, top: 30 um, spacing: 2.5 um}"
    looked = prospect(
        load_import(
            arrays,
            [
                *SETTINGS, f"field_of_view={view}", "placement.horizontal=-x",
                "placement.origin_horizontal=20 um",
            ],
        ).build()
    )  # fmt: skip
    assert looked.raster.extent == pytest.approx((-100e-6, 0.0, -20e-6, 30e-6))
    assert looked.raster.shape == (20, 40)
    # The grid's 0 to 150 um, turned round and with its origin at 20 um.
    assert looked.survey.extent[:2] == pytest.approx((-130e-6, 20e-6))


def test_a_tool_is_drawn_where_the_description_says(arrays, tmp_path):
    out = tmp_path / "scene.nc"
    settings = [*SETTINGS, "tool.rake_angle=0 deg", "placement.origin_horizontal=75 um"]
    run("import", arrays, "--out", out, *settings_of(settings))
    scene = open_scene(out)
    assert isinstance(scene.tool, ToolGeometry)
    raster = scene.raster
    distance = scene.tool.signed_distance(*np.meshgrid(raster.x, raster.y))
    assert np.array_equal(scene.frame(0).material == Material.TOOL, distance < 0)


def test_an_imported_scene_can_be_looked_at(arrays, tmp_path):
    out, study = tmp_path / "scene.nc", tmp_path / "study.yaml"
    study.write_text(
        "camera: {pitch: 15 um, integration_time: 4 us, lower_limit: none}\n"
        "cutting: {window: {interval: 1 us}}\n"
    )
    run("import", arrays, "--out", out, *settings_of(SETTINGS))
    measured = tmp_path / "m.nc"
    said = run("measure", out, "--study", study, "--out", measured)
    assert "textures move with the mean velocity" in " ".join(said.split())
    seen = read_measurement(measured).radiance_temperature()[0]
    # The strain of 0.8 makes all of it chip, of an emissivity under 1: it looks colder than it is.
    assert 300.0 < np.nanmean(seen) < open_scene(out).frame(0).temperature.mean()


def test_movies_are_described_field_by_field(tmp_path):
    description = load_import(
        "t.avi",
        [
            "movie.temperature={first: 20 degC, last: 1127 degC, colours: jet}",
            "movie.plastic_strain={file: e.avi, first: 0, last: 4, legend: [600, 40, 620, 400]}",
            "movie.scale_from=[0, 0]",
            "movie.scale_to=[300, 400]",
            "movie.scale_length=1 mm",
        ],
    )
    source = description.build().source.source
    assert isinstance(source, MovieSource)
    assert source._sides == pytest.approx((2e-6, 2e-6))
    assert source.temperature.ends("temperature") == pytest.approx((293.15, 1400.15))
    assert source.temperature.colours == "jet"
    assert source.plastic_strain.legend == (600, 40, 620, 400)
    assert Path(source.plastic_strain.file).name == "e.avi"


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("a.nc", "", "grid"),
        ("a.mat", "", "grid"),
        ("points.csv", "x,y,temperature\n0,0,300\n", "points"),
        ("grid.csv", "300,3.1e2\n310,nan\n", "grid"),
    ],
)
def test_the_kind_is_told_by_the_name_or_the_head_of_a_table(tmp_path, name, text, kind):
    (tmp_path / name).write_text(text)
    assert load_import(tmp_path / name).kind_of_source() == kind


def test_the_kind_that_is_said_comes_before_the_name(arrays, tmp_path):
    path = tmp_path / "import.yaml"
    path.write_text("source: cut.npz\nkind: points\nfields: {temperature: NT11}\n")
    assert isinstance(load_import(path).build().source.source, CloudSource)
    assert isinstance(load_import(path, ["kind=mesh"]).build().source.source, MeshSource)
    assert "kind: points" in import_text(load_import(path)).splitlines()


def test_a_movie_needs_no_source_beside_its_section(tmp_path):
    path = tmp_path / "import.yaml"
    path.write_text(
        "kind: movie\n"
        "movie: {temperature: {file: disc.avi, first: 80 degC, last: 600 degC,\n"
        "  colours: jet}, pixel: 1 mm}\n"
    )
    source = load_import(path).build().source.source
    assert source.files == str(tmp_path / "disc.avi")


def test_samples_filled_in_a_middle_frame_are_warned_about(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    for number in range(4):
        grid = pyvista.ImageData(dimensions=(31, 21, 1), spacing=(5e-3, 5e-3, 1.0))
        temperature = 100 + 1000 * grid.points[:, 0] + 10.0 * number
        if number == 2:
            temperature[np.hypot(*(grid.points[:, :2] - [0.075, 0.05]).T) < 0.02] = np.nan
        grid["NT11"] = temperature
        grid.cast_to_unstructured_grid().save(tmp_path / f"cut_{number}.vtu")
    out = tmp_path / "scene.nc"
    settings = [one for one in SETTINGS if not one.startswith("grid.")]
    settings.append("field_of_view.spacing=5 um")
    said = " ".join(
        run("import", tmp_path / "cut_*.vtu", "--out", out, *settings_of(settings)).split()
    )
    filled = open_scene(out).filled()
    assert filled[2] > 0.01 and not filled[[0, 1, 3]].any()
    assert f"In 1 of 4 frames up to {100 * filled[2]:.2g} % of the samples with material" in said


def test_missing_samples_in_a_middle_frame_are_said(tmp_path):
    image = 300.0 + np.arange(48.0).reshape(6, 8) ** 1.5
    for number in range(3):
        cells = [[f"{kelvin:.2f}" for kelvin in row] for row in image]
        if number == 1:
            cells[2][3] = "---"
        (tmp_path / f"t_{number}.csv").write_text("\n".join(map(";".join, cells)))
    settings = ["grid.spacing=5 um", "interval=1 us"]
    out = tmp_path / "scene.nc"
    said = run("import", tmp_path / "t_*.csv", "--out", out, *settings_of(settings))
    assert "In 1 of 3 frames up to 2.1 % of the samples have no temperature" in said


def test_the_description_that_init_writes_says_every_field_and_is_read_back(arrays, tmp_path):
    path = tmp_path / "import.yaml"
    run("init", path, "--import")
    assert load_import(path) == ImportDescription()
    assert "# Units of the source" in path.read_text()
    assert "# Kind of the source" in path.read_text()
    path.write_text(path.read_text().replace("source: none", "source: cut.npz", 1))
    assert load_import(path).source == str(arrays)


def test_an_hdf5_file_of_vtk_is_a_mesh(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.ImageData(dimensions=(4, 4, 1)).cast_to_unstructured_grid()
    grid["temperature"] = np.linspace(300.0, 400.0, 16)
    grid.save(tmp_path / "mesh.vtkhdf")
    for name in ("mesh.hdf", "mesh.h5"):
        path = tmp_path / name
        path.write_bytes((tmp_path / "mesh.vtkhdf").read_bytes())
        wanted = load_import(path, ["units.length=mm"])
        assert wanted.kind_of_source() == "mesh"
        assert prospect(wanted.build()).survey.kind == "mesh, 1 file of VTK HDF"


def test_files_of_settings_are_beside_the_shell_and_those_of_a_file_beside_it(
    tmp_path, monkeypatch
):
    (tmp_path / "camera").mkdir()
    described = tmp_path / "camera" / "import.yaml"
    described.write_text("source: cut.npz\ntool: none\n")
    (tmp_path / "edge.csv").write_text("x_um,y_um\n0,100\n0,0\n100,10\n")
    monkeypatch.chdir(tmp_path)
    wanted = load_import(described, ["tool.outline=edge.csv"])
    assert wanted.source == str(tmp_path / "camera" / "cut.npz")
    assert wanted.tool.outline == str(tmp_path / "edge.csv")


def test_units_that_follow_from_others_are_said(arrays, tmp_path):
    np.savez(tmp_path / "v.npz", T=np.full((4, 6), 300.0), vx=np.ones((4, 6)))
    settings = ["grid.spacing=5 um", "units={length: mm, time: us}"]
    looked = prospect(load_import(tmp_path / "v.npz", settings).build())
    assert "Velocities are in mm/us, by units.length and units.time." in looked.notes.assumed
    given = load_import(tmp_path / "v.npz", [*settings, "units.velocity=m/s"])
    assert not any("Velocities" in said for said in prospect(given.build()).notes.assumed)


def test_corners_of_the_chip_are_read_and_written_as_they_are(arrays, tmp_path):
    chip = "completion.chip=[[-300 um, 0 um], [-50 um, 0 um], [-50 um, 400 um]]"
    described = load_import(arrays, [*SETTINGS, chip])
    assert described.completion.chip == ((-3e-4, 0.0), (-5e-5, 0.0), (-5e-5, 4e-4))
    (tmp_path / "again.yaml").write_text(import_text(described))
    assert load_import(tmp_path / "again.yaml").completion == described.completion


@pytest.mark.parametrize(
    ("settings", "wrong"),
    [
        (["units.length=degC"], "units.length: unknown unit 'degC'"),
        (["units.length=3"], "units.length"),
        (["interval=2"], "interval: 2 has no unit"),
        (["interval=-2 us"], "interval: -2 us must be more than 0"),
        (["fields.temperature=T"], "there is no field 'T', it has NT11, PEEQ"),
        (["fields.colour=NT11"], "fields: unknown 'colour'"),
        (["colour=NT11"], "unknown key 'colour'"),
        (["placement.vertical=x"], "vertical: 'x' is the horizontal axis too"),
        (["kind=sound"], "kind: 'sound'"),
        (["completion.rate_frames=0"], "rate_frames: 0, expected 1 to 20"),
        (["field_of_view.left=1 mm", "field_of_view.right=2 mm"], "nothing of which is in view"),
        (["field_of_view={left: 1 mm, right: 0 mm}"], "right: 0 m, expected more than left"),
        (["field_of_view.spacing=1 nm"], "a larger spacing makes fewer"),
        (["=3"], "--set =3: expected FIELD=VALUE"),
        (["grid"], "--set grid: expected FIELD=VALUE"),
        (["grid=[1"], "--set grid=[1: "),
        (["grid=!!python/object/apply:os.getcwd []"], "could not determine a constructor"),
    ],
)
def test_what_cannot_be_is_one_line(arrays, tmp_path, settings, wrong):
    out = tmp_path / "scene.nc"
    said = run("import", arrays, "--out", out, *settings_of([*SETTINGS, *settings]), code=2)
    assert wrong in said
    assert len(said.splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("name", "content", "wrong"),
    [
        ("nothing.nc", None, "nothing.nc"),
        ("notes.docx", b"text", "kind: 'notes.docx', expected"),
        ("empty.npz", b"", "empty.npz"),
        ("import.yaml", b"source: [", "import.yaml"),
        ("import.yaml", b"fields: {}", "source: is missing"),
        ("import.yaml", b"- a list", "is not a section"),
    ],
)
def test_what_is_no_source_is_one_line(tmp_path, name, content, wrong):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    said = run("import", tmp_path / name, code=2)
    assert wrong in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("name", ["loop.npz", "loop.vtu", "loop.csv", "loop.avi"])
def test_a_link_to_itself_is_one_error(tmp_path, name):
    (tmp_path / name).symlink_to(tmp_path / name)
    said = run("import", tmp_path / name, *settings_of(["movie.pixel=1 um"]), code=2)
    assert name in said.replace("\n", "")


def test_a_link_is_judged_by_its_own_name(arrays, tmp_path):
    arrays.rename(tmp_path / "blob.0001")
    (tmp_path / "link.npz").symlink_to("blob.0001")
    said = run("import", tmp_path / "link.npz", *settings_of(SETTINGS))
    assert "link.npz" in said.replace("\n", "")  # a long path goes over two lines
