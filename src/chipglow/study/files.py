"""Study files: YAML in."""

from pathlib import Path
from typing import Final

from chipglow.quantities import placed
from chipglow.study.schema import Study
from chipglow.text import DescriptionError, commented_yaml, read_yaml, validated


def load_study(path: str | Path, scene: str | Path | None = None) -> Study:
    """Read a study from a YAML file.

    Parameters
    ----------
    path : str or Path
        The file. Files that it names are looked up beside it.
    scene : str or Path, optional
        A scene instead of the file's scene or cut.

    Raises
    ------
    DescriptionError
        If the file is not YAML or the study is impossible.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    data = read_yaml(path)
    if data is None and scene is None:
        raise DescriptionError(
            f"{path.name}: is empty, expected a study (chipglow init writes the paper's)"
        )
    if scene is not None:
        data = placed(data, {"scene": str(Path(scene).resolve())})
    return validated(Study, data, path.name, path.parent)


def study_text(study: Study) -> str:
    """Return a study as YAML, every field with a comment; `load_study` reads it back."""
    unused = {"cutting"} if study.scene and "cutting" not in study.given else set()
    return commented_yaml(_HEADER, study, unused)


_HEADER: Final = """\
# A study of chipglow. Run it with: chipglow run FILE --out FOLDER
# Quantities carry their unit, in any unit of their kind: 10 us, 0.3 mm, 250 m/min, 391 degC.
# What is left out has the value of the paper's study: Heigel and Whitenton (2010).
"""
