"""Running a study: the cut (or the scene that was cut before), the camera, the analysis."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from json import dumps
from pathlib import Path
from typing import Any, Final, TypeAlias

from chipglow.analysis.paper import StudyResult, analyse
from chipglow.cutting import SOLVER_VERSION, ToolMaterial, WorkpieceMaterial
from chipglow.io import SceneWriter, open_scene
from chipglow.scene import SceneError
from chipglow.study.cache import scene_path
from chipglow.study.schema import Study

Progress: TypeAlias = Callable[[str, float], None]
"""Told which step is under way and how much of it is done, 0 to 1."""

CUTTING_STEP: Final = "cutting simulation"
SCENE_FORMAT: Final = 1
"""Changes whenever the same frames are written as another file."""


def cut(study: Study, progress: Progress | None = None) -> Path:
    """File of the study's scene: computed now, or found in the cache.

    Parameters
    ----------
    study : Study
        Only its section `cutting` matters.
    progress : callable, optional
        Told how far the simulation is; not called if the scene is found.

    Returns
    -------
    Path
        The scene's file in the cache, for `open_scene`.
    """
    path = scene_path(_inputs(study))
    if not _is_whole(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        _compute(study, path, progress)
    return path


def is_cut(study: Study) -> bool:
    """Whether the study's scene is in the cache."""
    return _is_whole(scene_path(_inputs(study)))


def run(study: Study, progress: Progress | None = None) -> StudyResult:
    """Run a study from the cut to the analysis.

    Parameters
    ----------
    study : Study
        What to do; the paper's study is ``Study()``.
    progress : callable, optional
        Told which step is under way and how much of it is done.

    Returns
    -------
    StudyResult
        All that the report shows.
    """
    scene = open_scene(cut(study, progress))
    surfaces = study.surface.build(study.seed)
    return analyse(scene, surfaces, study.camera.build(), study.analysis.build(), progress)


def _inputs(study: Study) -> dict[str, Any]:
    """All that a scene depends on."""
    simulation = study.cutting.simulation()
    return {
        "cutting": study.cutting.model_dump(),
        "workpiece": _numbers(simulation.workpiece),
        "tool": _numbers(simulation.tool_material),
        "solver": SOLVER_VERSION,
        "format": SCENE_FORMAT,
    }


def _numbers(material: WorkpieceMaterial | ToolMaterial) -> dict[str, Any]:
    """All that a material's file may change but its name."""
    return {key: value for key, value in asdict(material).items() if key != "name"}


def _is_whole(path: Path) -> bool:
    if not path.exists():
        return False
    try:
        open_scene(path).data.close()
    except (SceneError, OSError):
        return False
    return True


def _compute(study: Study, path: Path, progress: Progress | None) -> None:
    if progress:
        progress(CUTTING_STEP, 0.0)
    cutting = study.cutting
    raster = cutting.field_of_view.build()
    attributes: Mapping[str, str] = {"inputs": dumps(_inputs(study), sort_keys=True)}
    with SceneWriter(path, raster, cutting.tool.build(), attributes) as writer:
        history = cutting.simulation().run(
            cutting.window.build(),
            raster,
            writer.append,
            (lambda fraction: progress(CUTTING_STEP, fraction)) if progress else None,
        )
        writer.forces(history.time, history.cutting, history.thrust, vars(history.energy))
