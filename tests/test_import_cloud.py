"""Clouds of points: fields come back exactly, surfaces are where they are, errors are clear."""

from functools import partial

import h5py
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from refusals import refused_on
from tolerances import SINGLE

from chipglow.io.sources import Placement, SourceError, Units
from chipglow.io.sources.points.cloud import CloudSource
from chipglow.io.sources.points.sampling import Cloud, neighbour_distance, sample_cloud
from chipglow.quantities.units import CELSIUS, Unit
from chipglow.scene import Raster

A = 2e-6
COLUMNS, ROWS = 30, 20
TIMES = 1e-6 * np.arange(3)
# Fields are given in 32 bits.
ROUNDING = 1e-4
RASTER = Raster(-5e-6, 45e-6, 0.5e-6, 100, 140)


def lattice(columns=COLUMNS, rows=ROWS, jitter=0.0, seed=0):
    x, y = np.meshgrid((np.arange(columns) + 0.5) * A, (np.arange(rows) + 0.5) * A)
    moved = np.random.default_rng(seed).uniform(-jitter, jitter, (columns * rows, 2)) * A
    return np.stack([x.ravel(), y.ravel()], axis=1) + moved


def rotated(places, angle):
    c, s = np.cos(angle), np.sin(angle)
    return places @ np.array([[c, s], [-s, c]])


def linear(x, y, time=0.0):
    return 500.0 + 2e6 * x - 1e6 * y + 1e7 * time


def a_cloud(places, values=None, material=None, spacing=A):
    count = len(places)
    values = linear(*places.T)[:, None] if values is None else values
    material = np.ones(count, np.uint8) if material is None else material
    return Cloud(places, values, material, np.full(count, spacing), np.full(count, spacing**2))


# Sampling


@settings(max_examples=25)
@given(st.floats(0.0, 0.4), st.floats(0.0, 1.6), st.floats(0.2, 2.5), st.integers(0, 1000))
def test_linear_fields_are_exact_on_any_lattice(jitter, angle, spacing, seed):
    places = rotated(lattice(jitter=jitter, seed=seed), angle)
    low, high = places.min(axis=0), places.max(axis=0)
    size = spacing * A
    counts = np.ceil((high - low) / size).astype(int) + 4
    raster = Raster(low[0] - 2 * size, high[1] + 2 * size, size, counts[1], counts[0])
    found, material = sample_cloud(a_cloud(places), raster)
    expected = linear(*np.meshgrid(raster.x, raster.y))
    values = linear(*places.T)
    seen = (material == 1) & (expected > values.min()) & (expected < values.max())
    assert seen.any()
    assert np.abs(found[0] - expected)[seen].max() < ROUNDING
    assert np.isnan(found[0][material == 0]).all()


@pytest.mark.parametrize("jitter", [0.0, 0.2, 0.3])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4])
def test_the_surface_is_within_half_a_spacing(jitter, angle):
    places = rotated(lattice(jitter=jitter), angle)
    raster = Raster(-50e-6, 120e-6, 0.4e-6, 450, 450)
    _, material = sample_cloud(a_cloud(places), raster)
    u, v = rotated(np.stack(np.meshgrid(raster.x, raster.y), axis=2).reshape(-1, 2), -angle).T / A
    inside = np.minimum(np.minimum(u, COLUMNS - u), np.minimum(v, ROWS - v)).reshape(raster.shape)
    assert inside[material == 0].max() < 0.5  # no hole, and no more lost at the corners
    assert inside[material == 1].min() > -0.5
    area = material.sum() * raster.spacing**2
    # Samples on the border: 0.4 % measured.
    assert area == pytest.approx(COLUMNS * ROWS * A**2, rel=0.01)


def test_values_do_not_cross_a_gap():
    """Hot and cold halves, a gap of 1.01 spacings between them."""
    cold = lattice()
    hot = cold + np.array([(COLUMNS + 1.01) * A, 0.0])
    places = np.concatenate([cold, hot])
    values = np.repeat([300.0, 1300.0], len(cold))[:, None]
    raster = Raster(0.0, 30e-6, 0.2e-6, 100, 630)
    found, material = sample_cloud(a_cloud(places, values), raster)
    middle = (COLUMNS + 0.505) * A
    left, right = found[0][:, raster.x < middle], found[0][:, raster.x > middle]
    assert np.nanmax(left) < 300.001
    assert np.nanmin(right) > 1299.999
    assert (material[:, np.abs(raster.x - middle) < 0.1 * A] == 0).all()


def test_second_order_on_smooth_fields():
    def error(count):
        x, y = np.meshgrid(*[(np.arange(count) + 0.5) / count] * 2)
        values = (np.sin(6 * x) * np.cos(5 * y)).reshape(-1, 1)
        cloud = a_cloud(np.stack([x.ravel(), y.ravel()], axis=1), values, spacing=1 / count)
        raster = Raster(0.0, 1.0, 1 / 150, 150, 150)
        found, material = sample_cloud(cloud, raster)
        expected = np.sin(6 * raster.x) * np.cos(5 * raster.y[:, None])
        return np.abs(found[0] - expected)[material == 1].mean()

    assert 3.2 < error(40) / error(80) < 5.0


def test_tool_and_workpiece_share_the_seam_and_keep_their_values():
    places = lattice()
    material = np.where(places[:, 0] < 30e-6, 1, 2).astype(np.uint8)
    values = np.where(material == 1, 300.0, 900.0)[:, None]
    raster = Raster(2e-6, 36e-6, 0.5e-6, 60, 110)
    found, kinds = sample_cloud(a_cloud(places, values, material), raster)
    expected = np.broadcast_to(np.where(raster.x < 30e-6, 1, 2), raster.shape)
    np.testing.assert_array_equal(kinds, expected)
    np.testing.assert_allclose(found[0], np.where(expected == 1, 300.0, 900.0), rtol=SINGLE)


@settings(max_examples=30)
@given(st.integers(1, 60), st.integers(0, 10_000))
def test_any_few_points_stay_within_their_range(count, seed):
    generator = np.random.default_rng(seed)
    places = generator.uniform(0, 10e-6, (count, 2)).round(6)  # many in one place
    values = generator.uniform(300.0, 400.0, (count, 1))
    raster = Raster(-4e-6, 14e-6, 1e-6, 18, 18)
    found, material = sample_cloud(a_cloud(places, values), raster)
    seen = found[0][material == 1]
    assert np.isfinite(seen).all()
    assert ((seen >= values.min() - 1e-3) & (seen <= values.max() + 1e-3)).all()


def test_points_in_a_row_have_a_gradient_along_it():
    places = lattice(30, 1)
    found, material = sample_cloud(a_cloud(places), Raster(0.0, 2e-6, 0.5e-6, 4, 120))
    row = found[0][1]
    middle = slice(10, 110)
    assert (material[1, middle] == 1).all()
    x = 0.5e-6 * (np.arange(120) + 0.5)
    np.testing.assert_allclose(row[middle], linear(x, 1e-6)[middle], atol=ROUNDING)


@pytest.mark.parametrize("seed", range(3))
def test_points_at_random_fill_their_area(seed):
    generator = np.random.default_rng(seed)
    places = generator.uniform(0.0, 1.0, (2000, 2)) * [60e-6, 40e-6]
    spacing = neighbour_distance(places)
    # The median of random distances, near the border too: 2 % measured.
    assert spacing == pytest.approx(np.sqrt(60e-6 * 40e-6 / 2000), rel=0.05)
    raster = Raster(0.0, 40e-6, 0.5e-6, 80, 120)
    found, material = sample_cloud(a_cloud(places, spacing=spacing), raster)
    # Some gaps between points at random are wider than the spacing; without the wider weights a
    # tenth of the samples were void.
    assert (material[6:-6, 6:-6] == 1).mean() > 0.97
    expected = linear(*np.meshgrid(raster.x, raster.y))
    values = linear(*places.T)
    seen = (material == 1) & (expected > values.min()) & (expected < values.max())
    seen[:6], seen[-6:], seen[:, :6], seen[:, -6:] = False, False, False, False
    # A point whose neighbours are all in one line has no slope across it.
    assert np.quantile(np.abs(found[0] - expected)[seen], 0.98) < ROUNDING


def test_distance_of_neighbours():
    assert neighbour_distance(lattice()) == pytest.approx(A)
    cube = np.stack(np.meshgrid(*[np.arange(12) * A] * 3), axis=-1).reshape(-1, 3)
    assert neighbour_distance(cube) == pytest.approx(A)
    assert np.isnan(neighbour_distance(np.zeros((1, 2))))


# Files


def columns_at(time, places=None):
    places = lattice() if places is None else places
    return {
        "x": places[:, 0],
        "y": places[:, 1],
        "temperature": linear(*places.T, time),
        "plastic_strain": linear(*places.T) / 1000,
    }


def write_csv(path, table, separator=","):
    lines = np.stack(list(table.values()), axis=1)
    np.savetxt(path, lines, "%.12g", separator, header=separator.join(table), comments="")


def csv_files(folder):
    for number, time in enumerate(TIMES):
        write_csv(folder / f"points_{number * 9}.csv", columns_at(time), ";")
    return folder / "points_*.csv", {"interval": 1e-6}


def csv_with_times(folder):
    tables = [{"Time [us]": np.full(600, t * 1e6), **columns_at(t)} for t in TIMES]
    write_csv(folder / "points.csv", {n: np.concatenate([t[n] for t in tables]) for n in tables[0]})
    return folder / "points.csv", {}


def npz(folder):
    places = np.repeat(lattice()[None], 3, axis=0)
    fields = {n: np.stack([columns_at(t)[n] for t in TIMES]) for n in ("temperature",)}
    np.savez(folder / "points.npz", positions=places, time=TIMES, **fields)
    return folder / "points.npz", {}


def npy_structured(folder):
    for number, time in enumerate(TIMES):
        table = columns_at(time)
        records = np.rec.fromarrays(list(table.values()), names=list(table))
        np.save(folder / f"p{number}.npy", records)
    return folder / "p*.npy", {"interval": 1e-6}


def hdf5(folder):
    with h5py.File(folder / "points.h5", "w") as file:
        for name in columns_at(0.0):
            file[f"particles/{name}"] = np.stack([columns_at(t)[name] for t in TIMES])
        file["particles/x"].attrs["units"] = "m"
        file["time"] = TIMES * 1e6
        file["time"].attrs["units"] = "us"
    return folder / "points.h5", {}


def vtp(folder):
    pv = pytest.importorskip("pyvista")
    for number, time in enumerate(TIMES):
        table = columns_at(time)
        cloud = pv.PolyData(np.column_stack([table["x"], table["y"], 0 * table["x"]]))
        cloud["temperature"] = table["temperature"]
        cloud.save(folder / f"p{number}.vtp")
    return folder / "p*.vtp", {"interval": 1e-6}


FORMATS = [csv_files, csv_with_times, npz, npy_structured, hdf5, vtp]


@pytest.mark.parametrize("write", FORMATS, ids=lambda write: write.__name__)
def test_every_format_gives_back_what_was_written(tmp_path, write):
    path, options = write(tmp_path)
    source = CloudSource(str(path), **options)
    survey = source.survey()
    # In s: times of 1e-6 s are rounded to 1e-22 s.
    np.testing.assert_allclose(survey.times, TIMES, atol=1e-15)
    # Rounding, in m.
    np.testing.assert_allclose(survey.extent, (0, COLUMNS * A, 0, ROWS * A), atol=1e-15)
    assert survey.found["temperature"] == "temperature"
    assert survey.spacing == pytest.approx(A, rel=1e-12)  # rounding
    assert any("neighbours in the first frame" in text for text in survey.notes.assumed)
    expected = linear(*np.meshgrid(RASTER.x, RASTER.y))
    frames = list(source.frames(RASTER))
    assert [frame.time for frame in frames] == pytest.approx(list(TIMES))
    for frame in frames:
        seen = frame.material == 1
        limits = linear(*lattice().T)
        seen &= (expected > limits.min()) & (expected < limits.max())
        # Places of VTK are in 32 bits: 1e-7 of 60 um, times the gradient.
        found = frame.fields["temperature"][seen] - 1e7 * frame.time
        # Float32, of a sum and a difference.
        np.testing.assert_allclose(found, expected[seen], atol=2 * ROUNDING)
    (last,) = source.frames(RASTER, start=2)
    np.testing.assert_array_equal(last.fields["temperature"], frames[2].fields["temperature"])


def test_units_in_the_names_of_columns_and_given(tmp_path):
    table = columns_at(0.0)
    names = ["X [mm]", "Y [mm]", "Temperature (degC)", "PEEQ (%)"]
    values = [table["x"] * 1e3, table["y"] * 1e3, table["temperature"] - 273.15]
    values.append(table["plastic_strain"] * 100)
    write_csv(tmp_path / "a.csv", dict(zip(names, values, strict=True)))
    write_csv(tmp_path / "b.csv", dict(zip("xyTe", values, strict=True)))
    units = Units(length=Unit(1e-3), temperature=CELSIUS)
    (one,) = CloudSource(str(tmp_path / "a.csv")).frames(RASTER)
    (other,) = CloudSource(str(tmp_path / "b.csv"), units=units).frames(RASTER)
    np.testing.assert_array_equal(one.material, other.material)
    np.testing.assert_allclose(one.fields["temperature"], other.fields["temperature"], rtol=SINGLE)
    assert np.nanmin(one.fields["plastic_strain"]) > 0.4
    assert np.nanmax(one.fields["plastic_strain"]) < 0.7


@pytest.mark.parametrize(("label", "zero"), [("T_C", 273.15), ("T_K", 0.0), ("T_c", 0.0)])
def test_a_unit_behind_an_underscore(tmp_path, label, zero):
    table = columns_at(0.0)
    write_csv(tmp_path / "a.csv", {"x": table["x"], "y": table["y"], label: np.full(600, 400.0)})
    source = CloudSource(str(tmp_path / "a.csv"), names={"temperature": label})
    assert source.survey().temperatures == pytest.approx((400.0 + zero, 400.0 + zero))


def test_placement_turns_places_and_vectors(tmp_path):
    table = columns_at(0.0)
    zero = np.zeros_like(table["x"])
    places = np.stack([zero + 1e-3, table["y"], table["x"]], axis=1)
    velocity = np.stack([zero + 1, zero + 2, zero + 3], axis=1)
    np.savez(tmp_path / "p.npz", points=places, velocity=velocity, T=table["temperature"])
    placement = Placement("z", "-y", 1e-6)
    source = CloudSource(str(tmp_path / "p.npz"), placement=placement)
    left, right, bottom, top = source.survey().extent
    assert (left, right) == pytest.approx((-1e-6, COLUMNS * A - 1e-6))
    # In m: far below a spacing.
    assert (bottom, top) == pytest.approx((-ROWS * A, 0.0), abs=1e-12)
    raster = Raster(5e-6, -5e-6, 1e-6, 20, 30)
    (frame,) = source.frames(raster)
    expected = linear(*np.meshgrid(raster.x + 1e-6, -raster.y))
    np.testing.assert_allclose(frame.fields["temperature"], expected, atol=ROUNDING)
    np.testing.assert_allclose(frame.fields["velocity_x"], 3.0)
    np.testing.assert_allclose(frame.fields["velocity_y"], -2.0)
    assert source.survey().found["velocity_x"] == "velocity_z"


@pytest.mark.parametrize("thickness", [1.0, 3.0])
@pytest.mark.parametrize("with_volume", [False, True])
def test_slab_of_points_in_three_dimensions(tmp_path, thickness, with_volume):
    layers = [np.column_stack([lattice(), np.full(600, (i + 0.5) * A)]) for i in range(-4, 4)]
    places = np.concatenate(layers)
    temperature = linear(*places.T[:2]) + np.where(places[:, 2] > 0, 0.0, 9e9)
    extra = {"volume": np.full(len(places), A**3)} if with_volume else {}
    np.savez(tmp_path / "p.npz", points=places, T=temperature, **extra)
    refused(CloudSource(str(tmp_path / "p.npz")), "expected the depth and thickness of the slab")
    depth = thickness * A / 2
    source = CloudSource(str(tmp_path / "p.npz"), depth=depth, thickness=1.01 * thickness * A)
    assert source.survey().spacing == pytest.approx(A)
    (frame,) = source.frames(RASTER)
    (flat,) = CloudSource(str(npy_structured(tmp_path)[0])).frames(RASTER, start=2)
    different = frame.material != flat.material
    assert different.mean() < 1e-3  # none measured; one on the border may be rounded
    expected = linear(*np.meshgrid(RASTER.x, RASTER.y))
    inner = (slice(25, 75), slice(25, 115))
    # Float32 of values and places.
    np.testing.assert_allclose(
        frame.fields["temperature"][inner], expected[inner], atol=2 * ROUNDING
    )
    thin = CloudSource(str(tmp_path / "p.npz"), depth=depth, thickness=0.5 * A)
    if not with_volume:
        refused(thin, "expected the points' spacing")
    refused(CloudSource(str(tmp_path / "p.npz"), depth=1.0, thickness=2 * A), "no point", "within")


def test_parts_of_the_tool(tmp_path):
    table = columns_at(0.0)
    table["part"] = np.where(table["x"] < 30e-6, 1, 7)
    write_csv(tmp_path / "p.csv", table)
    (frame,) = CloudSource(str(tmp_path / "p.csv"), tool_parts=(7, 8)).frames(RASTER)
    assert set(np.unique(frame.material)) == {0, 1, 2}
    # A sample; half of one measured.
    assert RASTER.x[(frame.material == 2).any(axis=0)].min() == pytest.approx(30e-6, abs=0.5e-6)


def test_points_without_a_number_are_left_out(tmp_path):
    table = columns_at(0.0)
    table["temperature"][::7] = np.nan
    write_csv(tmp_path / "p.csv", table)
    (frame,) = CloudSource(str(tmp_path / "p.csv"), spacing=1.2 * A).frames(RASTER)
    assert np.isfinite(frame.fields["temperature"][frame.material == 1]).all()


# Bad input


refused = partial(refused_on, RASTER, 60e6)


def test_arrays_of_impossible_length(tmp_path):
    with h5py.File(tmp_path / "p.h5", "w") as file:
        for name, values in columns_at(0.0).items():
            file[name] = values if name != "y" else values[:-1]
    refused(CloudSource(str(tmp_path / "p.h5")), "columns of [599, 600] points")
    with h5py.File(tmp_path / "p.h5", "w") as file:
        for name in ("x", "y", "temperature"):
            file.create_dataset(name, (10**15,), "f4", chunks=(1000,))
    refused(CloudSource(str(tmp_path / "p.h5")), "1e+15 samples")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,temperature\n1,300\n", "no column 'y'"),
        ("x,y,heat\n1,2,300\n", "no column is known as temperature, it has heat"),
        ("x,y,temperature\n1,2,hot\n", "p.csv, line 2: temperature is 'hot', expected a number"),
        ("#a\nx,y,temperature\n\n1,2,300\n# b\n2,x 3,300\n", "p.csv, line 6: y is 'x 3'"),
        ("x;y;temperature\n1,5;2;300\n1,6;2;3,0,0\n", "p.csv, line 3: temperature is '3,0,0'"),
        ("time,x,y,temperature\n1,0,0,3\nsoon,0,0,3\n", "p.csv, line 3: time is 'soon'"),
        ("x,y,temperature\n1,2,300,4,5\n1,2,3,4,5,6\n", "p.csv"),
        ("x,x,temperature\n1,2,300\n", "two columns have one name"),
        ("time,x,y,temperature\n1,0,0,300\n2,0,0,300\n1,0,0,300\n", "does not ascend"),
        ("x,y,temperature\n1,2,300\n1,2,300\n", "in one place"),
    ],
)
def test_tables_that_go_wrong(tmp_path, text, said):
    (tmp_path / "p.csv").write_text(text)
    spacing = None if "one place" in said else 1.0
    refused(CloudSource(str(tmp_path / "p.csv"), spacing=spacing), said)


@pytest.mark.parametrize(
    ("columns", "options", "said"),
    [
        ({}, {"spacing": 2e-3}, "another spacing, volume or unit"),
        ({}, {"names": {"temperature": "T"}}, "no field 'T'"),
        ({}, {"names": {"x": "X1"}}, "no column 'X1'"),
        ({}, {"names": {"time": "t"}}, "no column 't' for time"),
        ({}, {"tool_parts": (7,)}, "no column of parts"),
        ({"volume": -np.ones(600)}, {}, "volume: must be positive"),
        ({"temperature": np.full(600, np.nan)}, {}, "no point with a place and values"),
        ({"v1 [bar]": np.ones(600)}, {}, "p.csv: v1: unknown unit 'bar'"),
    ],
)
def test_what_does_not_fit_a_table_is_refused(tmp_path, columns, options, said):
    write_csv(tmp_path / "p.csv", {**columns_at(0.0), **columns})
    refused(CloudSource(str(tmp_path / "p.csv"), **options), said)


# The end of a table, and t


def table(rows, form="%.3e", newline=True):
    lines = [",".join(form % cell for cell in row) for row in rows]
    return "x,y,temperature\n" + "\n".join(lines) + "\n" * newline


ROWS_OF_TABLE = [(x, y, linear(x, y)) for x, y in lattice(5, 4)]


@pytest.mark.parametrize(("form", "lost"), [("%.3e", 4), ("%.3e", 1), ("%.3e", 6), ("%.9f", 6)])
def test_a_number_that_is_cut_at_the_end_is_refused(tmp_path, form, lost):
    text = table(ROWS_OF_TABLE, form, newline=False)
    (tmp_path / "p.csv").write_text(text[:-lost])
    with pytest.raises(SourceError, match=r"p\.csv: ends with .* truncated"):
        CloudSource(str(tmp_path / "p.csv")).survey()


@pytest.mark.parametrize("form", ["%.3e", "%.9f", "%g", "%.12g"])
def test_a_whole_table_may_lack_its_last_end_of_line(tmp_path, form):
    rows = [(x, y, 300.0 if number % 3 else 300.25) for number, (x, y, _) in
            enumerate(ROWS_OF_TABLE)]  # fmt: skip
    (tmp_path / "p.csv").write_text(table(rows, form, newline=False))
    assert CloudSource(str(tmp_path / "p.csv")).survey().found["temperature"] == "temperature"


def test_t_is_the_time_beside_a_temperature_and_the_temperature_alone(tmp_path):
    places, times = lattice(6, 5), [0.0, 2e-6]
    heat = np.stack([linear(*places.T, time) for time in times])
    np.savez(tmp_path / "p.npz", position=np.stack([places] * 2), temperature=heat, t=times)
    np.savez(tmp_path / "q.npz", position=places, t=heat[0])
    rows = [f"{x},{y},{t},{linear(x, y, t)}\n" for t in times for x, y in places]
    (tmp_path / "r.csv").write_text("x,y,t,temp\n" + "".join(rows))
    for name in ("p.npz", "r.csv"):
        survey = CloudSource(str(tmp_path / name)).survey()
        assert survey.times.tolist() == times
        assert "t" not in survey.unused
    survey = CloudSource(str(tmp_path / "q.npz")).survey()
    assert survey.found == {"temperature": "t"}
    assert len(survey.times) == 1
