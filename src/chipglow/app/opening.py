"""What the app opens: a scene, a folder of results, a measurement, or the bundled scene."""

from dataclasses import dataclass, replace
from functools import partial
from math import ceil, sqrt
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from chipglow.analysis import spread_starts
from chipglow.app.controls import CURSOR, LINES, Controls, Corners, Point, rounded
from chipglow.app.probing import probed
from chipglow.camera import Measurement
from chipglow.io import StoredScene, example_scene, is_measurement, open_scene, read_measurement
from chipglow.io.sandbox import Sandbox, patience_for
from chipglow.laboratory.chip import Instant, contact_length
from chipglow.quantities import unchecked
from chipglow.scene import Material, Raster, Scene
from chipglow.study import Study, cut, is_cut, load_study
from chipglow.surface import UniformEmissivity

BUNDLED: Final = "bundled scene"
QUICK_SAMPLES: Final = 35_000
"""Samples of a frame up to which a picture is computed at once, without a coarser one before."""

MOST_UPLOADED: Final = 512 * 1024**2
"""Maximum size of an uploaded file in bytes."""

_REACH: Final = 60e-6
"""Half the length of the lines across rake face and shear band in m: the paper's."""

_PATIENCE: Final = 4.0
"""Factor on the time that reading an upload may take: the server has other work."""

_TOUCHING: Final = 3e-6

Places: TypeAlias = tuple[Point, Corners, Corners]
"""Cursor, line across the rake face and line across the shear band."""


@dataclass(frozen=True, eq=False)
class OpenedScene:
    """A scene and the controls of its study.

    `coarse` is the same scene with fewer samples, for a quick look; None where that is not needed
    or not possible. `from_file` marks a scene whose file a study can name.
    """

    name: str
    scene: Scene
    coarse: Scene | None
    controls: Controls
    from_file: bool = False

    @classmethod
    def of(cls, scene: Scene, study: Study, name: str, from_file: bool = False) -> "OpenedScene":
        """Open a scene in an exposure in its middle.

        Raises
        ------
        ValueError
            If the scene is shorter than the study's exposure.
        """
        if "plastic_strain" not in scene.fields and study.surface == Study().surface:
            study = unchecked(study, surface=UniformEmissivity(0.5))
        duration = study.camera.on(scene.raster, study.seed).frame_duration(scene.raster)
        starts = spread_starts(scene, duration, 3)
        start = rounded(starts[len(starts) // 2])
        places = _scene_places(scene, start, study.camera.integration_time)
        controls = Controls.of_scene(_with_places(study, places), scene, start, duration)
        coarse = with_samples(scene, QUICK_SAMPLES, fewer_frames=True)
        return cls(name, scene, None if coarse is scene else coarse, controls, from_file)


@dataclass(frozen=True, eq=False)
class OpenedMeasurement:
    """A measurement; its only control is the frame."""

    name: str
    measurement: Measurement

    @property
    def controls(self) -> Controls:
        """Controls with cursor and lines through the hottest pixel of the first frame."""
        measurement, raster = self.measurement, self.measurement.raster
        first = np.asarray(measurement.data["radiance_temperature"][0].values, np.float64)
        usable = np.where(measurement.usable[0], first, -np.inf)
        row, column = np.unravel_index(int(np.argmax(usable)), usable.shape)
        hottest = (float(raster.x[column]), float(raster.y[row]))
        places = _through(raster, hottest if np.isfinite(usable).any() else None)
        return Controls.of_measurement(_with_places(Study(), places), measurement.times, raster)


Opened: TypeAlias = OpenedScene | OpenedMeasurement


def open_any(path: str | Path | None, study: Study | None = None) -> Opened:
    """Open a scene, a measurement or a folder of results; without a path the bundled scene.

    Raises
    ------
    FileNotFoundError
        If it is not there.
    ValueError
        If it is none of these; the message names it.
    """
    if path is None:
        return OpenedScene.of(example_scene(), study or Study(), BUNDLED, from_file=True)
    path = Path(path)
    if path.is_dir():
        return _results(path)
    if is_measurement(path):
        return OpenedMeasurement(path.name, read_measurement(path))
    return OpenedScene.of(open_scene(path), study or Study(), path.name, from_file=True)


def open_uploaded(path: Path, name: str) -> Opened:
    """Open an uploaded file by the name that its owner gave it: first in a subprocess.

    Raises
    ------
    ValueError
        If it cannot be read, or takes more time or memory than an import may.
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


def with_samples(scene: Scene, count: int, fewer_frames: bool = False) -> Scene:
    """Return a spline scene with at most `count` samples a frame; others as they are.

    With fewer frames, time is coarser by the same factor.
    """
    step = ceil(sqrt(scene.raster.rows * scene.raster.columns / count))
    if step < 2 or not isinstance(scene, StoredScene) or scene.lattice is None:
        return scene
    return scene.coarser(step, step if fewer_frames else 1)


def _results(folder: Path) -> OpenedScene:
    """Open the scene of a folder of results with its study."""
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


def _with_places(study: Study, places: Places) -> Study:
    """Return a study whose places are the cursor and the lines."""
    cursor, *lines = places
    named = dict(zip(LINES.values(), lines, strict=True))
    analysis = unchecked(study.analysis, points={CURSOR: cursor}, lines=named)
    return unchecked(study, analysis=analysis)


def _scene_places(scene: Scene, start: float, duration: float) -> Places:
    """Return a cursor on the rake face and lines across it and across the shear band.

    For a scene without them: its middle and lines through it.
    """
    cursor, rake, band = _through(scene.raster)
    tool = scene.tool
    if tool is None:
        return cursor, rake, band
    index = int(np.searchsorted(scene.times, start + duration / 2)) - 1
    workpiece = scene.field("material", max(index, 0)) == Material.WORKPIECE
    contact = contact_length(scene.raster, workpiece, tool, _TOUCHING)
    if contact > 0:
        middle, normal = tool.rake_point(contact / 2), np.asarray(tool.rake_normal)
        cursor = _point(*middle)
        rake = _point(*(middle - _REACH * normal)), _point(*(middle + _REACH * normal))
    if "plastic_strain_rate" in scene.fields:
        ridge = Instant.at(scene, start, duration).band
        if ridge is not None:
            first, _, last = ridge.across(_REACH, _REACH).points
            band = _point(*first), _point(*last)
    return cursor, rake, band


def _through(raster: Raster, place: Point | None = None) -> Places:
    """Return a cursor at a place, by default the image's middle, and lines through it."""
    left, right, bottom, top = raster.extent
    x, y = place or ((left + right) / 2, (bottom + top) / 2)
    across, up = 0.4 * (right - left), 0.4 * (top - bottom)
    rake = _point(max(x - across, left), y), _point(min(x + across, right), y)
    return _point(x, y), rake, (_point(x, max(y - up, bottom)), _point(x, min(y + up, top)))


def _point(x: float, y: float) -> Point:
    """Round a position to a tenth of a micrometre, as links write it."""
    return round(float(x), 7), round(float(y), 7)
