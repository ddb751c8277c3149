"""A registration as a file: written by ``chipglow register``, read by whoever maps images."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import yaml

from chipglow.io import atomic_path
from chipglow.laboratory.registration.registration import Method, Model, Registration
from chipglow.quantities import Parameter, Part
from chipglow.text import DescriptionError, Notes, read_yaml, validated

_Row = tuple[float, ...]
_Rows = tuple[_Row, ...]

_HEAD: Final = """\
# Map from the infrared image onto the visible picture, by chipglow register.
# (X, Y, W) = matrix (x, y, 1) with x, y in m; column = X / W, row = Y / W, which count from 0 in
# the middle of the upper left pixel. covariance: of the matrix's elements, row by row.
"""


@dataclass(frozen=True)
class RegistrationDescription(Part):
    """A registration."""

    model: Annotated[Model, Parameter("What the matrix may be.")] = "affine"
    method: Annotated[Method, Parameter("How it was found.")] = "points"
    matrix: Annotated[_Rows, Parameter("The map.")] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )
    covariance: Annotated[_Rows, Parameter("Of the elements of the matrix.")] = ((0.0,) * 9,) * 9
    degrees_of_freedom: Annotated[float | None, Parameter("Of the covariance; none: infinite.")] = (
        None
    )
    assumed: Annotated[tuple[str, ...], Parameter("Assumptions.")] = ()
    warnings: Annotated[tuple[str, ...], Parameter("Reasons why it may be wrong.")] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        self.build()

    def build(self) -> Registration:
        """Return the registration."""
        for name, rows in (("matrix", self.matrix), ("covariance", self.covariance)):
            if len({len(row) for row in rows}) != 1:
                raise ValueError(f"{name}: expected rows of one length")
        return Registration(
            np.array(self.matrix, np.float64),
            np.array(self.covariance, np.float64),
            self.model,
            self.method,
            np.inf if self.degrees_of_freedom is None else self.degrees_of_freedom,
            Notes(list(self.assumed), list(self.warnings)),
        )


def write_registration(registration: Registration, path: str | Path) -> None:
    """Write a registration to a YAML file."""
    finite = np.isfinite(registration.degrees_of_freedom)
    data = {
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
    data = read_yaml(path)
    for name in ("matrix", "covariance"):
        if not isinstance(data, dict) or name not in data:
            raise DescriptionError(f"{path.name}: {name} is missing, expected a registration")
    return validated(RegistrationDescription, data, path.name, path.parent).build()
