"""Running a study: cut or cached scene, camera, analysis."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import partial
from json import dumps
from pathlib import Path
from time import monotonic
from typing import Any, Final

import xarray as xr

from chipglow.analysis import (
    Analysis,
    Progress as Progress,
    analyse,
    cut_spots,
    lacking,
    point_spots,
    wavelength_errors,
)
from chipglow.cutting import SOLVER_VERSION, Checkpoint, SolverError
from chipglow.io import SCENE_FORMAT, SceneWriter, open_scene, unfinished_scenes
from chipglow.io.atomic import uninterrupted
from chipglow.io.digest import is_intact
from chipglow.quantities import adapter, unchecked
from chipglow.scene import Frame, SceneError, ToolOutline
from chipglow.study.cache import scene_path
from chipglow.study.cost import check_cost, check_view
from chipglow.study.fitting import Fitted, fit, left_to_the_paper
from chipglow.study.preview import preview_of, show_scene
from chipglow.study.schema import Study
from chipglow.text import Notes

CUTTING_STEP: Final = "cutting simulation"
PREVIEW_STEP: Final = "preview"
_BAND_PHASES: Final = 3
"""Positions of the pixels along each axis of many bands: seven and their pairs take minutes."""

CHECKPOINT_INTERVAL: Final = 30.0
"""Time in s between checkpoints of a simulation, if they are cheap."""

_CHEAP: Final = 100.0
"""Checkpoints are this many times as far apart as one takes, or more."""


def cut(
    study: Study,
    progress: Progress | None = None,
    resume: bool = False,
    on_preview: Callable[[Frame], None] | None = None,
) -> Path:
    """Return the file of the study's scene, from the cache or newly computed.

    Parameters
    ----------
    study : Study
        Only its section `cutting` matters.
    progress : callable, optional
        Called with the progress of the simulation; not called if the scene is cached.
    resume : bool
        Go on from the last checkpoint of a run of the same cut that was interrupted or killed, if
        there is one. The scene is the same to the last bit.
    on_preview : callable, optional
        Called with coarse frames (`preview_raster`) of the whole cut while it is computed, from
        where it starts or is resumed. If the scene is found in the cache: with frames of that.

    Returns
    -------
    Path
        The scene file in the cache, for `open_scene`.

    Raises
    ------
    SolverError
        If the simulation fails; the message names the last checkpoint, which is kept.
    """
    path = scene_path(scene_inputs(study))
    if not _is_whole(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        _compute(study, path, progress or silent, resume, on_preview)
    elif on_preview:
        tell = partial(progress or silent, PREVIEW_STEP)
        scene = open_scene(path)
        show_scene(scene, preview_of(study, on_preview), tell)
        scene.data.close()
    return path


def silent(step: str, fraction: float) -> None:
    """Report no progress."""


def is_cut(study: Study) -> bool:
    """Return whether the study's scene is in the cache."""
    return _is_whole(scene_path(scene_inputs(study)))


def is_damaged(study: Study) -> bool:
    """Return whether the study's scene in the cache is damaged; `cut` computes it again."""
    path = scene_path(scene_inputs(study))
    return path.exists() and not _is_whole(path)


def kept_progress(study: Study) -> float:
    """Return the fraction of the study's cut that earlier runs left at a checkpoint, 0 to 1."""
    return max(
        (left.progress for left in unfinished_scenes(scene_path(scene_inputs(study)))), default=0
    )


def run(study: Study, progress: Progress | None = None, resume: bool = False) -> Analysis:
    """Run a study: cut or open its scene, measure and analyse.

    Parameters
    ----------
    study : Study
        The study; the paper's is ``Study()``.
    progress : callable, optional
        Called with the current step and its completed fraction, 0 to 1.
    resume : bool
        As for `cut`.

    Returns
    -------
    Analysis
        All that the report shows: the paper's analysis of a cut; or, of a scene that shows no
        shear band or no contact with a tool, and at the user's places, the camera's error
        there and what is missing.

    Raises
    ------
    ValueError
        If the scene cannot be analysed as the study requires; the message names the scene file.
    """
    with fitted_study(study, progress, resume) as fitted:
        camera = study.camera.on(fitted.scene.raster, study.seed)
        analysis = analyse(
            fitted.scene,
            fitted.surfaces,
            camera,
            study.plan,
            progress,
            attribution=study.attribution,
            correction=study.known,
        )
        notes = fitted.notes
        warnings = (*notes.warnings, *analysis.warnings)
        return replace(analysis, assumed=tuple(notes.assumed), warnings=warnings)


def errors(study: Study, progress: Progress | None = None, resume: bool = False) -> Analysis:
    """Return the measurement error of any scene, exposure by exposure, at the study's places."""
    return run(unchecked(study, analysis=unchecked(study.analysis, cut=False)), progress, resume)


def wavelengths(study: Study, progress: Progress | None = None, resume: bool = False) -> xr.Dataset:
    """Compute the errors of the study's spectral bands, alone and as ratios of two.

    They are read at the rake face and in the shear band of a cut, or at the points of the section
    analysis, if given. The study's camera is given each band in turn.

    Parameters
    ----------
    study : Study
        The study.
    progress, resume
        As for `run`.

    Raises
    ------
    ValueError
        If the scene shows no band and no contact with a tool, and the study names no points.
    """
    plan = study.plan
    with fitted_study(study, progress, resume) as fitted:
        scene = fitted.scene
        camera = study.camera.on(scene.raster, study.seed)
        if study.analysis.points:
            spots = point_spots(scene, camera, plan, list(fitted.surfaces))
        else:
            if missing := list(lacking(scene)):
                raise ValueError(f"{missing[0]} Expected points to read (analysis.points).")
            spots = cut_spots(scene, camera, plan, progress)
        draws = min(plan.phases, _BAND_PHASES), plan.textures
        data = wavelength_errors(
            scene, fitted.surfaces, camera, study.wavelengths, spots, *draws, progress
        )
        doubts = [
            text
            for band in study.wavelengths.bands
            for surface in fitted.surfaces.values()
            for text in surface.origin.warnings(band, scene.metal)
        ]
        return data.assign_attrs((fitted.notes + Notes(warnings=doubts)).attrs())


@contextmanager
def fitted_study(study: Study, progress: Progress | None, resume: bool) -> Iterator[Fitted]:
    """Yield the scene and the surfaces of a study; errors name the scene file."""
    path = cut(study, progress, resume) if study.scene is None else Path(study.scene)
    try:
        scene = open_scene(path)
        check_view(scene.raster, study.camera)
        fitted, left = fit(study, scene), Notes(list(left_to_the_paper(study)))
        yield replace(fitted, notes=left + fitted.notes)
    except SceneError:
        raise
    except ValueError as error:
        if study.scene is None:
            raise
        raise ValueError(f"{study.scene}: {error}") from None


def scene_inputs(study: Study) -> dict[str, Any]:
    """Return all that determines the scene of a study's cut."""
    simulation = study.cutting.simulation()
    tool = simulation.tool
    cutting = adapter(type(study.cutting)).dump_python(study.cutting)
    del cutting["tool"]["outline"], cutting["workpiece_factors"]
    workpiece, tool_material = map(asdict, (simulation.workpiece, simulation.tool_material))
    del workpiece["name"], tool_material["name"]  # everything else in a material file counts
    return {
        "cutting": cutting,
        "outline": tool.points if isinstance(tool, ToolOutline) else None,
        "workpiece": workpiece,
        "law": type(simulation.workpiece.flow_stress).__qualname__,
        "tool": tool_material,
        "solver": SOLVER_VERSION,
        "format": SCENE_FORMAT,
    }


def _is_whole(path: Path) -> bool:
    return path.is_file() and bool(is_intact(path))


def _compute(
    study: Study,
    path: Path,
    progress: Progress,
    resume: bool,
    on_preview: Callable[[Frame], None] | None,
) -> None:
    check_cost(study)
    progress(CUTTING_STEP, 0.0)
    cutting = study.cutting
    raster = cutting.field_of_view.build()
    simulation = cutting.simulation()
    attributes: Mapping[str, str | float] = {
        "inputs": dumps(scene_inputs(study), sort_keys=True),
        "momentum_flow": simulation.momentum_flow,
        "mass_scaling": simulation.mass_scaling,
        "cell": simulation.numerics.cell,
        "resolution_warnings": "\n".join(simulation.resolution_warnings),
        "metal": simulation.workpiece.name.partition(", flow stress ")[0],
    }
    left = unfinished_scenes(path) if resume else []
    start = left[0] if left and left[0].progress > 0 else None
    state = Checkpoint(start.state(), start.progress) if start else None
    lattice = simulation.lattice(raster)
    writer = SceneWriter(path, raster, simulation.tool, attributes, lattice=lattice, resume=start)
    with writer:
        keeper = _Keeper(writer)
        if start and state:
            keeper.note = _kept(state, start.checkpoint)
        try:
            history = simulation.run(
                cutting.window,
                raster,
                writer.append,
                partial(progress, CUTTING_STEP),
                state,
                keeper.keep,
                preview_of(study, on_preview) if on_preview else None,
            )
            writer.overview(history.overview, simulation.overview_raster)
            writer.forces(
                history.time,
                history.cutting,
                history.thrust,
                history.thickness,
                vars(history.energy),
            )
        except SolverError as error:
            raise SolverError("; ".join(filter(None, (str(error), keeper.note)))) from None
        except KeyboardInterrupt:
            raise KeyboardInterrupt(keeper.note) from None
    for unfinished in unfinished_scenes(path):
        unfinished.remove()


def _kept(checkpoint: Checkpoint, file: Path) -> str:
    return f"the state at {checkpoint.time * 1e6:.2f} us is kept in {file}"


class _Keeper:
    """Writer of checkpoints; `note` describes the last one."""

    def __init__(self, writer: SceneWriter) -> None:
        self._writer = writer
        self._due = monotonic() + CHECKPOINT_INTERVAL
        self.note = ""

    @uninterrupted()
    def keep(self, checkpoint: Checkpoint) -> None:
        """Make a checkpoint if it is time, and delete what other runs left that got no further."""
        begin = monotonic()
        if begin < self._due:
            return
        file = self._writer.checkpoint(checkpoint.arrays, checkpoint.progress)
        self.note = _kept(checkpoint, file)
        for left in unfinished_scenes(Path(self._writer.path)):
            if left.progress <= checkpoint.progress:
                left.remove()
        end = monotonic()
        self._due = end + max(CHECKPOINT_INTERVAL, _CHEAP * (end - begin))
