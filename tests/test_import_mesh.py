import pickle
import sys
from contextlib import chdir

import numpy as np
import pytest
from cgns_file import write_cgns
from exodus_file import write_exodus
from foam_case import write_foam
from plane_mesh import HEIGHT, RASTER, WIDTH, X, Y, only_frame, temperature
from tolerances import SINGLE

from chipglow.io.importing import Import, prospect
from chipglow.io.sandbox import Isolated, Sandbox
from chipglow.io.sources import Placement, SourceError, Units
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.quantities.units import CELSIUS, Unit, parse_unit
from chipglow.scene import Material, Raster

pv = pytest.importorskip("pyvista")
meshio = pytest.importorskip("meshio")

VOID, WORKPIECE, TOOL = Material.VOID, Material.WORKPIECE, Material.TOOL


def grid_of(shape="quad", count=(9, 6), at=0.0, scale=1.0, depth=None, shift=0.0):
    """A block of elements with a linear temperature, a strain of elements and a velocity."""
    nx, ny = count
    z = np.array([0.0]) if depth is None else np.linspace(0.0, depth, 4)
    x, y, z = np.meshgrid(np.linspace(0, WIDTH, nx + 1), np.linspace(0, HEIGHT, ny + 1), z)
    grid = pv.StructuredGrid(x, y, z).cast_to_unstructured_grid()
    if shape == "triangle":
        grid = grid.extract_surface(algorithm=None).triangulate().cast_to_unstructured_grid()
    points = np.array(grid.points)
    grid.points = points * scale
    grid.points[:, 0] += shift * scale
    grid.point_data["NT11"] = (
        temperature(points[:, 0] + shift, points[:, 1], at) + points[:, 2] * 1e5
    )
    grid.point_data["V"] = np.tile((3.0, 1.0, 2.0), (len(points), 1))
    grid.cell_data["PEEQ"] = np.arange(grid.n_cells) / grid.n_cells
    return grid


def check_linear(frame, at=0.0, offset=0.0, inside=None):
    expected = temperature(X, Y, at) + offset
    inside = np.ones_like(X, bool) if inside is None else inside
    found = frame.fields["temperature"]
    # float32: 24 bits of 1000 K.
    np.testing.assert_allclose(found[inside], expected[inside], atol=2e-4)
    assert np.isnan(found[~inside]).all()
    np.testing.assert_array_equal(frame.material, np.where(inside, WORKPIECE, VOID))


@pytest.mark.parametrize("shape", ["quad", "triangle"])
@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".vtp"])
def test_fields_of_nodes_are_exact_and_those_of_elements_constant(tmp_path, shape, suffix):
    path = tmp_path / f"chip{suffix}"
    grid = grid_of(shape)
    (grid.extract_surface(algorithm=None) if suffix == ".vtp" else grid).save(path)
    source = MeshSource(path)
    survey = survey_of(source)
    assert survey.found == {
        "temperature": "NT11", "plastic_strain": "PEEQ", "velocity_x": "V", "velocity_y": "V",
    }  # fmt: skip
    assert survey.extent == pytest.approx((0.0, WIDTH, 0.0, HEIGHT))
    frame = only_frame(source)
    check_linear(frame)
    assert (frame.fields["velocity_x"] == 3.0).all()
    assert (frame.fields["velocity_y"] == 1.0).all()
    strain = frame.fields["plastic_strain"]
    assert set(np.unique(strain)) == set(grid.cell_data["PEEQ"].astype(np.float32))


def survey_of(source):
    """Sources go to another process and back."""
    return pickle.loads(pickle.dumps(source)).survey()


QUADRATIC = {
    22: [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)],
    23: [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)],
}
QUADRATIC[28] = [*QUADRATIC[23], (0.5, 0.5)]


@pytest.mark.parametrize("kind", QUADRATIC)
def test_curved_elements_meet_without_a_gap_and_are_not_taken_for_linear(tmp_path, kind):
    inside = np.array(QUADRATIC[kind], float)
    inside = np.stack((inside, 1.0 - inside) if kind == 22 else (inside,))
    corners = np.stack(np.meshgrid(np.arange(3), np.arange(3)), -1).reshape(-1, 1, 1, 2)
    every = np.round((corners + inside) / 3, 12).reshape(-1, 2)
    points, number = np.unique(every, axis=0, return_inverse=True)
    cells = number.reshape(-1, inside.shape[1])
    edge = ((points == 0) | (points == 1)).any(axis=1)
    bent = np.where(edge[:, None], points, points + 0.02 * np.sin(7.0 * points[:, ::-1]))
    grid = pv.UnstructuredGrid({kind: cells}, np.pad(bent, ((0, 0), (0, 1))))
    grid.point_data["temperature"] = 300.0 + 1000.0 * bent[:, 0] ** 2
    grid.cell_data["PEEQ"] = np.arange(len(cells)) / len(cells)
    grid.save(tmp_path / "bent.vtu")
    raster = Raster(0.0, 1.0, 1 / 150, 150, 150)  # some of its samples are on edges
    frame = only_frame(MeshSource(tmp_path / "bent.vtu"), raster)
    assert (frame.material == WORKPIECE).all()
    error = np.abs(frame.fields["temperature"] - 300.0 - 1000.0 * raster.x**2)
    # Pieces of a quarter of an element are f'' h^2 / 128 off, 1.7 K, and their edges are straight;
    # linear elements would be 28 K off.
    assert error.max() < 5.0
    assert len(np.unique(frame.fields["plastic_strain"])) == len(cells)


@pytest.mark.parametrize("position", [0.0, 1e-4, 1.7e-4, 3e-4])
def test_a_cut_through_a_solid_mesh_is_exact(tmp_path, position):
    grid_of(depth=3e-4).save(tmp_path / "solid.vtu")
    frame = only_frame(MeshSource(tmp_path / "solid.vtu", section=position))
    check_linear(frame, offset=position * 1e5)
    assert (frame.fields["velocity_x"] == 3.0).all()
    assert np.unique(frame.fields["plastic_strain"]).size == 54


@pytest.mark.parametrize(
    ("placement", "offset"), [(Placement(), 30.0), (Placement(horizontal="-x"), 0.0)]
)
def test_facing_shows_the_side_toward_the_camera(tmp_path, placement, offset):
    grid_of(depth=3e-4).save(tmp_path / "solid.vtu")
    raster = RASTER
    mirrored = placement.signs[0] < 0
    if mirrored:
        raster = Raster(-WIDTH, HEIGHT, RASTER.spacing, RASTER.rows, RASTER.columns)
    source = MeshSource(tmp_path / "solid.vtu", section="facing", placement=placement)
    found = only_frame(source, raster).fields["temperature"]
    expected = temperature(X, Y) + offset
    # Linear within each cell: rounding.
    np.testing.assert_allclose(found, expected[:, ::-1] if mirrored else expected, atol=1e-9)


@pytest.mark.parametrize("section", [None, -1e-4, 4e-4])
def test_a_solid_mesh_needs_a_section_that_cuts_it(tmp_path, section):
    grid_of(depth=3e-4).save(tmp_path / "solid.vtu")
    with pytest.raises(
        SourceError, match=r"solid\.vtu: mesh\.section: n.*along z from 0 m to 0\.0003 m"
    ):
        MeshSource(tmp_path / "solid.vtu", section=section).survey()


def test_units_and_placement(tmp_path):
    grid = grid_of(scale=1e3)
    grid.point_data["NT11"] -= 273.15
    grid.points = grid.points[:, (1, 2, 0)]
    grid.point_data["V"] = grid.point_data["V"][:, (1, 2, 0)] * 1e3
    grid.save(tmp_path / "mm.vtu")
    source = MeshSource(
        tmp_path / "mm.vtu",
        units=Units(length=Unit(1e-3), temperature=CELSIUS),
        placement=Placement(horizontal="-z", vertical="x", origin_horizontal=WIDTH),
    )
    assert source.survey().extent == pytest.approx((0.0, WIDTH, 0.0, HEIGHT))
    frame = only_frame(source)
    found = frame.fields["temperature"][:, ::-1]
    # Linear within each cell: rounding.
    np.testing.assert_allclose(found, temperature(X, Y), atol=1e-9)
    np.testing.assert_allclose(frame.fields["velocity_x"], -3.0, rtol=SINGLE)
    np.testing.assert_allclose(frame.fields["velocity_y"], 1.0, rtol=SINGLE)


@pytest.mark.parametrize(
    ("label", "given", "kelvins", "said"),
    [
        ("Temperature [C]", None, 400.0 + 273.15, "is in 'C'."),
        ("NT11 (degC)", None, 400.0 + 273.15, "is in 'degC'."),
        ("T (K)", None, 400.0, ""),
        ("Temperature [degF]", None, (400.0 + 459.67) / 1.8, "is in 'degF'."),
        ("temp (1)", None, 400.0, "temp (1) is in K: the file states no unit."),
        ("NT11", None, 400.0, "NT11 is in K: the file states no unit."),
        ("NT11", "degC", 400.0 + 273.15, ""),
        ("T (K)", "degC", 400.0 + 273.15, "T (K) is in 'K'; the given unit is used instead."),
        ("T_C", None, 400.0 + 273.15, "is in 'C'."),
        ("T_K", None, 400.0, ""),
        ("T_K", "degC", 400.0 + 273.15, "the given unit is used instead."),
        ("T_chip", None, 400.0, "T_chip is in K: the file states no unit."),
        ("Temperature (avg)", None, "unknown unit 'avg' of temperature", ""),
        ("Temperature (avg)", "K", 400.0, "the given unit is used instead."),
    ],
)
def test_a_unit_in_the_name_of_a_field(tmp_path, label, given, kelvins, said):
    grid = grid_of()
    del grid.point_data["NT11"]
    grid.point_data[label] = np.full(grid.n_points, 400.0)
    grid.save(tmp_path / "chip.vtu")
    units = Units(temperature=parse_unit(given, "K", "temperature") if given else None)
    source = MeshSource(tmp_path / "chip.vtu", units=units, names={"temperature": label})
    if isinstance(kelvins, str):
        with pytest.raises(SourceError, match=kelvins):
            source.survey()
        return
    # Float32 of 670 K: 3e-5 K.
    assert only_frame(source).fields["temperature"][30, 40] == pytest.approx(kelvins, abs=1e-4)
    notes = source.survey().notes
    said_of = (*notes.assumed, *notes.warnings, *notes.remarks)
    about = [text for text in said_of if text.startswith(label)]
    assert [said in text for text in about] == ([True] if said else [])


@pytest.mark.parametrize(
    ("label", "ours", "factor"),
    [
        ("PEEQ (Avg: 75%)", "plastic_strain", 1.0),
        ("PEEQ [%]", "plastic_strain", 0.01),
        ("ERPEQ [1/ms]", "plastic_strain_rate", 1000.0),
        ("V1 (mm/s)", "velocity_x", 1e-3),
    ],
)
def test_units_in_names_of_other_fields(tmp_path, label, ours, factor):
    grid = grid_of()
    del grid.point_data["V"], grid.cell_data["PEEQ"]
    grid.point_data[label] = np.full(grid.n_points, 40.0)
    grid.point_data["V2"] = np.zeros(grid.n_points)
    grid.save(tmp_path / "chip.vtu")
    frame = only_frame(MeshSource(tmp_path / "chip.vtu"))
    assert frame.fields[ours][30, 40] == pytest.approx(40.0 * factor)


def test_the_surface_of_a_solid_is_not_taken_for_a_flat_mesh(tmp_path):
    surface = grid_of(depth=3e-4).extract_surface(algorithm=None)
    surface.save(tmp_path / "chip.vtp")
    with pytest.raises(SourceError, match=r"flat elements that extend over 0\.0003 m along z, exp"):
        MeshSource(tmp_path / "chip.vtp").survey()
    frame = only_frame(MeshSource(tmp_path / "chip.vtp", section="facing"))
    check_linear(frame, offset=30.0)


def test_components_of_velocity_are_taken_along_their_axes_only(tmp_path):
    grid = grid_of()
    grid.rename_array("V", "other")
    grid.point_data["V1"], grid.point_data["V2"] = 3.0, 1.0
    grid.save(tmp_path / "chip.vtu")
    frame = only_frame(MeshSource(tmp_path / "chip.vtu", placement=Placement("-x", "y", WIDTH)))
    assert (frame.fields["velocity_x"] == -3.0).all()
    assert (frame.fields["velocity_y"] == 1.0).all()
    grid.points = grid.points[:, (0, 2, 1)]
    grid.save(tmp_path / "chip.vtu")
    found = MeshSource(tmp_path / "chip.vtu", placement=Placement("x", "z")).survey().found
    assert set(found) == {"temperature", "plastic_strain"}


def test_a_moving_and_remeshed_series_has_void_where_nothing_is(tmp_path):
    for number, count in enumerate([(9, 6), (4, 5), (30, 7)]):
        grid_of(count=count, at=number, shift=number * 1e-4).save(tmp_path / f"chip_{number}.vtu")
    source = MeshSource(tmp_path / "chip_*.vtu", interval=2e-6)
    survey = source.survey()
    np.testing.assert_allclose(survey.times, [0.0, 2e-6, 4e-6])
    assert survey.extent == pytest.approx((0.0, WIDTH + 2e-4, 0.0, HEIGHT))
    frames = list(source.frames(RASTER))
    for number, frame in enumerate(frames):
        assert frame.time == pytest.approx(number * 2e-6)
        check_linear(frame, at=number, inside=number * 1e-4 < X)
    (later,) = source.frames(RASTER, start=2)
    np.testing.assert_array_equal(later.material, frames[2].material)


def test_times_of_files_are_taken_and_what_is_assumed_is_said(tmp_path):
    for number in range(3):
        grid = grid_of()
        grid.save(tmp_path / f"plain_{number}.vtu")
        grid.field_data["TimeValue"] = [number * 0.25]
        grid.save(tmp_path / f"timed_{number}.vtu")
    plain, timed = (
        MeshSource(tmp_path / f"{name}_*.vtu", units=Units(time=Unit(1e-3)))
        for name in ("plain", "timed")
    )
    assert timed.survey().times.tolist() == pytest.approx([0.0, 2.5e-4, 5e-4])
    assert any("1 s apart" in sentence for sentence in plain.survey().notes.assumed)
    assert not any("1 s apart" in sentence for sentence in timed.survey().notes.assumed)


def two_blocks():
    chip, tool = grid_of(), grid_of(shift=WIDTH)
    tool.cell_data.remove("PEEQ")
    return chip, tool


WIDE = Raster(left=0.0, top=HEIGHT, spacing=20e-6, rows=30, columns=90)


def check_two(frame):
    right = np.broadcast_to(np.arange(90) >= 45, WIDE.shape)
    np.testing.assert_array_equal(frame.material, np.where(right, TOOL, WORKPIECE))
    assert not np.isnan(frame.fields["temperature"]).any()
    np.testing.assert_array_equal(np.isnan(frame.fields["plastic_strain"]), right)


def test_a_block_by_its_name_is_the_tool(tmp_path):
    chip, tool = two_blocks()
    pv.MultiBlock({"chip": chip, "insert": tool}).save(tmp_path / "both.vtm")
    check_two(only_frame(MeshSource(tmp_path / "both.vtm", tool_parts=("insert",)), WIDE))


@pytest.mark.parametrize(("name", "given"), [("PartId", None), ("colour", "colour")])
def test_a_number_of_a_field_of_parts_is_the_tool(tmp_path, name, given):
    chip, tool = two_blocks()
    tool.cell_data["PEEQ"] = np.full(tool.n_cells, np.nan)
    chip.cell_data[name], tool.cell_data[name] = 3, 7
    chip.merge(tool, merge_points=False).save(tmp_path / "both.vtu")
    source = MeshSource(tmp_path / "both.vtu", tool_parts=("7",), part_field=given)
    check_two(only_frame(source, WIDE))


def test_values_of_integration_points_are_averaged(tmp_path):
    grid = grid_of()
    grid.cell_data["PEEQ"] = np.stack([np.full(grid.n_cells, k) for k in (1.0, 2.0, 3.0, 6.0)], 1)
    grid.save(tmp_path / "chip.vtu")
    source = MeshSource(tmp_path / "chip.vtu")
    assert (only_frame(source).fields["plastic_strain"] == 3.0).all()
    assert any("PEEQ has 4 values" in sentence for sentence in source.survey().notes.assumed)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"tool_parts": ("tip",)}, "'tip'.*it has none"),
        ({"section": 0.0}, r"mesh\.section: .*flat"),
        ({"names": {"plastic_strain": "strain"}}, "'strain' has 6 components"),
        ({"names": {"velocity": "NT11"}}, "velocity: 'NT11' has 1 components"),
        ({"names": {"temperature": "TEMP"}}, "fields: .*no field 'TEMP'"),
        ({"times": (0.0, 1.0)}, "2 for 1 frames"),
        ({"displacement": "U"}, "no node has 'U'"),
        ({"displacement": "NT11"}, "'NT11' is not a vector"),
    ],
)
def test_what_does_not_fit_a_file_is_refused(tmp_path, changed, said):
    grid = grid_of()
    grid.cell_data["strain"] = np.ones((grid.n_cells, 6))
    grid.save(tmp_path / "chip.vtu")
    with pytest.raises(SourceError, match=rf"chip\.vtu: .*{said}"):
        MeshSource(tmp_path / "chip.vtu", **changed).survey()
    with pytest.raises(SourceError, match="not a mesh, expected"):
        MeshSource(tmp_path / "chip.doc").survey()


def test_deleted_elements_are_void(tmp_path):
    grid = grid_of()
    grid.cell_data["STATUS"] = (np.asarray(grid.cell_centers().points[:, 0]) < 5e-4).astype(float)
    grid.save(tmp_path / "chip.vtu")
    source = MeshSource(tmp_path / "chip.vtu")
    check_linear(only_frame(source), inside=X < 5e-4)
    assert survey_of(source).notes.remarks == ["Elements whose STATUS is 0 are deleted."]


def test_a_displacement_is_added_if_it_is_named(tmp_path):
    grid = grid_of()
    grid.point_data["U"] = np.tile((1e-4, 0.0, 0.0), (grid.n_points, 1))
    grid.save(tmp_path / "chip.vtu")
    still, moved = (MeshSource(tmp_path / "chip.vtu", displacement=name) for name in (None, "U"))
    assert still.survey().extent[0] == 0.0
    assert any("U is not added" in sentence for sentence in still.survey().notes.assumed)
    assert moved.survey().extent[:2] == pytest.approx((1e-4, WIDTH + 1e-4))


def test_a_collection_whose_file_is_missing(tmp_path):
    part = '<DataSet timestep="0" part="0" file="part2.vtu"/>'
    text = f'<VTKFile type="Collection" version="0.1"><Collection>{part}</Collection></VTKFile>'
    (tmp_path / "chip.pvd").write_text(text)
    with pytest.raises((SourceError, FileNotFoundError), match="part2"):
        MeshSource(tmp_path / "chip.pvd").survey()


def test_tecplot_zones_of_many_times_blocks_and_cell_values(tmp_path):
    x, y = np.meshgrid(np.linspace(0, WIDTH, 4), np.linspace(0, HEIGHT, 3))
    text = 'TITLE = "chip"\n# by hand\nVARIABLES = "X" "Y"\n"Temperature [K]", "Strain"\n'
    for time in (2.0, 0.5):
        text += 'ZONE T="chip", ZONETYPE=FETRIANGLE,\n NODES=4 ELEMENTS=2, DATAPACKING=BLOCK\n'
        text += f" VARLOCATION=([4]=CELLCENTERED), SOLUTIONTIME={time} STRANDID=1\n"
        text += f"0 {WIDTH} {WIDTH} 0\n0 0 {HEIGHT} {HEIGHT}\n"
        text += " ".join(str(temperature(a, b, time)) for a, b in
                         ((0, 0), (WIDTH, 0), (WIDTH, HEIGHT), (0, HEIGHT)))  # fmt: skip
        text += "\n# strain\n1.0 2.0\n1 2 3\n1 3 4\n"
        text += f'ZONE T="tool", I=4, J=3, F=POINT, SOLUTIONTIME={time}\n'
        rows = zip(x.ravel() + WIDTH, y.ravel(), strict=True)
        text += "".join(f"{a} {b} {temperature(a, b, time)} 0\n" for a, b in rows)
    (tmp_path / "chip.tec").write_text(text)
    source = MeshSource(tmp_path / "chip.tec", tool_parts=("tool",))
    assert survey_of(source).times.tolist() == [0.5, 2.0]
    wide = np.broadcast_to(WIDE.x, WIDE.shape)
    for time, frame in zip((0.5, 2.0), source.frames(WIDE), strict=True):
        expected = temperature(*np.meshgrid(WIDE.x, WIDE.y), time)
        # Linear within each cell: rounding.
        np.testing.assert_allclose(frame.fields["temperature"], expected, atol=1e-9)
        np.testing.assert_array_equal(frame.material == TOOL, wide > WIDTH)
        assert set(np.unique(frame.fields["plastic_strain"])) == {0.0, 1.0, 2.0}


def test_cgns_with_values_of_nodes_and_of_elements(tmp_path):
    grid = grid_of()
    speed = {f"Velocity{axis}": grid.point_data["V"][:, k] for k, axis in enumerate("XYZ")}
    of_nodes = {"Temperature": grid.point_data["NT11"], **speed}
    path = tmp_path / "chip.cgns"
    of_elements = {"PEEQ": grid.cell_data["PEEQ"]}
    write_cgns(path, grid.points, grid.cells_dict[9], of_nodes, of_elements)
    frame = only_frame(MeshSource(path))
    check_linear(frame)
    np.testing.assert_allclose(frame.fields["velocity_x"], 3.0)
    np.testing.assert_allclose(frame.fields["velocity_y"], 1.0)
    assert len(np.unique(frame.fields["plastic_strain"])) == grid.n_cells


def d3plot(folder, count=3):
    lasso = pytest.importorskip("lasso.dyna")
    grid = grid_of()
    points = np.asarray(grid.points, np.float32)
    quads = grid.cells_dict[9]
    plot = lasso.D3plot()
    arrays = plot.arrays
    arrays["node_coordinates"] = points
    arrays["timesteps"] = np.arange(count, dtype=np.float32) * 0.5
    shift = np.array([(k * 1e-4, 0, 0) for k in range(count)], np.float32)
    arrays["node_displacement"] = points[None] + shift[:, None, :]
    arrays["node_velocity"] = np.tile(np.float32((3.0, 1.0, 2.0)), (count, len(points), 1))
    arrays["node_temperature"] = np.stack(
        [temperature(points[:, 0] + k * 1e-4, points[:, 1]) for k in range(count)]
    ).astype(np.float32)
    arrays["element_shell_node_indexes"] = quads
    right = np.asarray(grid.cell_centers().points[:, 0]) > 0.5 * WIDTH
    arrays["element_shell_part_indexes"] = right.astype(np.int32)
    strain = np.tile(np.float32([1.0, 2.0, 6.0]), (count, len(quads), 1))
    arrays["element_shell_effective_plastic_strain"] = strain
    plot.write_d3plot(str(folder / "d3plot"))
    return folder / "d3plot"


def test_a_d3plot_moves_and_its_layers_are_averaged(tmp_path):
    source = MeshSource(d3plot(tmp_path))
    survey = survey_of(source)
    assert survey.found["plastic_strain"] == "effective_plastic_strain"
    assert survey.times.tolist() == [0.0, 0.5, 1.0]
    for number, frame in enumerate(source.frames(RASTER)):
        check_linear(frame, inside=number * 1e-4 < X)
        inside = frame.material > 0
        assert (frame.fields["plastic_strain"][inside] == 3.0).all()
        assert (frame.fields["velocity_x"][inside] == 3.0).all()
    (last,) = source.frames(RASTER, start=2)
    assert last.time == 1.0
    assert (last.material[:, :10] == VOID).all()
    with_tool = next(MeshSource(source.files, tool_parts=("2",)).frames(RASTER))
    assert (with_tool.material[:, 45:] == TOOL).any()
    assert (with_tool.material[:, :40] == WORKPIECE).all()


DECK = """*HEADING
** a chip
*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=CPE4RT, ELSET=CHIP
{chip}
*ELEMENT, TYPE=CPE3T, ELSET=INSERT
{tool}
*ELSET, ELSET=HARD
INSERT
*MATERIAL, NAME=STEEL
*DENSITY
7850.,
"""


def abaqus(folder, tables=("",)):
    """Labels begin at 101 and have gaps, as those of Abaqus may."""
    grid = grid_of()
    quads = grid.cells_dict[9]
    right = grid.points[quads][:, :, 0].mean(axis=1) > 6e-4
    label = lambda node: 101 + 2 * node  # noqa: E731
    nodes = [f"{label(k)}, {p[0]:.9g}, {p[1]:.9g}" for k, p in enumerate(grid.points)]
    chip = [f"{1 + k}, " + ", ".join(str(label(n)) for n in q) for k, q in enumerate(quads[~right])]
    triangles = [t for q in quads[right] for t in (q[[0, 1, 2]], q[[0, 2, 3]])]
    tool = [f"{501 + k}, " + ", ".join(str(label(n)) for n in t) for k, t in enumerate(triangles)]
    text = DECK.format(nodes="\n".join(nodes), chip="\n".join(chip), tool="\n".join(tool))
    (folder / "chip.inp").write_text(text)
    for number, table in enumerate(tables):
        values = temperature(grid.points[:, 0], grid.points[:, 1], number)
        rows = [f"{label(k)}, {value:.9g}, 0.0" for k, value in enumerate(values)]
        (folder / f"chip{table}_nodes.csv").write_text("\n".join(["node, NT11, U1", *rows[::-1]]))
        rows = [f"{1 + k}, {value}" for k in range(int((~right).sum())) for value in (1, 2, 3, 6)]
        (folder / f"chip{table}_elements.csv").write_text("\n".join(["element,PEEQ", *rows]))
    return folder / "chip.inp"


def test_an_abaqus_input_with_tables(tmp_path):
    path = abaqus(tmp_path, ("_8", "_9", "_10"))
    source = MeshSource(path, tool_parts=("HARD",))
    assert set(survey_of(source).found) == {"temperature", "plastic_strain"}
    frames = list(source.frames(RASTER))
    assert len(frames) == 3
    hard = X > 6e-4
    for number, frame in enumerate(frames):
        # Linear within each cell: rounding.
        np.testing.assert_allclose(
            frame.fields["temperature"], temperature(X, Y, number), atol=1e-9
        )
        np.testing.assert_array_equal(frame.material, np.where(hard, TOOL, WORKPIECE))
        assert (frame.fields["plastic_strain"][~hard] == 3.0).all()
        assert np.isnan(frame.fields["plastic_strain"][hard]).all()


def test_labels_without_a_row_are_counted(tmp_path):
    path = abaqus(tmp_path, ("_1", "_2"))
    table = tmp_path / "chip_2_nodes.csv"
    rows = table.read_text().split("\n")
    table.write_text("\n".join([*rows[:3], *rows[5:]]))
    said = survey_of(MeshSource(path)).notes.remarks
    assert [text.split(";")[0] for text in said] == [
        "PEEQ: 36 of 72 elements have no value in the first frame",
        "NT11: 2 of 70 nodes have no value in the last frame",
        "PEEQ: 36 of 72 elements have no value in the last frame",
    ]


def table_of(text):
    return "chip_nodes.csv", lambda _: text


def deck_with(old, new):
    return "chip.inp", lambda text: text.replace(old, new, 1)


DAMAGES = {
    r"line 4: \*NODE: 'nothing' is not a number": deck_with("101, 0, 0", "101, nothing, 0"),
    "node 999999, which is not defined": deck_with("1, 101,", "1, 999999,"),
    "node 101, which is not defined": deck_with("*NODE", "*NOTE"),
    "has no .NODE": ("chip.inp", lambda text: text.replace("*EL", "*NOTE")),
    "No columns": table_of(""),
    "expected a table": table_of("label,NT11\n1,2\n"),
    "'hot'": table_of("node,NT11\n101,hot\n"),
    "label 102 is not in": table_of("node,NT11\n102,300\n"),
    "Expected 2 fields in line 3, saw 3": table_of("node,NT11\n101,300\n103,300,1\n"),
    "chip_nodes.csv: .*''": table_of("node,NT11,U1\n101,300,0\n103,300\n"),
    "no row of numbers": table_of("node,NT11\n"),
}


@pytest.mark.parametrize("said", DAMAGES)
def test_what_is_wrong_with_an_abaqus_input_or_its_table_is_said(tmp_path, said):
    path = abaqus(tmp_path)
    name, change = DAMAGES[said]
    (tmp_path / name).write_text(change((tmp_path / name).read_text()))
    with pytest.raises(SourceError, match=said):
        MeshSource(path).survey()


def test_an_extra_that_is_missing_is_named(tmp_path, monkeypatch):
    grid_of().save(tmp_path / "chip.vtu")
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(SourceError, match=r'run python -m pip install "\.\[mesh\]" in the'):
        MeshSource(tmp_path / "chip.vtu").survey()
    monkeypatch.undo()
    monkeypatch.setitem(sys.modules, "lasso.dyna", None)
    (tmp_path / "d3plot").write_bytes(bytes(100))
    with pytest.raises(SourceError, match=r'run python -m pip install "\.\[dyna\]" in the'):
        MeshSource(tmp_path / "d3plot").survey()


def test_a_file_that_is_missing(tmp_path):
    for name in ("chip.vtu", "chip_*.vtu", "chip.pvd", "d3plot", "chip.inp", "chip.msh"):
        with pytest.raises(FileNotFoundError, match=name.replace("*", r"\*")):
            MeshSource(tmp_path / name).survey()


def test_a_gap_in_a_series_is_found_unless_times_are_given(tmp_path):
    for number in (0, 10, 30, 40, 45):
        grid_of().save(tmp_path / f"chip_{number:03}.vtu")
    with pytest.raises(SourceError, match="after chip_010"):
        MeshSource(tmp_path / "chip_*.vtu").survey()
    times = (0.0, 1.0, 3.0, 4.0, 4.5)
    assert MeshSource(tmp_path / "chip_*.vtu", times=times).survey().times.tolist() == list(times)
    (tmp_path / "chip_030.vtu").rename(tmp_path / "chip_020.vtu")
    (tmp_path / "chip_040.vtu").rename(tmp_path / "chip_030.vtu")
    assert len(MeshSource(tmp_path / "chip_*.vtu", interval=1.0).survey().times) == 5


def test_a_field_that_a_later_frame_lacks(tmp_path):
    grid = grid_of()
    grid.save(tmp_path / "c0.vtu")
    grid.point_data.remove("NT11")
    grid.save(tmp_path / "c1.vtu")
    frames = MeshSource(tmp_path / "c*.vtu").frames(RASTER)
    next(frames)
    with pytest.raises(SourceError, match=r"c1\.vtu: frame 1 has no field 'NT11'"):
        next(frames)


def test_a_header_that_claims_more_than_memory_holds_is_one_error(tmp_path):
    """VTK ends its process there."""
    path = tmp_path / "chip.vtu"
    grid_of().save(path)
    path.write_bytes(path.read_bytes().replace(b'Points="70"', b'Points="70000000000"'))
    with pytest.raises(SourceError, match=r"chip: .*damaged"):
        Isolated(MeshSource(path), Sandbox("chip")).survey()


def test_elements_of_nodes_that_do_not_exist(tmp_path):
    text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n"
    text += "0 0 0 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 9\nCELL_TYPES 1\n5\nPOINT_DATA 3\n"
    (tmp_path / "chip.vtk").write_text(text + "SCALARS T float 1\nLOOKUP_TABLE default\n1 2 3\n")
    with pytest.raises(SourceError, match="nodes 0 to 9, expected 0 to 2"):
        MeshSource(tmp_path / "chip.vtk").survey()


def solid():
    """Points and hexahedra of a block of 2 x 1 x 1, its elements in the order of x, y and z."""
    grid = pv.ImageData(dimensions=(5, 4, 3), spacing=(0.5, 1 / 3, 0.5))
    # A voxel's nodes are in another order than a brick's.
    cells = grid.cast_to_unstructured_grid().cell_connectivity.reshape(-1, 8)
    return np.array(grid.points, float), cells[:, [0, 1, 3, 2, 4, 5, 7, 6]]


def test_a_section_has_nothing_of_side_sets(tmp_path):
    points, hexes = solid()
    heat = 300.0 + 100.0 * points[:, 0] + 50.0 * points[:, 2]
    heat[points[:, 2] == 1.0] = 913.0
    top = np.arange(1, 13) + 12
    sides = {"hot": (top, np.full(12, 6))}
    path = tmp_path / "block.e"
    write_exodus(path, points, {"steel": hexes}, [0.0], {"temp": heat[None]}, sides)
    raster = Raster(0.0, 1.0, 0.1, 10, 20)
    found = only_frame(MeshSource(path, section=0.25), raster).fields["temperature"]
    expected = 300.0 + 100.0 * np.broadcast_to(raster.x, raster.shape) + 12.5
    np.testing.assert_allclose(found, expected, atol=1e-9)  # linear within each cell: rounding


def test_a_case_of_openfoam_has_a_velocity_and_its_boundaries_are_no_material(tmp_path):
    path = write_foam(tmp_path, "type fixedValue; value uniform 250;", velocity="(3 1 2)")
    survey = survey_of(MeshSource(path, section=0.5))
    assert survey.times.tolist() == [0.0, 0.5]
    assert survey.extent == pytest.approx((0.0, 2.0, 0.0, 1.0))
    assert survey.found["velocity_x"] == survey.found["velocity_y"] == "U"
    assert not any("U is not added" in sentence for sentence in survey.notes.assumed)
    for section in (0.5, "facing"):
        frame = next(MeshSource(path, section=section).frames(Raster(0.0, 1.0, 0.1, 10, 20)))
        assert set(np.unique(frame.fields["temperature"])) == {300.0, 400.0}
        assert (frame.fields["velocity_x"] == 3.0).all()
        assert (frame.fields["velocity_y"] == 1.0).all()


def xdmf_over_time(path, times, heat):
    grid = pv.to_meshio(grid_of())
    # meshio writes the .h5 file to the working directory.
    with chdir(path.parent), meshio.xdmf.TimeSeriesWriter(path) as writer:
        writer.write_points_cells(grid.points, grid.cells)
        for time, values in zip(times, heat, strict=True):
            writer.write_data(time, point_data={"NT11": values})


def cgns_over_time(path, times, heat):
    grid = grid_of()
    write_cgns(path, grid.points, grid.cells_dict[9], {"Temperature": heat}, {}, times)


def vtkhdf_over_time(path, times, heat):
    """After VTK's description of its format: a still mesh, and values that follow one another."""
    h5py = pytest.importorskip("h5py")
    grid = grid_of()
    count, points, cells = len(times), grid.n_points, grid.n_cells
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        nodes = np.asarray(grid.cell_connectivity)
        for name, values in (
            ("NumberOfPoints", points), ("NumberOfCells", cells),
            ("NumberOfConnectivityIds", len(nodes)),
        ):  # fmt: skip
            root[name] = np.array([values])
        root["Points"], root["Connectivity"] = np.asarray(grid.points), nodes
        root["Offsets"], root["Types"] = 4 * np.arange(cells + 1), np.full(cells, 9, np.uint8)
        root["PointData/NT11"] = heat.ravel()
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = count
        steps["Values"] = np.asarray(times, float)
        none = np.zeros(count, int)
        steps["NumberOfParts"], steps["PartOffsets"], steps["PointOffsets"] = none + 1, none, none
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = none[:, None]
        steps["PointDataOffsets/NT11"] = points * np.arange(count)


@pytest.mark.parametrize("write", [xdmf_over_time, cgns_over_time, vtkhdf_over_time])
def test_all_times_of_one_file_are_read(tmp_path, write):
    times = (0.0, 0.5, 2.0)
    path = tmp_path / f"chip.{write.__name__.partition('_')[0]}"
    write(path, times, np.stack([grid_of(at=at).point_data["NT11"] for at in range(3)]))
    source = MeshSource(path)
    assert survey_of(source).times.tolist() == list(times)
    for number, frame in enumerate(source.frames(RASTER)):
        check_linear(frame, at=number)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("temp",), "temp: temperature 0 K, expected 200 to 6000 K; units.temperature is K"),
        (("temperature_graphite", "temperature_steel"), "no field is known as temperature"),
    ],
)
def test_temperatures_of_some_blocks_only_are_refused(tmp_path, names, said):
    """Exodus has 0 in the blocks to which a variable does not belong."""
    points, hexes = solid()
    left = points[hexes][:, :, 0].mean(axis=1) < 1.0
    blocks = {"graphite": hexes[left], "steel": hexes[~left]}
    fields = {
        name: np.where(np.isin(np.arange(len(points)), elements), 300.0, 0.0)[None]
        for name, elements in zip(names, blocks.values(), strict=False)
    }
    path = write_exodus(tmp_path / "two.e", points, blocks, [0.0], fields)
    with pytest.raises(SourceError, match=said):
        prospect(Import(MeshSource(path, section=0.5)))
