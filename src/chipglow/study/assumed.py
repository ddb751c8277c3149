"""What a study that is not the paper's leaves to it: said, lest it is taken for the user's own."""

from collections.abc import Iterator
from typing import Any, Final

from chipglow.quantities import Part, own_settings
from chipglow.study.schema import Study
from chipglow.study.surface_section import FeaturesSection
from chipglow.text.template import yaml_line

_HOW_FINELY: Final = {
    "cutting": {"numerics", "window", "field_of_view", "cutting_length", "surroundings"},
    "camera": {"offset_right", "offset_down"},
    "surface": {"kind", "measured_in", "maps", "measured", "follow", "restore_standard_deviation"},
}
"""Fields whose defaults are no property of the paper's experiment."""


def left_to_the_paper(study: Study) -> Iterator[str]:
    """What is the paper's in a study that is another, a sentence for each section."""
    if study.is_papers:
        return
    sections = ["surface", "camera"] if study.scene else ["cutting", "surface", "camera"]
    for name in sections:
        section = getattr(study, name)
        if name == "surface" and not isinstance(section, FeaturesSection):
            continue
        left = list(_unset(section, _HOW_FINELY[name], ""))
        if left:
            yield f"Not said by the study and so the paper's, of {name}: {', '.join(left)}."


def _unset(section: Part, without: set[str], prefix: str) -> Iterator[str]:
    """Fields that nobody set, with their values as a study writes them."""
    for one in own_settings(section):
        if one.name in without or one.plain in ("none", []):
            continue
        if one.name not in section.given:
            yield f"{prefix}{one.name} {_written(one.plain)}"
        elif one.is_section:
            yield from _unset(one.value, {"kind"}, f"{prefix}{one.name}.")


def _written(value: Any) -> str:
    """A value in one line, without what is none."""
    if isinstance(value, dict):
        value = {key: inner for key, inner in value.items() if inner not in ("none", None, {}, [])}
    return yaml_line(value)
