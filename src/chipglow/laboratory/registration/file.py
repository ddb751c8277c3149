"""A registration as a file: written by ``chipglow register``, read by whoever maps images."""

from pathlib import Path
from typing import Final, NotRequired

import numpy as np
import yaml
from pydantic import ConfigDict, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from chipglow.io import atomic_path
from chipglow.laboratory.registration.registration import Method, Model, Registration
from chipglow.quantities import problem
from chipglow.text import DescriptionError, Notes, read_yaml

_HEAD: Final = """\
# Map from the infrared image onto the visible picture, by chipglow register.
# (X, Y, W) = matrix (x, y, 1) with x, y in m; column = X / W, row = Y / W, which count from 0 in
# the middle of the upper left pixel. covariance: of the matrix's elements, row by row.
"""


class _Fields(TypedDict):
    """What the file states; no degrees of freedom are infinitely many."""

    model: Model
    method: Method
    matrix: list[list[float]]
    covariance: list[list[float]]
    degrees_of_freedom: NotRequired[float | None]
    assumed: NotRequired[list[str]]
    warnings: NotRequired[list[str]]


_Fields.__pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[attr-defined]
_FIELDS: Final = TypeAdapter(_Fields)


def write_registration(registration: Registration, path: str | Path) -> None:
    """Write a registration to a YAML file."""
    finite = np.isfinite(registration.degrees_of_freedom)
    data: _Fields = {
        "model": registration.model,
        "method": registration.method,
        "matrix": registration.matrix.tolist(),
        "covariance": registration.covariance.tolist(),
        "degrees_of_freedom": registration.degrees_of_freedom if finite else None,
        "assumed": registration.notes.assumed,
        "warnings": registration.notes.warnings,
    }
    text = _HEAD + yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def load_registration(path: str | Path) -> Registration:
    """Read a registration from a YAML file.

    Raises
    ------
    DescriptionError
        If the file is no YAML or no registration; the message names the file.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    given = read_yaml(path)
    try:
        data = _FIELDS.validate_python(given)
        freedom = data.get("degrees_of_freedom")
        return Registration(
            np.array(data["matrix"], np.float64),
            np.array(data["covariance"], np.float64),
            data["model"],
            data["method"],
            np.inf if freedom is None else freedom,
            Notes(data.get("assumed", []), data.get("warnings", [])),
        )
    except ValidationError as error:
        raise DescriptionError(f"{path.name}: {problem(error)}") from None
    except ValueError as error:
        raise DescriptionError(f"{path.name}: {error}") from None
