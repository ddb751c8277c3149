"""Files with which the commands of a page can be tried, all simulated.

    python docs/sample_files.py PAGE [FOLDER]

writes those of one page, such as ``emissivity``, into a folder (the current one by default). The
pages offer them as an archive, which is made with the documentation.
"""

import argparse
import csv
import shutil
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import yaml
from numpy.typing import NDArray

HERE: Final = Path(__file__).parent
GENERATED: Final = HERE / "generated"
sys.path[:0] = [str(HERE), str(HERE.parent / "benchmarks"), str(HERE.parent / "tests")]

from analytic_chip import AnalyticChip  # noqa: E402
from camera_files import cine  # noqa: E402
from dot_target import DotTarget  # noqa: E402
from dual_spectrum import DualSpectrum  # noqa: E402
from PIL import Image  # noqa: E402
from samples import any_scene, programs  # noqa: E402
from samples.chip import COARSE, FIRST, closed_form_chip, late  # noqa: E402
from samples.edges import aperture, edge, measured  # noqa: E402
from samples.experiment import experiment  # noqa: E402
from samples.heated_chip import REGIONS, chip_emissivity, heated, heated_scene  # noqa: E402
from samples.sliding_chip import chip as sliding_chip  # noqa: E402

import chipglow  # noqa: E402
from chipglow.camera import (  # noqa: E402
    AnnularAperturePSF,
    Camera,
    DeadElements,
    Detector,
    EnergyResponse,
    GainPattern,
    Measurement,
    OffsetPattern,
    ReadNoise,
    Recording,
)
from chipglow.io import write_measurement, write_scene  # noqa: E402
from chipglow.io.cameras import write_hcc  # noqa: E402
from chipglow.radiometry import Band  # noqa: E402
from chipglow.scene import Raster  # noqa: E402

BAND: Final = Band(3.8e-6, 5.1e-6)
CELSIUS: Final = 273.15


def write_samples(page: str, folder: Path) -> None:
    """Write the files of one page into a folder."""
    SAMPLES[page](folder)


@cache
def folder(page: str) -> Path:
    """Folder with the files of one page, which goes when the program ends."""
    made = TemporaryDirectory()
    _made.append(made)
    write_samples(page, Path(made.name))
    return Path(made.name)


_made: Final[list[TemporaryDirectory[str]]] = []


def write_archive(page: str, path: Path) -> None:
    """Write the files of one page into an archive."""
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for file in sorted(path for path in folder(page).rglob("*") if path.is_file()):
            archive.write(file, file.relative_to(folder(page)))


def a_scene(folder: Path) -> None:
    """Write a chip in closed form: samples of 4 um, 10 frames."""
    write_scene(closed_form_chip(10), folder / "scene.nc")


def a_chip(folder: Path) -> None:
    """Write four frames of a chip in closed form with three sets of emissivities."""
    scene = late(AnalyticChip())
    camera = Camera(psf=AnnularAperturePSF(), integration_time=5e-6, lower_limit=573.15)
    starts = FIRST + np.array([5e-6, 15e-6, 25e-6, 35e-6])
    for name, surface in (("chip 1", chipglow.CHIP_1), ("chip 2", chipglow.CHIP_2)):
        data = camera.measure(scene, surface, starts).data.assign_attrs(surface=name)
        write_measurement(Measurement(data), folder / f"{name.replace(' ', '-')}.nc")
    write_measurement(experiment(camera, scene, starts), folder / "measured.nc")
    write_table(folder / "curve.csv", ("x_um", "y_um"), [(-12, 18), (-90, 80), (-190, 158)])


def recordings(folder: Path) -> None:
    """Write a recording by a camera, and numbers whose meaning must be stated."""
    write_hcc(folder / "chip.hcc", sliding_chip())
    counts = sliding_chip().signal[:, ::4, ::4]
    for number, frame in enumerate(counts[:2], 1):
        Image.fromarray(frame.astype(np.uint16)).save(folder / f"frames_{number}.tif")
        np.savetxt(folder / f"export_{number}.csv", 20.0 + 0.1 * frame, "%.1f", ",")
    import h5py

    with h5py.File(folder / "run.h5", "w") as file:
        file["chip/radiance"] = 0.5 * counts


def a_camera(folder: Path) -> None:
    """Write counts of a camera whose elements differ: a chip, flat-field sources, blackbodies."""
    generator, shape = np.random.default_rng(1), (48, 64)
    detector = Detector(
        response=EnergyResponse(1.8),
        gain=1.0,
        bits=14,
        terms=(GainPattern(0.03), DeadElements(0.004), OffsetPattern(40), ReadNoise(3.0)),
    )

    def record(name: str, kelvins: Any, frames: int) -> Recording:
        radiance = np.broadcast_to(BAND.radiance(kelvins), (frames, *shape))
        counts, times = detector.counts(radiance, generator), np.arange(frames) / 600
        written = Recording(
            counts,
            "counts",
            times,
            camera="simulated",
            integration_time=10e-6,
            saturation=detector.saturation,
        )
        write_hcc(folder / name, written)
        return written

    y, x = np.mgrid[: shape[0], : shape[1]]
    record("chip.hcc", 650 + 350 * np.exp(-((x - 40) ** 2 + (y - 20) ** 2) / 200.0), 8)
    record("cold.hcc", 350 + CELSIUS, 8)
    record("hot.hcc", 850 + CELSIUS, 8)
    rows = []
    for celsius in range(300, 1001, 100):
        recording = record("black-body.hcc", celsius + CELSIUS, 8)
        rows.append((celsius, f"{np.median(recording.signal.mean(axis=0)):.1f}", 2, 0.3))
    (folder / "black-body.hcc").unlink()
    columns = ("temperature_degC", "counts", "count_uncertainty", "temperature_uncertainty_K")
    write_table(folder / "points.csv", columns, rows)
    a_chip(folder)
    (folder / "chip-2.nc").rename(folder / "m.nc")
    for name in ("chip-1.nc", "measured.nc", "curve.csv"):
        (folder / name).unlink()


def a_heated_chip(folder: Path) -> None:
    """Write the heated chip of the page at three temperatures, and the scene of it."""
    emissivity, background = chip_emissivity()
    for name, celsius, frames in (("chip", 391.0, 10), ("470", 470.0, 3), ("570", 570.0, 3)):
        values = emissivity + 2e-4 * (celsius - 391.0)
        seen = heated(values, background, celsius + CELSIUS, frames=frames)
        write_small(seen, 1.0, folder / f"{name}.nc", lower_limit=473.15)
    write_scene(heated_scene(background, 391.0 + CELSIUS), folder / "scene.nc")
    regions = {
        region.name: {"polygon": np.array(region.shape.corners).tolist(), "feature": region.feature}
        for region in REGIONS
    }
    text = yaml.safe_dump({"regions": regions}, sort_keys=False, default_flow_style=None)
    (folder / "regions.yaml").write_text(text, encoding="utf-8")


def edges(folder: Path) -> None:
    """Write the edge of the page, and three apertures before the same source."""
    mirror = AnnularAperturePSF(4.45e-6)
    write_small(measured(edge(5.0, mirror), 573.15, 873.15, 1), 0.5, folder / "edge.nc")
    for seed, (name, diameter) in enumerate((("small", 50), ("middle", 200), ("large", 800)), 3):
        image = measured(aperture(diameter * 1e-6, mirror), 573.15, 873.15, seed)
        write_small(image, 2.0, folder / f"{name}.nc")


def two_cameras(folder: Path) -> None:
    """Write a chip and a target as both cameras see them, points, and an entry into the cut."""
    pair = DualSpectrum()
    raster, generator = pair.infrared.raster, np.random.default_rng(4)
    write_measurement(pair.infrared, folder / "infrared.nc")
    Image.fromarray(pair.visible).save(folder / "visible.png")
    target = target_before(raster)
    image = Measurement.from_radiance(target.infrared[None], BAND, [0.0], raster)
    write_small(image, 0.5, folder / "target.nc")
    Image.fromarray(target.visible).save(folder / "target.png")
    places = np.array([(25, 30), (120, 25), (60, 60), (130, 90), (30, 100), (90, 110)])
    seen = pair.pixels(np.stack((raster.x[places[:, 0]], raster.y[places[:, 1]]), axis=-1))
    write_points(folder / "points.csv", places, seen + generator.normal(0.0, 0.7, seen.shape))
    an_entry(folder, generator)


def target_before(raster: Raster) -> DotTarget:
    """Return a target before the cameras that look at the chip: their map is the same."""
    target, (left, right, bottom, top) = DotTarget(gaps=(19,)), raster.extent
    centre = ((left + right) / 2, (bottom + top) / 2)
    x, y = target.shift - target.matrix[:2, :2] @ centre
    return replace(target, raster=raster, centre=centre, shift=(float(x), float(y)))


def an_entry(folder: Path, generator: np.random.Generator) -> None:
    """Write a small region into which a chip enters after 20 ms; the clocks are 7 ms apart."""
    small = Raster(left=-120e-6, top=150e-6, spacing=6e-6, rows=25, columns=30)
    infrared, visible = np.arange(30) / 600, np.arange(0.0, 60e-3, 1 / 3000)

    def light(times: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(1 / (1 + np.exp((0.02 - times) / 1e-3)))[:, None, None]

    radiance = 60.0 + 400.0 * light(infrared) * np.ones(small.shape)
    attributes = {"integration_time": 10e-6}
    image = Measurement.from_radiance(radiance, BAND, infrared, small, attributes=attributes)
    write_measurement(image, folder / "entry.nc")
    bright = 60 + 120 * light(visible - 7e-3) * np.ones((100, 120))
    (folder / "entry.cine").write_bytes(cine(bright.astype(np.uint8), "8", 3000))
    places = np.array([(2, 3), (25, 2), (3, 21), (26, 22)])
    seen = 4 * places + 1.5 + generator.normal(0.0, 0.7, places.shape)
    write_points(folder / "entry.csv", places, seen)


def foreign_fields(folder: Path) -> None:
    """Write a chip in closed form as arrays in degrees Celsius, NaN where nothing is; meshes."""
    scene = AnalyticChip(raster=COARSE, frames=40, frame_spacing=1e-6).scene()
    data = scene.data.assign(temperature=scene.data["temperature"] - CELSIUS)
    digits = {"temperature": 1, "plastic_strain": 3, "plastic_strain_rate": -1}
    digits |= {"velocity_x": 3, "velocity_y": 3}
    material = data["material"].values
    rounded = {name: data[name].values.round(count) for name, count in digits.items()}
    fields = {name: np.where(material, values, np.nan) for name, values in rounded.items()}
    np.savez_compressed(folder / "chip.npz", material=material, **fields)
    programs.meshes(folder)


def given(*names: str) -> Callable[[Path], None]:
    """Files that lie in this folder."""

    def copied(folder: Path) -> None:
        for name in names:
            shutil.copy(HERE / name, folder)

    return copied


def write_small(
    measurement: Measurement, step: float, path: Path, lower_limit: float | None = None
) -> None:
    """Write a measurement whose radiance is rounded, well within its noise, for a small file."""
    radiance = step * np.round(measurement.radiance / step)
    write_measurement(
        Measurement.from_radiance(
            radiance, BAND, measurement.times, measurement.raster, lower_limit
        ),
        path,
    )


def write_points(path: Path, infrared: NDArray[Any], visible: NDArray[np.float64]) -> None:
    """Write points that are seen in both images."""
    columns = ("infrared_column", "infrared_row", "visible_column", "visible_row")
    write_table(path, columns, np.concatenate([infrared, np.round(visible, 1)], axis=1).tolist())


def write_table(path: Path, columns: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a table as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([columns, *rows])


SAMPLES: Final = {
    "any-scene": any_scene.samples,
    "camera-files": recordings,
    "compare": a_chip,
    "emissivity": a_heated_chip,
    "files": a_scene,
    "from-programs": programs.all_programs,
    "import": foreign_fields,
    "import-mesh": programs.meshes,
    "import-movie": given("data/hot-spot.avi"),
    "import-points": given("data/taichi-mpm99.npz"),
    "knife-edge": edges,
    "measurements": a_camera,
    "rake-face": a_chip,
    "registration": two_cameras,
    "shear-band": a_chip,
}


def main() -> None:
    """Write what is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("page", choices=SAMPLES)
    parser.add_argument("folder", type=Path, nargs="?", default=Path())
    wanted = parser.parse_args()
    wanted.folder.mkdir(parents=True, exist_ok=True)
    write_samples(wanted.page, wanted.folder)
    print(f"files of the page {wanted.page} are in {wanted.folder.resolve()}")


if __name__ == "__main__":
    main()
