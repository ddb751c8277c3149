"""Packed, missing and invalid numbers of a file by the conventions of NetCDF."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

PACKING: Final = (
    "scale_factor", "add_offset", "_Unsigned", "_FillValue", "missing_value", "valid_min",
    "valid_max", "valid_range", "prefilled",
)  # fmt: skip
"""Attributes that `unpack` applies."""

_PREFILLED: Final[Mapping[str, float]] = {"i2": -32767, "i4": -2147483647, "i8": -(2**63) + 2}
"""Values with which the NetCDF library fills arrays before writing, by type.

Bytes have no such value, and that of unsigned types, the largest one, may be a saturated count.
"""
_PREFILLED_FLOAT: Final = 9.969209968386869e36
"""The same for floats of 32 and 64 bits; no quantity of a scene or a camera is as large."""


def unpack(raw: NDArray[Any], attributes: Mapping[str, Any]) -> NDArray[Any]:
    """Return the numbers that an array of a file stands for, NaN where one is missing.

    Parameters
    ----------
    raw : array
        The numbers in the file.
    attributes : mapping
        Attributes of the array: ``_Unsigned``, ``_FillValue``, ``missing_value``, ``valid_min``,
        ``valid_max``, ``valid_range``, ``scale_factor`` and ``add_offset`` are applied;
        ``prefilled`` means that `_PREFILLED` values are missing.

    Notes
    -----
    NetCDF Users Guide, Appendix A: limits of validity are packed numbers, unless they are floats
    and the packed numbers are not.
    """
    packed = _with_sign(raw, attributes)
    scale, offset = (attributes.get(name) for name in ("scale_factor", "add_offset"))
    values = packed
    if scale is not None or offset is not None:
        values = packed * float(1.0 if scale is None else scale) + float(offset or 0.0)
    missing = _missing(packed, raw.dtype, attributes) | _invalid(packed, values, raw, attributes)
    return np.where(missing, np.nan, values) if missing.any() else values


def _with_sign(raw: NDArray[Any], attributes: Mapping[str, Any]) -> NDArray[Any]:
    """Return whole numbers with the sign that ``_Unsigned`` states."""
    sign = {"true": "u", "false": "i"}.get(str(attributes.get("_Unsigned")).lower())
    if sign is None or raw.dtype.kind not in "iu":
        return raw
    return raw.view(f"{raw.dtype.byteorder}{sign}{raw.dtype.itemsize}")


def _missing(
    packed: NDArray[Any], stored: np.dtype[Any], attributes: Mapping[str, Any]
) -> NDArray[np.bool_]:
    """Return where a number is one of those that stand for none."""
    marks = [attributes.get(name) for name in ("_FillValue", "missing_value")]
    known = [mark for mark in marks if mark is not None and not isinstance(mark, str)]
    if stored.kind == "f" and stored.itemsize >= 4:
        known.append(_PREFILLED_FLOAT)
    elif attributes.get("prefilled") and attributes.get("_FillValue") is None:
        kind = f"{packed.dtype.kind}{packed.dtype.itemsize}"
        known += [_PREFILLED[kind]] if kind in _PREFILLED else []
    missing = np.zeros(packed.shape, np.bool_)
    for mark in known:
        missing |= np.isin(packed, _as_packed(mark, packed, stored))
    return missing


def _invalid(
    packed: NDArray[Any], values: NDArray[Any], raw: NDArray[Any], attributes: Mapping[str, Any]
) -> NDArray[np.bool_]:
    """Return where a number is outside the limits that the attributes state."""
    both = attributes.get("valid_range")
    lower, upper = (None, None) if both is None else both
    lower, upper = attributes.get("valid_min", lower), attributes.get("valid_max", upper)
    invalid = np.zeros(packed.shape, np.bool_)
    for limit, beyond in ((lower, np.less), (upper, np.greater)):
        if limit is not None:
            is_unpacked = np.asarray(limit).dtype.kind == "f" and raw.dtype.kind != "f"
            numbers = values if is_unpacked else packed
            bound = limit if is_unpacked else _as_packed(limit, packed, raw.dtype)
            invalid |= beyond(numbers, bound)
    return invalid


def _as_packed(value: Any, packed: NDArray[Any], stored: np.dtype[Any]) -> NDArray[Any]:
    """Return an attribute in the type of the packed numbers, as it was rounded when written.

    Whole numbers may be written with the sign of the stored numbers or of the packed ones.
    """
    number = np.asarray(value)
    if packed.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return number.astype(packed.dtype)
    if number.dtype.kind not in "iu" or packed.dtype.kind not in "iu":
        return number
    types = np.iinfo(stored), np.iinfo(packed.dtype)
    inside = (number >= min(one.min for one in types)) & (number <= max(one.max for one in types))
    return np.where(inside, number.astype(packed.dtype), number)
