"""Every format that is read: what was written comes back, and what is damaged is one error."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from refusals import PNG, refused_on
from tolerances import SINGLE

from chipglow.io.sources import SourceError
from chipglow.scene import Raster

for needed in ("av", "lasso", "meshio", "pyvista", "tifffile", "zarr"):
    pytest.importorskip(needed)

from movies import known_field  # noqa: E402
from seeds import CLOUDS, GRIDS, MESHES, MOVIES, source_of, write_seeds  # noqa: E402

ALL = (*GRIDS, *CLOUDS, *MESHES, *MOVIES)
COARSE = Raster(0.0, 1.0, 0.1, 10, 10)
GRID = Raster(0.0, 1.0, 0.03, 24, 32)
# A collection and a case only name other files; half an input file of Abaqus is one of half a chip.
NAME_OTHERS = ("chip.case", "chip.vtm", "chip.inp")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    write_seeds(folder)
    return folder


@pytest.mark.parametrize("name", GRIDS)
def test_grids_come_back(whole, name):
    source = source_of(whole, name)
    frames = list(source.frames(GRID))
    assert len(frames) == (1 if name in ("grid.csv", "grid.png") else 3)
    y, x = np.mgrid[:24, :32]
    for number, frame in enumerate(frames):
        assert frame.time == pytest.approx(1e-6 * number)
        expected = 400.0 + 10.0 * x + 5.0 * y + 20.0 * number
        np.testing.assert_allclose(frame.fields["temperature"], expected, rtol=SINGLE)
        assert (frame.material == 1).all()
    np.testing.assert_array_equal(
        next(source.frames(GRID, len(frames) - 1)).fields["temperature"],
        frames[-1].fields["temperature"],
    )


@pytest.mark.parametrize("name", (*MESHES, *CLOUDS))
def test_meshes_and_points_come_back(whole, name):
    source = source_of(whole, name)
    if name == "chip.case":  # whose writer names fields after where they are
        source = replace(source, names={"temperature": "NT11_n"})
    frames = list(source.frames(COARSE))
    times = [frame.time for frame in frames]
    assert times == ([0.0, 1.0] if name in ("chip.pvd", "chip.plt", "d3plot") else [0.0])
    for frame in frames:
        expected = np.broadcast_to(400.0 + 500.0 * COARSE.x, COARSE.shape)
        # Numbers in text have few digits.
        np.testing.assert_allclose(frame.fields["temperature"], expected, atol=0.05)
        assert (frame.material == 1).all()


@pytest.mark.parametrize("name", MOVIES)
def test_movies_come_back(whole, name):
    frames = list(source_of(whole, name).frames(Raster(0.0, 1.0, 1 / 64, 64, 64)))
    for number, frame in enumerate(frames):
        error = frame.fields["temperature"] - known_field(number, (64, 64))
        # Levels of 8 bits after lossy codecs, in K: 3.2 measured.
        assert np.nanmedian(np.abs(error)) < 10.0
    assert len(frames) == 3


def memory(name):
    """Most bytes that a reader may take; tables of all colours have 268 MB."""
    return 4e8 if name in MOVIES else 6e7


def damaged(whole, folder, name, change):
    """A copy of all files in which those of one name are changed."""
    shutil.copytree(whole, folder, dirs_exist_ok=True)
    path = folder / name
    for file in [path] if path.is_file() else [one for one in path.rglob("*") if one.is_file()]:
        file.write_bytes(change(file.read_bytes()))
    return source_of(folder, name)


@pytest.mark.parametrize("name", [name for name in ALL if name not in NAME_OTHERS])
def test_a_file_that_is_cut_short_is_one_error(whole, tmp_path, name, capfd):
    for number, part in enumerate((0.0, 0.02, 0.45, 0.9)):
        if part == 0.9 and name in MESHES:
            continue  # the end of some formats holds nothing that is read
        folder = tmp_path / str(number)
        source = damaged(
            whole, folder, name, lambda content, part=part: content[: int(part * len(content))]
        )
        refused_on(COARSE, memory(name), source, "" if "zarr" in name else name)
    assert "ERR|" not in capfd.readouterr().err  # what VTK logs


TERABYTES = b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 1000000000000 float\n"
OTHERS = (PNG, b"hello\nworld\n" * 50, bytes(3000), TERABYTES + bytes(100))


@pytest.mark.parametrize("name", [name for name in ALL if "zarr" not in name])
def test_a_file_of_another_kind_is_one_error(whole, tmp_path, name, capfd):
    for number, content in enumerate(OTHERS):
        source = damaged(whole, tmp_path / str(number), name, lambda _, content=content: content)
        refused_on(COARSE, memory(name), source, name)
    assert "ERR|" not in capfd.readouterr().err


# VTK and HDF5 may end the process: theirs are damaged by benchmarks/fuzz.
OWN = ("grid.npy", "grid.npz", "grid.csv", "chip.plt", "chip.dat", "chip.inp", *CLOUDS, *MOVIES)


@pytest.mark.parametrize("name", OWN)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_any_change_of_a_file_is_one_error_or_a_scene(whole, tmp_path, name):
    random = np.random.default_rng(4)

    def changed(content):
        data = np.frombuffer(content, np.uint8).copy()
        reach = len(data) if random.random() < 0.3 else min(len(data), 2000)
        places = random.integers(0, reach, random.integers(1, 8))
        data[places] = random.choice([0, 1, 127, 255, 48, 57], len(places))
        return data.tobytes()

    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    for _ in range(12 if name in MOVIES else 60):
        (tmp_path / name).write_bytes(changed((whole / name).read_bytes()))
        try:
            for frame in source_of(tmp_path, name).frames(COARSE):
                assert frame.material.shape == COARSE.shape
        except SourceError as error:
            assert "\n" not in str(error)
