"""The result of an analysis: one Dataset, and the few objects that are no arrays."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.camera import Camera, Measurement
from chipglow.laboratory.chip import (
    ChipMetrics,
    Inertia,
    Instant,
    Segment,
    Segmentation,
    ShearBand,
)
from chipglow.laboratory.emissivity import HeatedObject
from chipglow.scene import Frame, Raster, Tool

if TYPE_CHECKING:
    from chipglow.analysis.places import Place
    from chipglow.analysis.plan import Plan


@dataclass(frozen=True, eq=False)
class CuttingForces:
    """Forces per width of cut in N/m over time in s, each of shape (n,), and their segments.

    `unaccounted` is the part of the drive's work that the energy balance of the cutting simulation
    does not account for at the end; NaN if the scene has no energy account.
    """

    time: NDArray[np.float64]
    cutting: NDArray[np.float64]
    thrust: NDArray[np.float64]
    segmentation: Segmentation
    unaccounted: float
    inertia: Inertia


@dataclass(frozen=True, eq=False)
class Cut:
    """What only a cut with a shear band and a contact at the rake face has.

    `instants` show the shear band over the scene's longest part without a gap, then in each of the
    `other_parts`; `developed` is the number of that with the fully developed band. `segments` are
    the exposures that are drawn: the developed one, then one of each other part. `moments` are
    frames before, with and after the developed band.
    """

    instants: tuple[Instant, ...]
    other_parts: int
    developed: int
    segments: tuple[Segment, ...]
    moments: tuple[Frame, ...]
    chip: ChipMetrics | None
    forces: CuttingForces | None
    heated: tuple[HeatedObject, ...]

    @property
    def one_segment(self) -> tuple[Instant, ...]:
        """The instants of the scene's longest part: how one band develops."""
        return self.instants[: len(self.instants) - self.other_parts]

    @property
    def band(self) -> ShearBand:
        """The fully developed shear band."""
        return self.segments[0].band


@dataclass(frozen=True, eq=False)
class Analysis:
    """The error of a camera against its scene.

    Parameters
    ----------
    data : xarray.Dataset
        Every number, in SI units; `chipglow.analysis.reductions` reads it.
    plan : Plan
        What was analysed.
    camera : Camera
        The camera.
    raster : Raster
        The scene's samples.
    frame : Frame
        The scene in the middle of the shown exposure.
    tool : Tool or None
        The scene's tool.
    places : tuple of Place
        Where the errors are read in the shown exposure.
    measurements : mapping
        By surface, one frame for each instant.
    cut : Cut or None
        What only a cut has.
    warnings, missing : tuple of str
        Sentences: what limits the validity of the results; what could not be analysed, and why.
    failed : mapping
        Parts of the analysis that failed, by title, with the reason.
    """

    data: xr.Dataset
    plan: "Plan"
    camera: Camera
    raster: Raster
    frame: Frame
    tool: Tool | None
    places: tuple["Place", ...]
    measurements: Mapping[str, Measurement]
    cut: Cut | None
    warnings: tuple[str, ...]
    missing: tuple[str, ...]
    failed: Mapping[str, str]
