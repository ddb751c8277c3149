"""The repr of dataclasses that hold arrays: their shape and range, not pages of numbers."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Final

import numpy as np

_FEW: Final = 8
"""Numbers or items up to which all are shown."""


class Brief:
    """Base of a dataclass with ``repr=False``: arrays are shown by shape and range."""

    def __repr__(self) -> str:
        shown = (
            f"{one.name}={brief(getattr(self, one.name))}"
            for one in fields(self)  # type: ignore[arg-type]  # a dataclass derives from this
            if one.repr
        )
        return f"{type(self).__name__}({', '.join(shown)})"


def brief(value: Any) -> str:
    """Return a repr in which arrays, datasets and tables are shown by their size."""
    import pandas as pd
    import xarray as xr

    if isinstance(value, np.ndarray):
        return repr(value) if value.size <= _FEW else f"<{_array(value)}>"
    if isinstance(value, xr.Dataset | xr.DataArray):
        sizes = ", ".join(f"{name} {size}" for name, size in value.sizes.items())
        return f"<{type(value).__name__} of {sizes}>"
    if isinstance(value, pd.DataFrame):
        return f"<DataFrame of {len(value)} rows: {', '.join(map(str, value.columns))}>"
    if type(value) in (tuple, list) and len(value) > _FEW:
        return f"<{len(value)} items>"
    if type(value) in (tuple, list):
        items = ", ".join(map(brief, value))
        return f"[{items}]" if isinstance(value, list) else f"({items}{',' * (len(value) == 1)})"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key!r}: {brief(one)}' for key, one in value.items())}}}"
    return repr(value)


def _array(array: Any) -> str:
    text = f"{' × '.join(map(str, array.shape))} {array.dtype}"
    if array.dtype == bool:
        return f"{text}, {np.count_nonzero(array)} true"
    known = array[np.isfinite(array)] if array.dtype.kind in "iuf" else array[:0]
    return f"{text}, {known.min():.5g} to {known.max():.5g}" if known.size else text
