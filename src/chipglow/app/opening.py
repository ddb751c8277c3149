"""What the app opens: a scene, a folder of results, a measurement, or the scene that it brings."""

from dataclasses import dataclass, replace
from functools import partial
from math import ceil, sqrt
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.starts import spread_starts
from chipglow.app.knobs import ControlPanel, Ends, Point, knobs_of
from chipglow.app.probing import probed
from chipglow.camera import Measurement
from chipglow.io import StoredScene, example_scene, is_measurement, open_scene, read_measurement
from chipglow.io.sandbox import Sandbox, patience_for
from chipglow.laboratory.chip import Instant, contact_length
from chipglow.scene import Material, Raster, Scene
from chipglow.study import Study, cut, is_cut, load_study
from chipglow.surface import UniformEmissivity

BUNDLED: Final = "bundled scene"
QUICK_SAMPLES: Final = 35_000
"""Samples of a frame up to which a picture is computed at once, without a coarse one before."""

MOST_UPLOADED: Final = 512 * 1024**2
"""Bytes that a file may have which is uploaded."""

_REACH: Final = 60e-6
"""Reach of the lines to either side of rake face and shear band in m: the paper's."""

_PATIENCE: Final = 4.0
"""Times as long as an import may take to answer: the server has other work besides."""

_TOUCHING: Final = 3e-6
_ROUNDED: Final = 1e-7


@dataclass(frozen=True, eq=False)
class OpenedScene:
    """A scene, and the study whose camera looks at it.

    Parameters
    ----------
    name : str
        What the page calls it.
    scene : Scene
        What is truly there.
    coarse : Scene or None
        The same with fewer samples, for a quick look; None where that is not needed or not to be
        had.
    panel : ControlPanel
        The knobs, and the study that they change.
    from_file : bool
        Whether the scene is a file that stays where it is, and a study can name it.
    """

    name: str
    scene: Scene
    coarse: Scene | None
    panel: ControlPanel
    from_file: bool = False

    @classmethod
    def of(cls, scene: Scene, study: Study, name: str) -> "OpenedScene":
        """A scene as a study sees it first: in an exposure in its middle.

        Raises
        ------
        ValueError
            If the scene is shorter than the study's exposure.
        """
        if "plastic_strain" not in scene.fields and study.surface == Study().surface:
            study = study.model_copy(update={"surface": UniformEmissivity(0.5)})
        duration = study.camera.on(scene.raster, study.seed).frame_duration(scene.raster)
        start = _start(scene, duration)
        place = _places(scene, start, study.camera.integration_time)
        initial = knobs_of(study, start, *place)
        coarse = with_samples(scene, QUICK_SAMPLES, fewer_frames=True)
        panel = ControlPanel.of(study, scene, initial, duration)
        return cls(name, scene, None if coarse is scene else coarse, panel)


@dataclass(frozen=True, eq=False)
class OpenedMeasurement:
    """A measurement: no truth, and no camera whose knobs could be turned.

    Parameters
    ----------
    name : str
        What the page calls it.
    measurement : Measurement
        Its frames.
    """

    name: str
    measurement: Measurement

    @property
    def panel(self) -> ControlPanel:
        """The one knob, the time, and lines across the middle."""
        place = _middle(self.measurement.raster)
        initial = knobs_of(Study(), float(self.measurement.times[0]), *place)
        return ControlPanel.of_times(initial, self.measurement.times, self.measurement.raster)


def open_any(
    path: str | Path | None, study: Study | None = None
) -> OpenedScene | OpenedMeasurement:
    """Open what a path names; without one the scene that comes with the app.

    Parameters
    ----------
    path : path-like, optional
        A scene or a measurement, or a folder of results whose scene is in the cache.
    study : Study, optional
        Surface and camera of a scene; the paper's by default.

    Raises
    ------
    FileNotFoundError
        If it is not there.
    ValueError
        If it is nothing of that; the message names it.
    """
    if path is None:
        opened = OpenedScene.of(example_scene(), study or Study(), BUNDLED)
        return replace(opened, from_file=True)
    path = Path(path)
    if path.is_dir():
        return _results(path)
    if is_measurement(path):
        return OpenedMeasurement(path.name, read_measurement(path))
    opened = OpenedScene.of(open_scene(path), study or Study(), path.name)
    return replace(opened, from_file=True)


def open_uploaded(path: Path, name: str) -> OpenedScene | OpenedMeasurement:
    """Open a file that came over the network: first in a subprocess, which it may break.

    Parameters
    ----------
    path : Path
        Where it is.
    name : str
        What its owner calls it.

    Raises
    ------
    ValueError
        If it cannot be read, or asks for more time or memory than an import may have.
    """
    patience = _PATIENCE * patience_for((str(path),))
    with Sandbox(name, patience).answers(partial(probed, path, name)) as answers:
        next(answers)
    try:
        opened = open_any(path)
    except (ValueError, OSError) as error:
        raise ValueError(str(error).replace(str(path), name)) from None
    if isinstance(opened, OpenedMeasurement):
        return OpenedMeasurement(name, opened.measurement)
    return replace(opened, name=name, from_file=False)


def _results(folder: Path) -> OpenedScene:
    """The scene of a folder of results, with the study beside it."""
    file = folder / "study.yaml"
    if not file.is_file():
        raise FileNotFoundError(f"{folder}: holds no study.yaml, expected a folder of results")
    study = load_study(file)
    if study.scene is not None:
        return OpenedScene.of(open_scene(study.scene), study, folder.name)
    if not is_cut(study):
        raise ValueError(
            f"{folder}: the scene of its study is not in the cache, expected that "
            f"chipglow run {file} --out {folder} was done on this machine, or a scene's file"
        )
    return OpenedScene.of(open_scene(cut(study)), study, folder.name)


def with_samples(scene: Scene, most: int, fewer_frames: bool = False) -> Scene:
    """The scene with so many samples a frame at most, if it is one of splines; else as it is.

    With fewer frames time is as much coarser as places are.
    """
    step = ceil(sqrt(scene.raster.rows * scene.raster.columns / most))
    if step < 2 or not isinstance(scene, StoredScene) or scene.lattice is None:
        return scene
    return scene.coarser(step, step if fewer_frames else 1)


def _start(scene: Scene, duration: float) -> float:
    """When the exposure begins in the middle of the scene's longest part."""
    starts = spread_starts(scene, duration, 3)
    return float(f"{starts[len(starts) // 2]:.9g}")


def _places(scene: Scene, start: float, duration: float) -> tuple[Point, Ends, Ends]:
    """A cursor on the rake face, and lines across it and across the shear band.

    Of a scene without them: its middle, and lines through that.
    """
    cursor, rake, band = _middle(scene.raster)
    tool = scene.tool
    if tool is None:
        return cursor, rake, band
    index = int(np.searchsorted(scene.times, start + duration / 2)) - 1
    workpiece = scene.field("material", max(index, 0)) == Material.WORKPIECE
    contact = contact_length(scene.raster, workpiece, tool, _TOUCHING)
    if contact > 0:
        middle, normal = tool.rake_point(contact / 2), np.asarray(tool.rake_normal)
        cursor = _point(middle)
        rake = (_point(middle - _REACH * normal), _point(middle + _REACH * normal))
    if "plastic_strain_rate" in scene.fields:
        found = Instant.at(scene, start, duration).band
        if found is not None:
            first, _, last = found.across(_REACH, _REACH).points
            band = (_point(first), _point(last))
    return cursor, rake, band


def _middle(raster: Raster) -> tuple[Point, Ends, Ends]:
    """A cursor in the middle of an image, and lines across it and up it."""
    left, right, bottom, top = raster.extent
    x, y = (left + right) / 2, (bottom + top) / 2
    across, up = 0.4 * (right - left), 0.4 * (top - bottom)
    points = ((x, y), (x - across, y), (x + across, y), (x, y - up), (x, y + up))
    cursor, *ends = (_point(np.array(one)) for one in points)
    return cursor, (ends[0], ends[1]), (ends[2], ends[3])


def _point(place: NDArray[np.float64]) -> Point:
    """A place to a tenth of a micrometre, as links write it."""
    x, y = (round(float(one) / _ROUNDED) * _ROUNDED for one in place)
    return float(f"{x:.12g}"), float(f"{y:.12g}")
