"""Expected cost of a study: time, disk and memory."""

from dataclasses import dataclass
from math import ceil
from shutil import disk_usage
from typing import Final

from numba import get_num_threads

from chipglow.cutting import CuttingSimulation
from chipglow.quantities import setting_at, value_text
from chipglow.quantities.units import LENGTH
from chipglow.scene import Raster
from chipglow.study.cache import FOLDER_VARIABLE, cache_folder
from chipglow.study.camera_section import CameraSection
from chipglow.study.schema import Study
from chipglow.text import check_memory

_POINT_STEPS: Final = 13e6
"""Point steps per second of one thread of the solver; measured: 13.5 to 14.5 million."""

_SECONDS_A_SAMPLE: Final = 80e-9
"""Sampling, packing and writing a frame of the scene, for each of its samples."""

_BYTES_A_NODE: Final = 18.0
"""Size of a scene file: nine splines, each coefficient of which takes 1.3 to 2 bytes."""

_NODES_BEYOND: Final = 6
"""Nodes beside those that lie among the samples, in either direction."""

_ANALYSIS_SECONDS: Final = 40e-9
"""Analysis, for each sample of each frame of each exposure that it reads."""

_ALWAYS: Final = 15.0
"""Seconds of any study: libraries, tables of the radiance, pictures."""

_MEMORY, _MEMORY_A_SAMPLE = 0.3e9, 1100.0
"""Memory in bytes: of the libraries, and of a frame's samples in all that is computed of them.

As much is assumed for a pixel, where a fine pitch makes more pixels than samples.
"""

_MEMORY_A_POINT: Final = 700.0
"""Memory of the solver in bytes a material point: its values twice, and those of a node."""

_LONGEST: Final = 365 * 86400.0
"""Time in s beyond which a study is refused: a mistake in a unit, not a long computation."""

_SPACING, _PITCH = "cutting.field_of_view.spacing", "camera.pitch"
_CELL, _INTERVAL = "cutting.numerics.cell", "cutting.window.interval"
_EXPOSURES: Final = "analysis.exposures"


@dataclass(frozen=True)
class Cost:
    """Seconds, bytes of the cache and bytes of memory of a study that has not been cut before."""

    seconds: float
    disk: float
    memory: float


def expected_cost(study: Study) -> Cost:
    """Return the cost of a study on this machine, accurate within about a factor of two."""
    return Cost(
        seconds=_ALWAYS + sum(_seconds(study).values()),
        disk=_disk(study),
        memory=_MEMORY + max(_solver_memory(study), sum(_analysis_memory(study).values())),
    )


def check_cost(study: Study) -> None:
    """Raise a ValueError that names a setting if this machine cannot run a cut and its analysis.

    Raises
    ------
    MemoryLimitError
        If it needs more memory than the limit.
    ValueError
        If it takes more than a year, or more disk than the cache has left.
    """
    cost, seconds = expected_cost(study), _seconds(study)
    memory = {_CELL: _solver_memory(study), **_analysis_memory(study)}
    check_memory(_largest(study, memory), cost.memory)
    if cost.seconds > _LONGEST:
        raise ValueError(
            f"{_largest(study, seconds)}: the study takes about {cost.seconds / 86400:.2g} days, "
            f"expected up to {_LONGEST / 86400:.0f}"
        )
    folder = cache_folder()
    while not folder.exists():
        folder = folder.parent
    if cost.disk > (left := disk_usage(folder).free):
        raise ValueError(
            f"{_valued(study, _INTERVAL)}: the scene takes about {cost.disk / 1e9:.2g} GB, "
            f"{folder} has {left / 1e9:.2g} GB left; choose fewer frames, or set {FOLDER_VARIABLE}"
        )


def check_view(raster: Raster, camera: CameraSection) -> None:
    """Raise a MemoryLimitError if the images of a scene do not fit into memory."""
    pixels = _pixels(raster, camera)
    samples = float(raster.rows) * raster.columns
    size = f"scene: {raster.columns} x {raster.rows} samples"
    what = size if pixels < samples else f"{_PITCH}: {LENGTH.text(camera.pitch)}"
    check_memory(what, _MEMORY + _MEMORY_A_SAMPLE * (samples + pixels))


def _largest(study: Study, parts: dict[str, float]) -> str:
    """Return the setting with the largest part of a cost, and its value."""
    return _valued(study, max(parts, key=parts.__getitem__))


def _valued(study: Study, path: str) -> str:
    setting = setting_at(study, path)
    return f"{path}: {value_text(setting.value, setting.parameter.quantity)}"


def _seconds(study: Study) -> dict[str, float]:
    """Return times in s by the setting that determines each most."""
    cutting, window = study.cutting, study.cutting.window
    samples = float(cutting.field_of_view.rows) * cutting.field_of_view.columns
    exposed = ceil(study.camera.integration_time / window.interval)
    exposures = study.analysis.exposures + window.later_bands + 1
    return {
        _CELL: cutting.simulation().point_steps / (_POINT_STEPS * get_num_threads()),
        _INTERVAL: _SECONDS_A_SAMPLE * _frames(study) * samples,
        _EXPOSURES: _ANALYSIS_SECONDS * exposures * exposed * samples,
    }


def _frames(study: Study) -> int:
    window = study.cutting.window
    kept = window.later_bands * ceil(window.band_duration / window.interval)
    return ceil(study.cutting.duration / window.interval) + kept


def _disk(study: Study) -> float:
    view, cell = study.cutting.field_of_view, study.cutting.numerics.cell
    down, across = (n * view.spacing / cell + _NODES_BEYOND for n in (view.rows, view.columns))
    return _BYTES_A_NODE * _frames(study) * down * across


def _solver_memory(study: Study) -> float:
    simulation: CuttingSimulation = study.cutting.simulation()
    return _MEMORY_A_POINT * simulation.point_count


def _analysis_memory(study: Study) -> dict[str, float]:
    """Return bytes by the setting that determines them."""
    raster = study.cutting.field_of_view.build()
    return {
        _SPACING: _MEMORY_A_SAMPLE * raster.rows * raster.columns,
        _PITCH: _MEMORY_A_SAMPLE * _pixels(raster, study.camera),
    }


def _pixels(raster: Raster, camera: CameraSection) -> float:
    """Return the number of pixels that see a raster, about."""
    most = camera.array or (float("inf"), float("inf"))
    sides = raster.columns, raster.rows
    columns, rows = (
        min(n * raster.spacing / camera.pitch, one) for n, one in zip(sides, most, strict=True)
    )
    return columns * rows
