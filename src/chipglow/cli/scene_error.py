"""The study of ``chipglow error``."""

from pathlib import Path

from chipglow.quantities import changed
from chipglow.study import Study, load_study
from chipglow.surface import UniformEmissivity
from chipglow.text import DescriptionError


def study_of(scene: Path, study: Path | None, emissivity: float | None) -> Study:
    """Return a study, by default the paper's, with a scene and optionally one emissivity."""
    if not scene.is_file():
        raise DescriptionError(f"{scene}: no such file")
    known = Study(scene=str(scene.resolve())) if study is None else load_study(study, scene)
    if emissivity is None:
        return known
    if not 0 <= emissivity <= 1:
        raise DescriptionError(f"--emissivity must be from 0 to 1, got {emissivity:g}")
    return changed(known, {"surface": UniformEmissivity(emissivity)})
