"""A damaged file is refused, or computed again, before HDF5 reads it."""

import sys
from contextlib import ExitStack
from functools import partial
from time import sleep

import h5py
import numpy as np
import pytest
from test_io import a_file, a_measurement_file

from chipglow.io import digest, open_scene, read_measurement
from chipglow.io.digest import is_intact
from chipglow.io.file_kind import file_kind
from chipglow.io.packing import COMPRESSION, chunk_of, read_chunk
from chipglow.io.sources import SourceError
from chipglow.io.sources.grids.arrays import open_arrays


def flip(path, place, bit=0):
    content = bytearray(path.read_bytes())
    content[place] ^= 1 << bit
    path.write_bytes(content)


def without_digest(path):
    """The same data in a file that another program wrote."""
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "changed"
    assert is_intact(path) is None
    return path


def place_of(path, name):
    with h5py.File(path) as file:
        return file[name].id.get_chunk_info(0).byte_offset + 12


@pytest.mark.parametrize("write", [a_file, a_measurement_file])
def test_every_flipped_bit_is_found(tmp_path, write):
    path = write(tmp_path)
    assert is_intact(path)
    whole = path.read_bytes()
    for place in np.random.default_rng(1).integers(0, len(whole), 100):
        flip(path, place, place % 8)
        assert not is_intact(path)
        path.write_bytes(whole)
    path.write_bytes(whole[:20])
    assert is_intact(path) is None


@pytest.mark.parametrize(
    ("write", "read", "name"),
    [
        *((a_file, open_scene, name) for name in ("plastic_strain", "x", "time", "force_time")),
        (a_file, file_kind, "x"),
        (a_measurement_file, read_measurement, "radiance"),
    ],
)
def test_the_damaged_dataset_is_named(tmp_path, write, read, name):
    path = write(tmp_path)
    flip(path, place_of(path, name))
    with pytest.raises(ValueError, match=rf"{path.name}: .*'{name}' is damaged"):
        read(path)


def test_damage_that_hdf5_does_not_see_is_found(tmp_path):
    path = a_file(tmp_path)
    flip(path, path.read_bytes().index(b"true temperature"))
    with pytest.raises(ValueError, match=r"scene\.nc: .* damaged: its digest does not match"):
        open_scene(path)


def test_a_file_of_another_program_is_read_and_its_damage_named(tmp_path):
    path = without_digest(a_file(tmp_path))
    assert len(open_scene(path)) == 3
    flip(path, place_of(path, "temperature"))
    with pytest.raises(ValueError, match=r"scene\.nc: 'temperature' of frame 0 cannot be read"):
        open_scene(path).frame(0)


def test_a_file_at_which_hdf5_takes_too_long_is_given_up(tmp_path, monkeypatch):
    path = without_digest(a_file(tmp_path))
    with monkeypatch.context() as patch:
        patch.setattr(digest, "PATIENCE", 0.0)
        # HDF5 may be faster than the timer: this reader waits.
        patch.setattr(digest, "partial", lambda *_: partial(sleep, 60))
        with pytest.raises(ValueError, match=r"scene\.nc: .*HDF5: .* no answer in 0 s"):
            open_scene(path)
    # The length of the first text in the global heap: HDF5 2.0 never ends reading it.
    flip(path, path.read_bytes().index(b"GCOL") + 25, 2)
    monkeypatch.setattr(digest, "PATIENCE", 2.0)
    with pytest.raises(ValueError, match=r"scene\.nc: .*(HDF5: .* no answer in 2 s|is damaged)"):
        open_scene(path)


@pytest.mark.parametrize(
    "change",
    [{"chunks": (2, 4)}, {"shuffle": False}, {"fletcher32": True}, {"fillvalue": 7}],
    ids=str,
)
def test_a_chunk_is_as_hdf5_reads_and_writes_it(tmp_path, change):
    values = np.random.default_rng(1).normal(size=(3, 4)).astype(np.float32)
    options = {"chunks": (1, 4), "fillvalue": 7, **COMPRESSION, **change}
    with h5py.File(tmp_path / "T.h5", "w") as file:
        one = file.create_dataset("one", (3, 4), np.float32, **options)
        one[:2] = values[:2]
        for index in range(3):
            np.testing.assert_array_equal(read_chunk(one, index), one[index])
        other = file.create_dataset("other", (3, 4), np.float32, chunks=(1, 4), **COMPRESSION)
        other.id.write_direct_chunk((1, 0), chunk_of(values[1]))
        np.testing.assert_array_equal(other[1], values[1])


def test_a_compression_that_needs_a_plugin_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "hdf5plugin", None)
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_chunk((4,))
    settings.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, (1,))  # Zstandard
    with h5py.File(tmp_path / "T.h5", "w") as file:
        space = h5py.h5s.create_simple((4,))
        h5py.h5d.create(file.id, b"T", h5py.h5t.IEEE_F32LE, space, settings)
    with pytest.raises(SourceError, match=r"T\.h5: needs hdf5plugin; .*\[grid\]"):  # noqa: SIM117
        with ExitStack() as stack:
            open_arrays(str(tmp_path / "T.h5"), stack)
