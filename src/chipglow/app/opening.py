"""Inputs of the app: scenes, results, measurements, and files of cameras and other programs."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from secrets import token_urlsafe
from shutil import rmtree
from tempfile import TemporaryDirectory
from typing import Any, Final, TypeAlias

import numpy as np
from h5py import is_hdf5

from chipglow.analysis import spread_starts
from chipglow.analysis.cut import lacking, middle_start
from chipglow.analysis.places import LINE_REACH, TOUCHING
from chipglow.app.asking import (
    ASKED,
    Content,
    MissingSettingsError,
    camera_frames,
    described,
    description_text,
    imported,
    save_description,
)
from chipglow.app.controls import CURSOR, LINES, Controls, rounded, shown_study
from chipglow.app.frames_model import CorrectionModel, MeasuredFrames, MeasurementModel
from chipglow.app.models import Model
from chipglow.app.scene_model import SceneModel, with_samples
from chipglow.chip import Instant, Segment
from chipglow.correction import Correction, read_correction
from chipglow.io import (
    FileKind,
    StoredScene,
    checked_kind,
    example_scene,
    file_kind,
    open_measurement,
    open_scene,
)
from chipglow.io.cameras.formats import load_libraries
from chipglow.io.file_kind import MEASURED
from chipglow.io.sandbox import ReaderProcess, Sandbox
from chipglow.laboratory.emissivity import PlacesDescription, load_places
from chipglow.laboratory.recordings import StoredFrames
from chipglow.quantities import Array, unchecked
from chipglow.scene import Raster, Scene
from chipglow.study import Study, cut, is_cut, load_study
from chipglow.surface import UniformSurface
from chipglow.text import parse_yaml, read_small_text, read_yaml

QUICK_SAMPLES: Final = 35_000
"""Samples of a frame up to which a picture is computed at once, without a coarser one before."""

MOST_UPLOADED: Final = 512 * 1024**2
"""Maximum size of an uploaded file in bytes."""

_MOST_OPEN: Final = 8
"""Uploaded files that stay open; older ones are closed."""

SHOWN: Final = ("start", "images", "scene_image", "error_image", "emissivity_uncertainty")
"""Settings of the page that a study does not have."""

SHOWN_LINE: Final = "# Shown in chipglow app: "

_SHOWN_KINDS: Final[tuple[FileKind, ...]] = (
    "scene", "results", "study", "correction", *MEASURED, *ASKED,
)  # fmt: skip
"""Kinds of files that have a page; a file of places has that of the file that it names."""

_Points: TypeAlias = Iterable[Any]
"""Pairs of x and y in m."""

_HALF_LINE: Final = 0.4
"""Half the length of a first line, as a fraction of the image: its ends are in the image."""


def scene_model(
    scene: Scene, study: Study, name: str, file: str | None, shown: Mapping[str, Any] | None = None
) -> SceneModel:
    """Open a scene at its developed shear band, else at its central frame; ValueError if too short.

    A study that the app saved contains cursor and lines; `shown` are its exposure and images.
    """
    if "plastic_strain" not in scene.fields and study.surface == Study().surface:
        study = unchecked(study, surface=UniformSurface(0.5))
    duration = study.camera.on(scene.raster, study.seed).frame_duration(scene.raster)
    start, places = middle_start(scene, duration), _through(scene.raster)
    coarse = with_samples(scene, QUICK_SAMPLES, fewer_frames=True)
    if segment := _developed(coarse, duration, study.analysis.exposures):
        start, places = segment.start, _across(segment)
    plan = study.analysis
    if CURSOR in plan.points and set(LINES.values()) <= plan.lines.keys():
        places = [[plan.points[CURSOR]], *(plan.lines[line] for line in LINES.values())]
    shown = {"start": rounded(start), **(shown or {})}
    opened = shown_study(_with_places(study, scene.raster, *places), **shown)
    controls = Controls.of_scene(opened, scene, duration)
    return SceneModel(name, scene, None if coarse is scene else coarse, controls, file)


def measurement_model(
    measured: MeasuredFrames, name: str, description: str = ""
) -> MeasurementModel:
    """Open a measurement with cursor and lines through the hottest pixel of its first frame."""
    first = measured.first
    study = _at_the_hottest(Study(), first.radiance_temperature()[0], first.raster)
    has_tool = first.tool is not None
    controls = Controls.of_measurement(study, measured.times, first.raster, has_tool)
    return MeasurementModel(name, measured, controls, description)


def correction_model(correction: Correction, name: str) -> CorrectionModel:
    """Open a correction with cursor and lines through the hottest pixel of its first frame."""
    data, raster = correction.data, correction.raster
    study = _at_the_hottest(Study(), data["temperature"][0].values, raster)
    controls = Controls.of_frames(study, data["time"].values, raster)
    return CorrectionModel(name, correction, controls)


def _at_the_hottest(study: Study, kelvins: Array, raster: Raster) -> Study:
    """Return a study with cursor and lines through the hottest pixel of an image."""
    if not np.isfinite(kelvins).any():
        return _with_places(study, raster, *_through(raster))
    row, column = np.unravel_index(int(np.nanargmax(kelvins)), kelvins.shape)
    return _with_places(study, raster, *_through(raster, (raster.x[column], raster.y[row])))


@dataclass(frozen=True)
class Asking:
    """A file of a camera or of another program, whose settings a page asks for.

    `error` states what is missing in `settings`; empty before they were tried.
    """

    path: Path
    name: str
    contents: tuple[Content, ...]
    error: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)
    source: str = ""
    places: PlacesDescription | None = None
    """See the models."""

    def answered(
        self,
        content: Content,
        settings: Mapping[str, str],
        folder: Path,
        process: ReaderProcess | None = None,
    ) -> "Model | Asking":
        """Open the file with settings, which are then saved beside it; else ask again.

        Scenes are imported into `folder`.
        """
        source = described(self.path)
        try:
            if content == "measurement":
                frames, known = camera_frames(source, settings, process)
                opened: Model = measurement_model(
                    frames, self.name, description_text(self.path, known)
                )
            else:
                file, known = imported(source, settings, folder)
                opened = open_scene_object(open_scene(file), None, self.name)
        except MissingSettingsError as error:
            return replace(self, error=self._by_name(str(error)), settings=settings)
        if settings:
            save_description(self.path, known)
        opened = replace(opened, source=self.source)
        return opened if self.places is None else with_places(opened, self.places)

    def _by_name(self, message: str) -> str:
        return message.replace(str(self.path), self.name).replace(self.path.name, self.name)


def open_any(path: Scene | str | Path | None, study: Study | None = None) -> Model | Asking:
    """Open what the app shows; without a path the bundled scene.

    A scene, a measurement, a correction, a study or results are opened. A file of a camera or of
    another program may lack settings.
    """
    if path is None:
        return open_scene_object(example_scene(), study, "bundled scene")
    if isinstance(path, Scene):
        return open_scene_object(path, study, "scene")
    path = Path(path)
    if file_kind(path) == "places":
        return _session(path)
    return replace(_opened(path, study), source=str(path.resolve()))


def _session(path: Path) -> Model | Asking:
    """Open the file that a session names, with its places and view."""
    places = load_places(path)
    if places.file is None:
        raise ValueError(f"{path}: file: is missing; state the measurement or camera file to open")
    file = path.parent / places.file
    if not file.exists():
        raise FileNotFoundError(f"{path}: file: {file}: there is no such file")
    if file_kind(file) == "places":
        raise ValueError(f"{path}: file: {file} is a session too, expected a measurement")
    return with_places(open_any(file), places)


def with_places(opened: Model | Asking, places: PlacesDescription) -> Model | Asking:
    """Return an open file with the places, view and point spread function of a session."""
    if isinstance(opened, MeasurementModel) and places.psf is not None:
        controls = opened.controls.with_psf(places.psf)
        return replace(opened, places=places, controls=controls)
    return replace(opened, places=places)


def _opened(path: Path, study: Study | None) -> Model | Asking:
    """Open a file or folder by its content."""
    kind = checked_kind(path, "a scene, an image or a study", *_SHOWN_KINDS)
    if path.is_dir() and kind != "arrays":
        return _results(path)
    if kind == "correction":
        return correction_model(read_correction(path), path.name)
    if kind == "measurement":
        return measurement_model(StoredFrames(open_measurement(path)), path.name)
    if kind == "camera description":
        frames, _ = camera_frames(path, {})
        return measurement_model(frames, path.name, path.read_text(encoding="utf-8"))
    if kind in ASKED and not _may_be_scene(path):
        return Asking(path, path.name, ASKED[kind])
    if _is_yaml(path.name):
        return _study(path, path.name)
    try:
        return open_scene_object(open_scene(path), study, path.name)
    except ValueError:
        if kind not in ASKED:
            raise
        return Asking(path, path.name, ASKED[kind])


def _may_be_scene(path: Path) -> bool:
    """Return whether a file of others may have the variables of a scene."""
    return path.is_file() and bool(is_hdf5(path))


def open_scene_object(scene: Scene, study: Study | None, name: str) -> SceneModel:
    """Open a scene; a study of a scene without a file names ``scene.nc`` next to it."""
    file = str(scene.path.resolve()) if isinstance(scene, StoredScene) else "scene.nc"
    return scene_model(scene, study or Study(), name, file)


class OpenFiles:
    """The command's input and the uploads, by keys; the input's key is empty."""

    def __init__(self, first: Model | Asking) -> None:
        self._folder = TemporaryDirectory(prefix="chipglow-app-")
        self.folder = Path(self._folder.name)
        self.process = ReaderProcess()
        self._opened = {"": self._tried(first)}

    def warm(self) -> None:
        """Prepare to open a file, so that the first one takes no longer than others."""
        import_module("pandas.io.formats.style")  # of the table; it imports Matplotlib
        import_module("dask.array")  # xarray imports it for the first dataset
        with self.process.used():
            Sandbox("reader").answer(load_libraries)
        band = Study().camera.build().band
        band.temperature(band.radiance(np.full((2, 2), 600.0)))  # K: loads compiled kernels
        raster = Raster(0.0, 1e-6, 1e-6, 2, 2)  # m
        Controls.of_measurement(Study(), np.zeros(1), raster, has_tool=False)  # reads the schema

    def find(self, key: str) -> Model | Asking | None:
        """Return an open file by its key; None if it is not open."""
        return self._opened.get(key)

    def store(self, name: str, content: bytes) -> Path:
        """Write an uploaded file to a folder of its own."""
        folder = self.folder / token_urlsafe(12)  # bytes: nobody can guess it
        folder.mkdir()
        path = folder / Path(name).name
        path.write_bytes(content)
        return path

    def add(self, path: Path) -> str:
        """Open an uploaded file and return its key; the oldest of too many is removed."""
        key = path.parent.name
        try:
            self._opened[key] = self._tried(open_uploaded(path, path.name, self._opened.values()))
        except (ValueError, OSError):
            rmtree(path.parent)
            raise
        for old in list(self._opened)[1:-_MOST_OPEN]:
            del self._opened[old]
            rmtree(self.folder / old)
        return key

    def answer(self, key: str, content: Content, settings: Mapping[str, str]) -> Model | Asking:
        """Open a file with settings; it is still asking if they do not suffice."""
        asking = self._opened[key]
        assert isinstance(asking, Asking)
        self._opened[key] = self._answered(asking, content, settings)
        return self._opened[key]

    def close(self) -> None:
        self.process.close()
        self._folder.cleanup()

    def _tried(self, opened: Model | Asking) -> Model | Asking:
        """Open a file without settings, or by its description, if its content is clear."""
        if isinstance(opened, Asking) and len(opened.contents) == 1:
            return self._answered(opened, opened.contents[0], {})
        return opened

    def _answered(
        self, asking: Asking, content: Content, settings: Mapping[str, str]
    ) -> Model | Asking:
        folder = self.folder / f"scene-{token_urlsafe(6)}"
        folder.mkdir()
        return asking.answered(content, settings, folder, self.process)


def open_uploaded(path: Path, name: str, others: Iterable[Model | Asking] = ()) -> Model | Asking:
    """Open an uploaded file by the name that its owner gave it.

    An uploaded study shows the scene of its name among the `others` that are open, or its cut.
    """
    try:
        if _is_yaml(name):
            others = list(others)
            return _session_of_open_file(path, others) or _study_of_open_scene(path, name, others)
        opened = open_any(path)
    except (ValueError, OSError) as error:
        message = str(error).replace(str(path), name).replace(path.name, name)
        raise ValueError(message) from None
    if isinstance(opened, SceneModel):
        return replace(opened, name=name, file=name, source=name)
    return replace(opened, name=name, source=name)


def _results(folder: Path) -> SceneModel:
    file = folder / "study.yaml"
    if not file.is_file():
        raise FileNotFoundError(f"{folder}: holds no study.yaml, expected a folder of results")
    return _study(file, folder.name)


def _is_yaml(name: str) -> bool:
    return name.lower().endswith((".yaml", ".yml"))


def _study(file: Path, name: str) -> SceneModel:
    """Open the scene of a study."""
    study = load_study(file)
    if study.scene is None and not is_cut(study):
        raise ValueError(
            f"{file}: the scene of this study is not in the cache; compute it with "
            f"chipglow cut {file}, or open a scene file"
        )
    scene = open_scene(study.scene or cut(study))
    return scene_model(scene, study, name, study.scene, _shown_of(file))


def _shown_of(path: Path) -> dict[str, Any]:
    """Return what a study that the app saved shows: the settings `SHOWN`; of others nothing."""
    for line in read_small_text(path).splitlines():
        if line.startswith(SHOWN_LINE):
            shown = parse_yaml(line.removeprefix(SHOWN_LINE))
            return shown if isinstance(shown, dict) and shown.keys() <= set(SHOWN) else {}
    return {}


def _session_of_open_file(path: Path, others: Iterable[Model | Asking]) -> Model | Asking | None:
    """Return the open file that a session names, with its places; None for another file."""
    if file_kind(path) != "places":
        return None
    places = load_places(path)
    named = Path(places.file or "").name
    for other in others:
        if not isinstance(other, Asking) and named == Path(other.source).name:
            return with_places(other, places)
    raise ValueError(f"{path}: its file {named or 'is not stated'}: open that file first")


def _study_of_open_scene(path: Path, name: str, others: Iterable[Model | Asking]) -> SceneModel:
    data = read_yaml(path)
    named = data.get("scene") if isinstance(data, dict) else None
    if named is None:
        return _study(path, name)
    for other in others:
        if isinstance(other, SceneModel) and other.file == named:
            return scene_model(other.scene, load_study(path), name, named, _shown_of(path))
    raise ValueError(f"{path}: its scene {named} is not open here: open that file first")


def _with_places(study: Study, raster: Raster, *places: _Points) -> Study:
    """Return a study with a cursor and lines within the image, to a tenth of a micrometre."""
    left, right, bottom, top = raster.extent
    (cursor,), *lines = (
        np.round(np.clip(list(points), (left, bottom), (right, top)), 7).tolist()
        for points in places
    )
    corners = (tuple(map(tuple, line)) for line in lines)
    plan = study.analysis
    points = {**plan.points, CURSOR: tuple(cursor)}
    own = {**plan.lines, **dict(zip(LINES.values(), corners, strict=True))}
    return unchecked(study, analysis=unchecked(plan, points=points, lines=own))


def _developed(scene: Scene, duration: float, count: int) -> Segment | None:
    """Return the segment with the hottest middle of a shear band, if there is band and contact."""
    if any(lacking(scene)):
        return None
    starts = spread_starts(scene, duration, count)
    instants = [Instant.at(scene, float(start), duration) for start in starts]
    heat = {i: one.temperatures[one.band.middle] for i, one in enumerate(instants) if one.band}
    if not heat:
        return None
    segment = Segment.of(scene, instants[max(heat, key=heat.__getitem__)], duration, TOUCHING)
    return segment if segment.contact_length > 0 else None


def _across(segment: Segment) -> list[_Points]:
    """Return a cursor on the rake face, and lines across it and across the shear band."""
    middle = segment.tool.rake_point(segment.contact_length / 2)
    reach = LINE_REACH * np.asarray(segment.tool.rake_normal)
    band = segment.band.across(LINE_REACH, LINE_REACH).points[[0, -1]]
    return [[middle], [middle - reach, middle + reach], band]


def _through(raster: Raster, place: tuple[float, float] | None = None) -> list[_Points]:
    """Return a cursor at a place, by default the image's centre, and lines through it."""
    left, right, bottom, top = raster.extent
    x, y = place or ((left + right) / 2, (bottom + top) / 2)
    across, up = _HALF_LINE * (right - left), _HALF_LINE * (top - bottom)
    return [[(x, y)], [(x - across, y), (x + across, y)], [(x, y - up), (x, y + up)]]
