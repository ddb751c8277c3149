"""Tolerances of rounding that tests share."""

from typing import Final

DOUBLE: Final = 1e-12
"""Relative rounding error of some thousand operations in double precision, each 1.1e-16."""

SINGLE: Final = 1e-6
"""Relative rounding error of a few operations in single precision, each 6e-8, as fields have."""
