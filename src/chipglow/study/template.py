"""Studies as commented YAML."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any, Final

import yaml
from pydantic import BaseModel

from chipglow.study.calibration_schema import CalibrationDescription
from chipglow.study.import_schema import ImportDescription
from chipglow.study.measurement_schema import MeasurementDescription
from chipglow.study.schema import Study
from chipglow.study.section import Section, allowed

_HEADER: Final = """\
# A study of chipglow. Run it with: chipglow run FILE --out FOLDER
# Quantities carry their unit, in any unit of their kind: 10 us, 0.3 mm, 250 m/min, 391 degC.
# What is left out has the value of the paper's study: Heigel and Whitenton (2010).
"""


_IMPORT_HEADER: Final = """\
# An import of chipglow. Run it with: chipglow import FILE --out scene.nc
# Quantities carry their unit, in any unit of their kind: 10 us, 0.3 mm, 250 m/min, 391 degC.
# Of movie, mesh, points and grid only the one of the source's kind counts.
"""


def import_text(description: ImportDescription) -> str:
    """A description of an import as YAML, every field with a comment."""
    values = description.model_dump(mode="json")
    return "\n".join([_IMPORT_HEADER, *_section_lines(description, values, "")]) + "\n"


_MEASUREMENT_HEADER: Final = """\
# A measurement of a camera's file. Make it with: chipglow convert FILE --out measurement.nc
# Quantities carry their unit, in any unit of their kind: 10 us, 6 um, 391 degC.
# What is none is as the camera's file says.
"""


_CALIBRATION_HEADER: Final = """\
# A calibration of a camera, written by chipglow calibrate.
# It holds from the coldest to the hottest black body, for one integration time and range.
"""


def measurement_text(description: MeasurementDescription) -> str:
    """A description of a camera's file as YAML, every field with a comment."""
    values = description.model_dump(mode="json")
    return "\n".join([_MEASUREMENT_HEADER, *_section_lines(description, values, "")]) + "\n"


def calibration_text(description: CalibrationDescription) -> str:
    """A calibration as YAML, every field with a comment; `load_calibration` reads it."""
    values = description.model_dump(mode="json")
    return "\n".join([_CALIBRATION_HEADER, *_section_lines(description, values, "")]) + "\n"


def study_text(study: Study) -> str:
    """A study as YAML, every field with a comment; `load_study` reads the same study from it.

    The section of the cut is left out where a scene takes its place and nothing was said of it.
    """
    unused = {"cutting"} if study.scene and "cutting" not in study.model_fields_set else set()
    values = study.model_dump(mode="json")
    return "\n".join([_HEADER, *_section_lines(study, values, "", unused)]) + "\n"


def _section_lines(
    section: Section, values: Mapping[str, Any], indent: str, unused: Collection[str] = ()
) -> Iterator[str]:
    for name, field in type(section).model_fields.items():
        if name in unused:
            continue
        value = getattr(section, name)
        if not indent and isinstance(value, BaseModel):
            yield ""
        for line in (field.description or "").splitlines():
            yield f"{indent}# {line}"
        if may_be := allowed(field):
            yield from (f"{indent}# {line}" for line in f"Allowed: {may_be}.".splitlines())
        yield from _entry_lines(name, value, values[name], indent)


def _entry_lines(name: str, value: object, plain: Any, indent: str) -> Iterator[str]:
    if isinstance(value, Section):
        yield f"{indent}{_scalar(name)}:"
        yield from _section_lines(value, plain, indent + "  ")
    elif isinstance(value, Mapping) and value:
        yield f"{indent}{_scalar(name)}:"
        for key, item in value.items():
            yield from _entry_lines(key, item, plain[key], indent + "  ")
    else:
        yield f"{indent}{_scalar(name)}: {_scalar(plain)}"


def _scalar(value: Any) -> str:
    text: str = yaml.safe_dump(
        value, default_flow_style=True, allow_unicode=True, width=float("inf"), sort_keys=False
    )
    return text.removesuffix("\n").removesuffix("\n...")
