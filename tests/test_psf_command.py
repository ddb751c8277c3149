"""`chipglow psf`: from measurements to a point spread function that a study's camera takes."""

import numpy as np
import pytest
import xarray as xr
from command import typed
from synthetic_edge import (
    BAND,
    annular_edge,
    edge_radiance,
    gaussian_aperture,
    gaussian_edge,
    measurement_of,
    tailed_edge,
)

from chipglow.camera import Flag, MeasuredPSF
from chipglow.io import write_measurement
from chipglow.laboratory.psf import load_apertures
from chipglow.study import Study
from chipglow.text import DescriptionError

COLD, HOT = BAND.radiance(np.array([600.0, 900.0]))
STEP = HOT - COLD


def write_edge(path, normal=5.0, edge=None, flags=None, noise=0.005, side=40):
    edge = edge or gaussian_edge(10e-6)
    radiance = edge_radiance(edge, normal, side, background=COLD, step=STEP)
    radiance += np.random.default_rng(int(normal)).normal(0.0, noise * STEP, radiance.shape)
    write_measurement(measurement_of(radiance, flags), path)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_edge(tmp_path / "edge.nc")
    return tmp_path


def psf(arguments, code=0):
    return typed(f"psf {arguments}", code).output


def across(output):
    """Uncertainty of the width across the edges alone in um."""
    return float(output.split("alone it is known to ")[1].split(" um")[0])


def found_width(output):
    return [float(n) for n in output.split("spread function is ")[1].split(" um")[0].split(" ± ")]


def test_the_command_prints_and_writes_the_best_model(folder):
    write_edge(folder / "other.nc", 95.0)
    output = psf("edge.nc other.nc --out psf.nc")
    width, uncertainty = found_width(output)
    assert abs(width - 10.0) < 3 * across(output) < 0.3
    assert uncertainty == pytest.approx(0.64, abs=0.005)  # printed with two digits
    assert "kind: gaussian, fwhm: " in output
    assert "they agree" in output
    assert "Assumed: The whole square of a pixel takes light" in output
    assert "Warning" not in output
    assert output.rstrip().endswith("psf.nc")
    camera = Study(camera={"psf": {"kind": "measured", "file": "psf.nc"}}).camera.build()
    assert isinstance(camera.psf, MeasuredPSF)
    # By samples of the kernel: 0.2 % measured.
    assert camera.psf.fwhm == pytest.approx(10e-6, rel=0.01)
    data = xr.load_dataset("psf.nc", engine="h5netcdf")
    assert data.attrs["model"] == "gaussian"
    assert data["edge1_esf"].size == data["edge1_distance"].size
    assert data["edge1_mtf"].attrs["units"] == "1"
    # By the noise: 0.05 % measured.
    assert data["gaussian"].values == pytest.approx([10e-6], rel=0.002)
    assert data["gaussian_covariance"].shape == (1, 1)


def test_a_tail_is_kept_in_the_file(folder):
    write_edge(folder / "tail.nc", edge=tailed_edge(8e-6, 0.2, 20e-6), side=64)
    assert "tail fraction" in psf("tail.nc --out psf.nc")
    read = MeasuredPSF.from_file("psf.nc")
    half = len(read.weights) // 2
    x = (np.arange(len(read.weights)) - half) * read.spacing
    beyond = read.weights[np.hypot(x, x[:, None]) > 30e-6].sum()
    # (1 + r / L) exp(−r / L) of the tail's 20 % is beyond r = 30 um.
    assert beyond == pytest.approx(0.2 * 2.5 * np.exp(-1.5), rel=0.15)


def test_apertures_come_from_a_list(folder):
    for size in (40, 80, 160):
        image = gaussian_aperture(10e-6, size * 1e-6)
        write_measurement(measurement_of(COLD + image.radiance / 5 * STEP), f"d{size}.nc")
    lines = [f"  - {{file: d{size}.nc, diameter: {size} um}}" for size in (40, 80, 160)]
    (folder / "apertures.yaml").write_text("\n".join(["apertures:", *lines]))
    psf("edge.nc --apertures apertures.yaml --plot psf.png")
    assert (folder / "psf.png").read_bytes().startswith(b"\x89PNG")
    assert load_apertures("apertures.yaml")[1][1] == pytest.approx(80e-6)
    (folder / "apertures.yaml").write_text("apertures: [{file: d40.nc, diameter: 40}]")
    with pytest.raises(DescriptionError, match=r"apertures\.0\.diameter: 40 has no unit"):
        load_apertures("apertures.yaml")


def test_diffraction_beside_a_dead_pixel_is_drawn_and_doubts_are_printed(folder):
    flags = np.zeros((1, 40, 40), np.uint8)
    flags[0, 5, 5] = Flag.DEAD
    write_edge(folder / "dead.nc", 0.0, annular_edge(4.45e-6, 0.28, 0.35), flags)
    output = psf("dead.nc --plot psf.pdf")
    assert "kind: annular-aperture, wavelength: 4.45 um" in output
    assert "Warning: dead.nc: With a tilt of" in output
    assert (folder / "psf.pdf").stat().st_size > 1000


def write_counts(offset=300.0):
    """Counts of an edge as a camera's file, cut off at 0 and 16 bits."""
    radiance = edge_radiance(gaussian_edge(10e-6), 5.0)
    noise = np.random.default_rng(7).normal(0.0, 20.0, (4, *radiance.shape))
    counts = np.clip(np.round(offset + 400.0 * radiance + noise), 0, 65_535)
    np.save("edge.npy", counts.astype(np.uint16))


COUNTS = "--set unit=counts --set 'interval=1 ms' --set 'pitch=6 um' --set 'band=3.8-5.1 um'"


def test_counts_cut_off_at_zero_serve_for_an_edge(folder):
    write_counts(offset=-1000.0)
    output = psf(f"edge.npy {COUNTS} --plot psf.png")
    width, _ = found_width(output)
    assert abs(width - 10.0) < 3 * across(output) < 0.6
    assert "Assumed: The counts are linear in the radiance" in output
    assert "below the camera's lower range limit" in output


def test_a_blade_colder_than_the_calibration_serves_for_an_edge(folder):
    write_counts()
    (folder / "calibration.yaml").write_text(
        "model: linear\nband: 3.8-5.1 um\nlowest: 290 degC\nhighest: 310 degC\n"
        "parameters: {offset: 300, gain: 4}\ncovariance: [[1, 0], [0, 0.01]]\n"
    )
    output = psf(f"edge.npy {COUNTS} --set calibration=calibration.yaml")
    assert abs(found_width(output)[0] - 10.0) < 0.1  # in um, as printed: no difference measured
    assert "Warning" not in output


def test_a_measurement_under_the_cameras_range_serves_for_an_edge(folder):
    flags = np.full((1, 40, 40), 0, np.uint8)
    flags[0, :, :20] = Flag.UNDER_RANGE
    write_edge(folder / "cold.nc", flags=flags)
    output = psf("cold.nc")
    # The same pixels: printed alike.
    assert found_width(output)[0] == pytest.approx(found_width(psf("edge.nc"))[0], abs=1e-3)
    assert "Assumed: 50 % of the pixels of cold.nc are below the range" in output


def test_the_fill_factor_of_a_cameras_file_is_taken(folder):
    write_counts()
    output = psf(f"edge.npy {COUNTS}")
    assert "below the camera's lower range limit" not in output
    whole, _ = found_width(output)
    assert abs(whole - 10.0) < 3 * across(output) < 0.6
    small = found_width(psf(f"edge.npy {COUNTS} --set fill_factor=0.36"))[0]
    # The optics are wider if the pixel adds less: squares of the sides, as of a box, over 12.
    sides = (6.0**2 - 3.6**2) * 8 * np.log(2) / 12
    # Two fits, each with its noise: 4 % measured.
    assert small**2 - whole**2 == pytest.approx(sides, rel=0.08)
    assert "fill_factor" in psf(f"edge.npy {COUNTS} --set fill_factor=2", code=2)


def write_gamma(gamma, noise=0.002, fwhm=12e-6):
    """Counts of 8 bits of an edge from 0.1 to 0.9 of the range, as a video camera makes them."""
    radiance = edge_radiance(gaussian_edge(fwhm), 5.0, 48, background=0.1, step=0.8)
    radiance += np.random.default_rng(5).normal(0.0, noise, radiance.shape)
    counts = np.round(255 * np.clip(radiance, 0.01, 1.0) ** (1 / gamma))
    np.save("edge.npy", counts.astype(np.uint8)[None])


@pytest.mark.parametrize(
    ("gamma", "noise", "warning"),
    [
        (1.0, 0.002, ""),
        (1.0, 0.01, ""),
        (
            2.2,
            0.002,
            "may not be linear in the radiance: the edge-spread function is not symmetric",
        ),
        (1.4, 0.002, "Counts with a gamma, an automatic contrast"),
        (2.2, 0.04, "to show even a gamma of 2.2; set a calibration, or average more frames"),
    ],
)
def test_a_gamma_is_told_by_the_edge_and_a_straight_line_is_not(folder, gamma, noise, warning):
    write_gamma(gamma, noise)
    output = " ".join(psf(f"edge.npy {COUNTS} --out psf.nc").split())
    assert "Assumed: The counts are linear in the radiance, without a gamma" in output
    assert warning in output
    assert bool(warning) == ("linear in the radiance, but" in output or "may not be" in output)
    assert MeasuredPSF.from_file("psf.nc").fwhm > 0
