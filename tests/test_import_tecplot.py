import numpy as np
import pytest
from plane_mesh import HEIGHT, RASTER, WIDTH, X, Y, only_frame, temperature
from refusals import refused_on
from tecplot_file import ZoneOfFile, extras_of_header, write_tecplot

from chipglow.io.sources import Placement, SourceError
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.io.sources.meshes.tecplot_binary import binary_zones
from chipglow.scene import Material, Raster

pv = pytest.importorskip("pyvista")

DEPTH = 300e-6
COUNT = (10, 7)
NAMES = ("X", "Y", "Temperature [K]", "Strain")


def nodes(shift=0.0):
    """Nodes with i fastest, as Tecplot has them."""
    y, x = np.meshgrid(np.linspace(0, HEIGHT, COUNT[1]), np.linspace(0, WIDTH, COUNT[0]),
                       indexing="ij")  # fmt: skip
    return x.ravel() + shift, y.ravel()


def quads():
    i, j = np.meshgrid(np.arange(COUNT[0] - 1), np.arange(COUNT[1] - 1))
    first = (i + COUNT[0] * j).ravel()
    return np.stack([first, first + 1, first + 1 + COUNT[0], first + COUNT[0]], axis=1)


def zone_of(kind="quads", at=0.0, number="f8", shift=0.0, **said):
    x, y = nodes(shift)
    cells = quads()
    if kind == "triangles":
        cells = cells[:, ((0, 1, 2), (0, 2, 3))].reshape(-1, 3)
    strain = np.arange(len(cells)) / len(cells)
    columns = [values.astype(number) for values in (x, y, temperature(x, y, at), strain)]
    shape = (len(x), len(cells))
    centred = (False, False, False, True)
    return ZoneOfFile(columns, shape, kind, cells, centred, time=at, **said)


def ordered_zone(ghosts, **said):
    x, y = nodes()
    inner = np.arange(9.0 * 6).reshape(6, 9)
    strain = np.zeros((COUNT[1] - (not ghosts), COUNT[0]))
    strain[:6, :9] = inner
    columns = [x, y, temperature(x, y), strain.ravel()]
    return ZoneOfFile(columns, (*COUNT, 1), centred=(False, False, False, True), **said)


def check(frame, at=0.0, atol=2e-4):
    np.testing.assert_allclose(frame.fields["temperature"], temperature(X, Y, at), atol=atol)
    assert (frame.material == Material.WORKPIECE).all()


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("version", [107, 108, 111, 112])
@pytest.mark.parametrize("kind", ["quads", "triangles"])
def test_fields_of_nodes_and_elements_in_all_versions_and_orders(tmp_path, kind, version, order):
    zone = zone_of(kind)
    write_tecplot(tmp_path / "chip.plt", NAMES, [zone], version=version, order=order)
    source = MeshSource(tmp_path / "chip.plt")
    survey = source.survey()
    assert survey.kind == "mesh, 1 file of Tecplot binary"
    assert survey.found == {"temperature": "Temperature [K]", "plastic_strain": "Strain"}
    frame = only_frame(source)
    check(frame)
    strain = frame.fields["plastic_strain"]
    expected = zone.columns[3].astype(np.float32)
    assert set(np.unique(strain)) == set(expected)
    assert strain[-1, 0] == expected[0]  # the first element is at the lower left


@pytest.mark.parametrize("ghosts", [False, True])
def test_values_of_elements_of_points_in_order_with_and_without_the_last_ghosts(tmp_path, ghosts):
    write_tecplot(tmp_path / "chip.plt", NAMES, [ordered_zone(ghosts), ordered_zone(ghosts)])
    frame = only_frame(MeshSource(tmp_path / "chip.plt"))
    check(frame)
    expected = np.kron(np.arange(54.0).reshape(6, 9)[::-1], np.ones((10, 10)))
    np.testing.assert_array_equal(frame.fields["plastic_strain"], expected)


@pytest.mark.parametrize(
    ("shape", "stored"),
    [
        ((2, 3, 2), [1.5, 0, 12.5, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
        ((3, 2, 2), [1.5, 12.5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
        ((2, 2, 3), [1.5, 0, 0, 0, 12.5, 0, 0, 0, 0, 0, 0, 0]),
        ((2, 3, 2), [1.5, 0, 12.5, 0, 0, 0]),
        ((3, 2, 2), [1.5, 12.5, 0, 0, 0, 0]),
        ((2, 2, 3), [1.5, 0, 0, 0, 12.5, 0, 0, 0]),
    ],
)
def test_the_ghosts_of_the_guides_examples(tmp_path, shape, stored):
    z, y, x = (axis.ravel() for axis in np.indices(shape[::-1], dtype=float))
    columns = [x, y, z, np.array(stored)]
    zone = ZoneOfFile(columns, shape, centred=(False, False, False, True))
    write_tecplot(tmp_path / "chip.plt", ("X", "Y", "Z", "T"), [zone])
    (found,) = binary_zones(tmp_path / "chip.plt")
    np.testing.assert_array_equal(found.load().grid.cell_data["T"], [1.5, 12.5])


@pytest.mark.parametrize("kind", ["bricks", "tetrahedra"])
def test_solid_elements_are_cut(tmp_path, kind):
    grid = pv.ImageData(dimensions=(4, 3, 3), spacing=(WIDTH / 3, HEIGHT / 2, DEPTH / 2))
    grid = grid.cast_to_unstructured_grid()
    # A voxel's nodes are in another order than a brick's.
    cells = grid.cell_connectivity.reshape(-1, 8)[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    if kind == "tetrahedra":
        grid = pv.UnstructuredGrid(
            np.insert(cells, 0, 8, axis=1).ravel(), np.full(len(cells), 12), grid.points
        ).triangulate()
        cells = grid.cells_dict[10]
    x, y, z = np.asarray(grid.points, float).T
    zone = ZoneOfFile([x, y, z, temperature(x, y) + 1e5 * z], (len(x), len(cells)), kind, cells)
    write_tecplot(tmp_path / "chip.plt", ("X", "Y", "Z", "T"), [zone])
    frame = only_frame(MeshSource(tmp_path / "chip.plt", section=1e-4))
    # Linear within each cell: rounding.
    np.testing.assert_allclose(frame.fields["temperature"], temperature(X, Y) + 10.0, atol=1e-9)


def test_zones_of_many_times_share_positions_and_elements_and_lack_fields(tmp_path):
    first = zone_of(at=0.5, strand=1)
    tool = zone_of("triangles", name="tool", shift=WIDTH)
    tool.columns[3] = "passive"
    x, y = nodes()
    later = [
        ZoneOfFile(
            [("shared", 0), ("shared", 0), temperature(x, y, at), ("shared", 0)],
            first.shape, "quads", 0, first.centred, strand=1, time=at,
        )
        for at in (2.0, 1.0)
    ]  # fmt: skip
    lines = ZoneOfFile([x[:3], y[:3], 0 * x[:3], x[:2]], (3, 2), "lines", [[0, 1], [1, 2]],
                       centred=first.centred, name="outline")  # fmt: skip
    empty = ZoneOfFile([x[:0], x[:0], x[:0], x[:0]], (0, 0, 0))
    for column in range(4):
        empty.columns[column] = "passive"
    zones = [first, tool, *later, lines, empty]
    write_tecplot(tmp_path / "chip.plt", NAMES, zones)
    source = MeshSource(tmp_path / "chip.plt", tool_parts=("tool",))
    assert source.survey().times.tolist() == [0.5, 1.0, 2.0]
    wide = Raster(0.0, HEIGHT, 10e-6, 60, 180)
    for at, frame in zip((0.5, 1.0, 2.0), source.frames(wide), strict=True):
        right = np.broadcast_to(wide.x > WIDTH, wide.shape)
        np.testing.assert_array_equal(frame.material == Material.TOOL, right)
        found = frame.fields["temperature"][:, :90]
        # Linear within each cell: rounding.
        np.testing.assert_allclose(found, temperature(X, Y, at), atol=1e-9)
        strain = frame.fields["plastic_strain"]
        assert np.isnan(strain[right]).all()
        assert set(strain[~right]) == set(first.columns[3].astype(np.float32))


def test_a_file_for_each_time(tmp_path):
    for number, at in enumerate((0.5, 0.75, 1.5)):
        write_tecplot(tmp_path / f"chip_{number}.plt", NAMES, [zone_of(at=at, strand=1)])
    source = MeshSource(tmp_path / "chip_*.plt")
    assert source.survey().times.tolist() == [0.5, 0.75, 1.5]
    for at, frame in zip((0.5, 0.75, 1.5), source.frames(RASTER), strict=True):
        check(frame, at)
    write_tecplot(tmp_path / "chip_1.plt", NAMES, [zone_of(at=0.5, strand=1)])
    survey = source.survey()
    assert survey.times.tolist() == [0.0, 1.0, 2.0]
    assert "The files contain no times: frames are 1 s apart." in survey.notes.assumed


def test_zones_without_strands_are_of_their_times_if_no_two_are_of_one(tmp_path):
    path = tmp_path / "chip.plt"
    write_tecplot(path, NAMES, [zone_of(at=at) for at in (1.0, 0.0, 2.0)])
    assert MeshSource(path).survey().times.tolist() == [0.0, 1.0, 2.0]
    check(list(MeshSource(path).frames(RASTER))[1], 1.0)
    write_tecplot(path, NAMES, [zone_of(at=at) for at in (1.0, 1.0, 2.0)])
    assert len(MeshSource(path).survey().times) == 1


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("version", [107, 112])
def test_what_is_not_of_the_mesh_is_skipped(tmp_path, order, version):
    said = {"neighbours": (0, 1, 2, 3, 1, 4), "remarks": {"A": "b", "C": "d"}}
    raw = 4 * len(quads()) if version > 107 else 0
    zones = [zone_of(raw_neighbours=raw, **said), ordered_zone(False, **said), zone_of()]
    write_tecplot(
        tmp_path / "chip.plt", NAMES, zones,
        version=version, order=order, extras=extras_of_header(order),
    )  # fmt: skip
    check(only_frame(MeshSource(tmp_path / "chip.plt")))


@pytest.mark.parametrize("number", ["f4", "i4", "i2", "u1"])
def test_kinds_of_numbers_also_where_zones_then_begin_at_odd_bytes(tmp_path, number):
    zone = zone_of()
    zone.columns[3] = (np.arange(len(zone.cells)) * 4).astype(number)
    zone.columns[0] = zone.columns[0].astype("f4")
    write_tecplot(tmp_path / "chip.plt", NAMES, [zone, zone])
    frame = only_frame(MeshSource(tmp_path / "chip.plt"))
    check(frame, atol=0.1)  # positions in 32 bits
    assert set(np.unique(frame.fields["plastic_strain"])) == set(4.0 * np.arange(54))


def test_names_of_positions_of_other_programs(tmp_path):
    x, y = nodes()
    zone = ZoneOfFile([x, 0 * x, y, temperature(x, y)], (len(x), 54), "quads", quads())
    names = ("CoordinateX", "CoordinateY (m)", "CoordinateZ", "T")
    write_tecplot(tmp_path / "chip.plt", names, [zone])
    check(only_frame(MeshSource(tmp_path / "chip.plt", placement=Placement(vertical="z"))))


def damaged_zone(**changed):
    zone = zone_of()
    for name, value in changed.items():
        setattr(zone, name, value)
    return zone


@pytest.mark.parametrize(
    ("zones", "said"),
    [
        ([damaged_zone(kind="polygons")], "elements of the kind FEPOLYGON"),
        ([damaged_zone(time=float("nan"))], "at the time nan"),
        ([damaged_zone(shape=(2**31 - 1, 54))], "2147483647 numbers"),
        ([damaged_zone(shape=(70, 2**31 - 1))], "2147483647 numbers"),
        ([damaged_zone(shape=(-1, 54))], "-1 points"),
        ([damaged_zone(cells=quads() + 20)], "nodes 21 to 90"),
        ([damaged_zone(columns=[("shared", 0)] * 4)], "shares with zone 1, which is not before it"),
        ([zone_of(), damaged_zone(columns=[("shared", 0)] * 4, shape=(71, 54))], "shares 70"),
        ([zone_of(), damaged_zone(cells=0, kind="triangles")], "elements of another kind"),
        ([damaged_zone(columns=["passive"] * 4)], "there is no X"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_error_without_memory(tmp_path, zones, said):
    write_tecplot(tmp_path / "chip.plt", NAMES, zones)
    refused_on(RASTER, 3_000_000, MeshSource(tmp_path / "chip.plt"), "chip.plt", said)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda _: b"#!TDV75 " + bytes(100), "binary Tecplot of version '75', expected 107 to 112"),
        (lambda _: b"#!TDV112" + bytes(100), "order of bytes"),
        (lambda content: content + b"\0", "1 bytes after the last zone"),
        (lambda content: content[:12] + b"\2" + content[13:], "a solution without its grid"),
    ],
)
def test_other_versions_and_files_without_a_grid_are_refused(tmp_path, change, said):
    path = write_tecplot(tmp_path / "chip.plt", NAMES, [zone_of()])
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(SourceError, match=said):
        MeshSource(path).survey()
