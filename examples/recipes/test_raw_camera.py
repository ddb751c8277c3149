"""The recipe of a camera file: frames come back, damage is one error."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest
from raw_camera import HEADER, RAW, begins, read

from chipglow.io.cameras import CameraFormat
from chipglow.io.sources import SourceError


def written(path, frames):
    header = np.array([(b"RAW1", *frames.shape[1:], 500.0)], HEADER)
    path.write_bytes(header.tobytes() + frames.astype("<u2").tobytes())
    return path


def test_frames_come_back_with_their_times(tmp_path):
    frames = np.random.default_rng(1).integers(0, 65535, (5, 3, 4))
    path = written(tmp_path / "a.raw16", frames)
    assert begins(path.read_bytes()[:520])
    recording = read(path, slice(1, 4), None)
    np.testing.assert_array_equal(recording.signal, frames[1:4])
    np.testing.assert_allclose(recording.times, [5e-4, 1e-3, 1.5e-3])
    assert (recording.quantity, recording.saturation) == ("counts", 65534.0)


@pytest.mark.parametrize("length", [0, 10, 16, 20])
def test_a_file_that_is_cut_short_is_one_error_with_its_name(tmp_path, length):
    path = written(tmp_path / "a.raw16", np.zeros((1, 3, 4)))
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(SourceError, match=r"a\.raw16: truncated, expected"):
        read(path, None, None)


def test_an_entry_point_finds_the_format():
    entry = EntryPoint("raw", "raw_camera:RAW", "chipglow.camera_file")
    assert entry.load() is RAW
    assert isinstance(RAW, CameraFormat)
    assert RAW.states_quantity
