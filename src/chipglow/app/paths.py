"""Settings of a study by their paths, such as ``camera.psf.fwhm``."""

from collections.abc import Mapping
from typing import Any, get_args

from pydantic import BaseModel

from chipglow.quantities.units import Quantity

MISSING = object()
"""Value of a setting that a study does not have."""


def held(section: Any, path: str) -> Any:
    """Return the value of a setting; `MISSING` if there is no such setting."""
    for key in path.split("."):
        section = step(section, key)
    return section


def step(held: Any, key: str) -> Any:
    """Return the value of one key of a section, mapping or tuple."""
    if isinstance(held, Mapping):
        return held.get(key, MISSING)
    if isinstance(held, tuple):
        return held[int(key)] if key.isdigit() and int(key) < len(held) else MISSING
    return getattr(held, key, MISSING) if isinstance(held, BaseModel) else MISSING


def _find(annotation: Any) -> Any:
    for one in get_args(annotation):
        if isinstance(one, Quantity):
            return one
        found = _find(one)
        if found is not None:
            return found
    return None


def parameter(section: Any, path: str) -> dict[str, Any]:
    """Return quantity, and whether a setting may be none or is a whole number."""
    quantity, optional, whole = None, False, False
    for key in path.split("."):
        if isinstance(section, BaseModel):
            field = type(section).model_fields[key]
            quantity = next(
                (
                    m if isinstance(m, Quantity) else m.quantity
                    for m in field.metadata
                    if isinstance(m, Quantity) or getattr(m, "quantity", None)
                ),
                None,
            )
            quantity = quantity or _find(field.annotation)
            optional = type(None) in get_args(field.annotation)
            whole = field.annotation is int
        section = step(section, key)
    return {"quantity": quantity, "optional": optional, "whole": whole}


def _text(quantity: Quantity | None, value: Any) -> Any:
    if value is None:
        return "none"
    if isinstance(value, tuple) and quantity:
        return quantity.range_text(value)
    return quantity.text(value) if quantity and isinstance(value, float) else value


def changed(section: Any, changes: Mapping[str, object]) -> Any:
    """Return a validated copy with other values in SI or as a study writes them."""
    own = {path: value for path, value in changes.items() if "." not in path}
    for name in dict.fromkeys(path.partition(".")[0] for path in changes if "." in path):
        inner = {p.partition(".")[2]: v for p, v in changes.items() if p.startswith(f"{name}.")}
        own[name] = changed(step(section, name), inner)
    if isinstance(section, Mapping):
        return {**section, **own}
    if isinstance(section, tuple):
        values = list(section)
        for key, value in own.items():
            values[int(key)] = value
        return tuple(values)
    kept = section.model_dump(mode="json", include=section.model_fields_set - set(own))
    kept |= {n: getattr(section, n) for n in kept if isinstance(getattr(section, n), BaseModel)}
    own = {n: _text(parameter(section, n)["quantity"], v) for n, v in own.items()}
    return type(section).model_validate({**kept, **own})
