"""Determined emissivities as the sections of a study."""

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, Final

import yaml

from chipglow.laboratory.emissivity.emissivity import EmissivityLine, RegionEmissivity

_FIELDS: Final[Mapping[str, str]] = {
    "chip": "body",
    "chip body": "body",
    "body": "body",
    "shear band": "shear_band",
    "shear_band": "shear_band",
    "workpiece": "workpiece",
    "tool": "tool",
}
_CHIP: Final = "measured chip"
_DIGITS: Final = 4
_GREATEST_DEVIATION: Final = 0.5


def surface_text(rows: Iterable[RegionEmissivity]) -> str:
    """Return sections of a study with the emissivities of its features, as YAML."""
    found = {
        _FIELDS[row.feature.lower()]: {
            "mean": round(row.mean, _DIGITS),
            "standard_deviation": round(row.standard_deviation, _DIGITS),
        }
        for row in rows
        if row.whole and row.feature.lower() in _FIELDS
        if 0 <= row.mean <= 1 and row.standard_deviation <= _GREATEST_DEVIATION
    }
    surface: dict[str, Any] = {}
    sections: dict[str, Any] = {"surface": surface}
    if {"body", "shear_band"} <= set(found):
        surface["chips"] = {_CHIP: {name: found[name] for name in ("body", "shear_band")}}
        sections["analysis"] = {"rake_chip": _CHIP, "band_chip": _CHIP}
    surface |= {name: found[name] for name in ("workpiece", "tool") if name in found}
    if not surface:
        return ""
    return yaml.safe_dump(sections, sort_keys=False, allow_unicode=True)


def measured_text(file: str | os.PathLike[str]) -> str:
    """Return sections of a study with the chip of a file of `write_emissivity`, as YAML."""
    sections = {
        "surface": {"measured": {_CHIP: os.fspath(file)}},
        "analysis": {"rake_chip": _CHIP, "band_chip": _CHIP},
    }
    return yaml.safe_dump(sections, sort_keys=False, allow_unicode=True)


def measured_features(areas: Mapping[str, EmissivityLine]) -> dict[str, EmissivityLine]:
    """Return measured areas by the features of a study: body, shear_band, workpiece, tool.

    Of several areas of a feature the one of the same name counts.
    """
    number = Counter(area.feature for area in areas.values())
    found = {
        _FIELDS[area.feature.lower()]: area
        for area in areas.values()
        if area.feature.lower() in _FIELDS
        and (number[area.feature] == 1 or area.name == area.feature)
    }
    if not {"body", "shear_band"} <= set(found):
        raise ValueError(
            f"is of the features {', '.join(number)}, expected chip body and shear band among them"
        )
    return found
