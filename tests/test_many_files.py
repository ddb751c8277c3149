"""Many camera files in one command: one result each, nothing replaced, flat fields read once."""

import os
from functools import partial

import numpy as np
import pandas as pd
import pytest
from command import refusal, typed

from chipglow.io import read_measurement
from chipglow.io.sandbox import Sandbox, one_process
from chipglow.io.sources.source import SourceError
from chipglow.laboratory.recordings import camera_file, load_measurement

RADIANCES = (300.0, 400.0, 500.0)
SETTINGS = (
    "--set 'pitch=6 um' --set 'interval=1 ms' --set quantity=counts --set unit=counts "
    "--set calibration=calibration.yaml"
)
FLAT = "--set flat_field.low=low.npy --set flat_field.high=high.npy"
CALIBRATION = """
model: linear
band: 3.8-5.1 um
lowest: 20 degC
highest: 900 degC
parameters: {offset: 200, gain: 4}
covariance: [[1, 0], [0, 0.0001]]
"""


def save(name, frames, radiance):
    counts = np.round(200 + 4 * radiance).astype(np.uint16)
    np.save(f"{name}.npy", np.broadcast_to(counts, (frames, *counts.shape)))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Three recordings of even objects by pixels of different gain, and two flat fields."""
    monkeypatch.chdir(tmp_path)
    gain = 1 + 0.05 * np.random.default_rng(1).standard_normal((16, 20))
    gain /= np.median(gain)
    for name, radiance in (("low", 100.0), ("high", 800.0)):
        np.save(
            f"{name}.npy", np.round(np.full((8, 1, 1), 200) + 4 * radiance * gain).astype(np.uint16)
        )
    for number, radiance in enumerate(RADIANCES):
        np.save(
            f"f{number}.npy",
            np.round(np.full((2, 1, 1), 200) + 4 * radiance * gain).astype(np.uint16),
        )
    (tmp_path / "calibration.yaml").write_text(CALIBRATION, encoding="utf-8")
    (tmp_path / "regions.yaml").write_text("regions: {a: {rectangle: [[2, 2], [18, 14]]}}")
    return tmp_path


def test_each_file_becomes_a_measurement_of_its_name(folder):
    output = typed(f"convert f0.npy f1.npy f2.npy --out nc {SETTINGS} {FLAT}").output
    assert sorted(path.name for path in (folder / "nc").iterdir()) == ["f0.nc", "f1.nc", "f2.nc"]
    for number, radiance in enumerate(RADIANCES):
        image = read_measurement(f"nc/f{number}.nc").radiance
        # Counts of 4 for 1 W/(m² sr) are rounded; without the correction it is 5 %.
        assert image.std() < 0.3
        # Rounded counts, over 300 pixels: 1e-5 measured.
        assert image.mean() == pytest.approx(radiance, rel=1e-4)
    assert output.count("Assumed: No pixel is saturated") == 1  # the same of all files


def test_many_files_replace_nothing_that_is_there(folder):
    (folder / "nc").mkdir()
    (folder / "nc" / "f1.nc").write_text("mine")
    arguments = f"convert f0.npy f1.npy --out nc {SETTINGS}"
    assert "nc/f1.nc: already exists" in refusal(arguments)
    assert (folder / "nc" / "f1.nc").read_text() == "mine"
    assert not (folder / "nc" / "f0.nc").exists()
    typed(f"{arguments} --force")
    assert read_measurement("nc/f1.nc").radiance.shape == (2, 16, 20)


@pytest.mark.parametrize(
    ("sources", "out", "message"),
    [
        ("f0.npy sub/f0.npy", "nc", "nc/f0.nc: is the output of several files"),
        ("f0.npy f1.npy", "sub/f0.npy", "sub/f0.npy: is not a folder"),
        ("f0.npy", "low.npy", "low.npy: is also an input"),
        ("f0.npy none.npy f1.npy", "nc", "1 of 3 files cannot be used, the others are done; the"),
    ],
)
def test_outputs_of_many_files_are_checked(folder, sources, out, message):
    (folder / "sub").mkdir()
    (folder / "sub" / "f0.npy").write_bytes((folder / "f0.npy").read_bytes())
    before = (folder / "low.npy").read_bytes()
    assert message in refusal(f"convert {sources} --out {out} {SETTINGS} {FLAT}")
    assert (folder / "low.npy").read_bytes() == before
    if "none" in sources:
        assert (folder / "nc" / "f1.nc").exists()


def test_each_image_has_its_own_temperatures(folder):
    typed(
        f"temperature f0.npy f1.npy f2.npy --each --regions regions.yaml --emissivity 0.5 "
        f"--table t.csv {SETTINGS} {FLAT}"
    )
    found = pd.read_csv("t.csv")
    assert found.image.tolist() == ["f0.npy", "f1.npy", "f2.npy"]
    for row, name in zip(found.itertuples(), found.image, strict=True):
        typed(
            f"temperature {name} --regions regions.yaml --emissivity 0.5 --table one.csv "
            f"{SETTINGS} {FLAT}"
        )
        (alone,) = pd.read_csv("one.csv").itertuples()
        assert row.true_temperature_K == alone.true_temperature_K
    assert "--each and --study" in refusal(
        "temperature f0.npy --each --study s.yaml --regions regions.yaml --emissivity 0.5"
    )


def test_flat_fields_are_read_once_for_each_content(folder, monkeypatch):
    read, names = camera_file.read_recording, []

    def counted(file, *arguments, **more):
        names.append(str(file))
        return read(file, *arguments, **more)

    monkeypatch.setattr(camera_file, "read_recording", counted)
    fields = [
        "pitch=6 um", "interval=1 ms", "quantity=counts", "unit=counts",
        "calibration=calibration.yaml", "flat_field.low=low.npy", "flat_field.high=high.npy",
    ]  # fmt: skip
    first = load_measurement("f0.npy", fields).radiance
    load_measurement("f1.npy", fields)
    assert [name for name in names if "low" in name] == [str(folder / "low.npy")]
    np.save("low.npy", np.load("low.npy") + 50)
    assert abs(load_measurement("f0.npy", fields).radiance - first).max() > 1
    assert sum("low" in name for name in names) == 2


def test_readers_share_a_process_until_one_fails():
    sandbox = Sandbox("file")
    with one_process():
        first, second = (sandbox.answer(os.getpid) for _ in range(2))
        assert first == second
        with pytest.raises(SourceError, match="invalid literal"):
            sandbox.answer(partial(int, "damaged"))
        assert sandbox.answer(os.getpid) != first
    assert sandbox.answer(os.getpid) != sandbox.answer(os.getpid)
