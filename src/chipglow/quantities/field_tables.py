"""What every field of a section of a study means, as tables of the documentation."""

from collections.abc import Iterator
from dataclasses import astuple, dataclass

from chipglow.quantities.part import Parameter
from chipglow.quantities.section import Section, allowed
from chipglow.quantities.units import Quantity


@dataclass(frozen=True)
class FieldEntry:
    """A field of a study as text.

    Parameters
    ----------
    name : str
        Its key.
    meaning : str
        What it says.
    unit : str
        The unit in which its default is written; empty for what has none.
    default : str
        Its value in the paper's study.
    allowed : str
        Which values it may have.
    """

    name: str
    meaning: str
    unit: str
    default: str
    allowed: str


def field_entries(section: Section) -> Iterator[FieldEntry]:
    """The fields of a section that are not sections themselves, in their order."""
    values = section.model_dump(mode="json")
    for name, field in type(section).model_fields.items():
        if isinstance(getattr(section, name), Section):
            continue
        units = [_unit(one) for one in field.metadata]
        yield FieldEntry(
            name=name,
            meaning=_one_line(field.description),
            unit="".join(units),
            default=str(values[name]),
            allowed=_one_line(allowed(field)),
        )


def field_tables(section: Section, name: str) -> str:
    """Tables in Markdown of a section with its default values, and of the sections in it.

    Parameters
    ----------
    section : Section
        The section.
    name : str
        Its key in the study; those of the sections in it follow after dots.
    """
    return "\n".join(_table_lines(section, name))


def _table_lines(section: Section, name: str) -> Iterator[str]:
    yield from (f"## `{name}`", "", _one_line(type(section).__doc__), "")
    yield "| field | meaning | unit | default | allowed |"
    yield "|---|---|---|---|---|"
    for entry in field_entries(section):
        key, meaning, unit, default, may_be = (part.replace("|", r"\|") for part in astuple(entry))
        yield f"| `{key}` | {meaning} | {unit} | `{default}` | {may_be} |"
    yield ""
    for key in type(section).model_fields:
        value = getattr(section, key)
        if isinstance(value, Section):
            yield from _table_lines(value, f"{name}.{key}")


def _unit(metadata: object) -> str:
    quantity = metadata.quantity if isinstance(metadata, Parameter) else metadata
    return quantity.unit if isinstance(quantity, Quantity) else ""


def _one_line(text: str | None) -> str:
    return " ".join((text or "").split())
