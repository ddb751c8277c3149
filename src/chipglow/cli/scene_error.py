"""The study of ``chipglow error``: a scene, and what is said beside it."""

from pathlib import Path

from chipglow.study import Study, load_study
from chipglow.surface import UniformEmissivity
from chipglow.text import DescriptionError


def study_of(scene: Path, study: Path | None, emissivity: float | None) -> Study:
    """The study, or the defaults, with a scene and perhaps one emissivity."""
    if not scene.is_file():
        raise DescriptionError(f"{scene}: there is no such file, expected a scene")
    known = Study(scene=str(scene.resolve())) if study is None else load_study(study, scene)
    if emissivity is None:
        return known
    if not 0 <= emissivity <= 1:
        raise DescriptionError(f"--emissivity: {emissivity:g}, expected 0 to 1")
    return known.model_copy(update={"surface": UniformEmissivity(emissivity)})
