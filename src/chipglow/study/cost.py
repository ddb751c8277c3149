"""Expected cost of a study: time, disk and memory."""

from dataclasses import dataclass
from math import ceil
from typing import Final

from numba import get_num_threads

from chipglow.study.schema import Study

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
"""Memory in bytes: of the libraries, and of a frame's samples in all that is computed of them."""


@dataclass(frozen=True)
class Cost:
    """Seconds, bytes of the cache and bytes of memory of a study that has not been cut before."""

    seconds: float
    disk: float
    memory: float


def expected_cost(study: Study) -> Cost:
    """Return the cost of a study on this machine, accurate within about a factor of two."""
    cutting, camera = study.cutting, study.camera
    view, window = cutting.field_of_view, cutting.window
    samples = view.rows * view.columns
    cell = cutting.numerics.cell
    down, across = (n * view.spacing / cell + _NODES_BEYOND for n in (view.rows, view.columns))
    kept = window.later_bands * ceil(window.band_duration / window.interval)
    frames = ceil(cutting.duration / window.interval) + kept
    solver = cutting.simulation().point_steps / (_POINT_STEPS * get_num_threads())
    exposed = ceil(camera.integration_time / window.interval)
    exposures = study.analysis.exposures + window.later_bands + 1
    return Cost(
        seconds=_ALWAYS
        + solver
        + _SECONDS_A_SAMPLE * frames * samples
        + _ANALYSIS_SECONDS * exposures * exposed * samples,
        disk=_BYTES_A_NODE * frames * down * across,
        memory=_MEMORY + _MEMORY_A_SAMPLE * samples,
    )
