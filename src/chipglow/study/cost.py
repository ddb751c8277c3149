"""Expected cost of a study: time, disk and memory."""

from dataclasses import dataclass
from math import ceil
from shutil import disk_usage
from typing import Final

from numba import get_num_threads

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


@dataclass(frozen=True)
class _Parts:
    """Parts of a cost, by the setting that determines each most."""

    seconds: dict[str, float]
    disk: float
    solver_memory: float
    """Bytes during the cut."""
    analysis_memory: dict[str, float]
    """Bytes during the analysis, after the cut."""

    @property
    def memory(self) -> dict[str, float]:
        """Bytes by setting, of cut and analysis."""
        return {_CELL: self.solver_memory, **self.analysis_memory}

    @property
    def cost(self) -> Cost:
        """The whole cost."""
        needed = max(self.solver_memory, sum(self.analysis_memory.values()))
        return Cost(_ALWAYS + sum(self.seconds.values()), self.disk, _MEMORY + needed)


def expected_cost(study: Study) -> Cost:
    """Return the cost of a study on this machine, accurate within about a factor of two."""
    return _parts(study).cost


def check_cost(study: Study) -> None:
    """Raise a ValueError that names a setting if this machine cannot run a cut and its analysis.

    Raises
    ------
    MemoryLimitError
        If it needs more memory than the limit.
    ValueError
        If it takes more than a year, or more disk than the cache has left.
    """
    parts = _parts(study)
    cost = parts.cost
    check_memory(_largest(study, parts.memory), cost.memory)
    if cost.seconds > _LONGEST:
        raise ValueError(
            f"{_largest(study, parts.seconds)}: the study takes about "
            f"{cost.seconds / 86400:.2g} days, expected up to {_LONGEST / 86400:.0f}"
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


def _parts(study: Study) -> _Parts:
    """Return the parts of the cost of a study."""
    cutting, window = study.cutting, study.cutting.window
    raster, cell = cutting.field_of_view.build(), cutting.numerics.cell
    simulation = cutting.simulation()
    samples = float(raster.rows) * raster.columns
    kept = window.later_bands * ceil(window.band_duration / window.interval)
    frames = ceil(cutting.duration / window.interval) + kept
    exposed = ceil(study.camera.integration_time / window.interval)
    exposures = study.analysis.exposures + window.later_bands + 1
    nodes_down, nodes_across = (
        n * raster.spacing / cell + _NODES_BEYOND for n in (raster.rows, raster.columns)
    )
    return _Parts(
        seconds={
            _CELL: simulation.point_steps / (_POINT_STEPS * get_num_threads()),
            _INTERVAL: _SECONDS_A_SAMPLE * frames * samples,
            _EXPOSURES: _ANALYSIS_SECONDS * exposures * exposed * samples,
        },
        disk=_BYTES_A_NODE * frames * nodes_down * nodes_across,
        solver_memory=_MEMORY_A_POINT * simulation.point_count,
        analysis_memory={
            _SPACING: _MEMORY_A_SAMPLE * samples,
            _PITCH: _MEMORY_A_SAMPLE * _pixels(raster, study.camera),
        },
    )


def _pixels(raster: Raster, camera: CameraSection) -> float:
    """Return the number of pixels that see a raster, about."""
    most = camera.array or (float("inf"), float("inf"))
    sides = raster.columns, raster.rows
    columns, rows = (
        min(n * raster.spacing / camera.pitch, one) for n, one in zip(sides, most, strict=True)
    )
    return columns * rows
