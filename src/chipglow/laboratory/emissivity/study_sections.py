"""Determined emissivities as the sections of a study."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

import yaml

from chipglow.laboratory.emissivity.emissivity import RegionEmissivity

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
    """Sections of a study with the emissivities of its features, as YAML.

    Parameters
    ----------
    rows : iterable of RegionEmissivity
        Determined emissivities. What they are of is known by the name of their feature: chip body,
        shear band, workpiece, tool.

    Returns
    -------
    str
        The sections ``surface`` and, with a chip, ``analysis``; empty if no feature is known or a
        chip's body comes without its shear bands. A mean or standard deviation that no study takes
        is left out.
    """
    found = {
        _FIELDS[row.feature.lower()]: {
            "mean": round(row.mean, _DIGITS),
            "standard_deviation": round(row.standard_deviation, _DIGITS),
        }
        for row in rows
        if row.whole and row.feature.lower() in _FIELDS and _possible(row)
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


def _possible(row: RegionEmissivity) -> bool:
    return 0 <= row.mean <= 1 and row.standard_deviation <= _GREATEST_DEVIATION
