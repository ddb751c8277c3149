"""Compilation of functions that only kernels call."""

from typing import Any, Final

INNER: Final[Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""No code to call the function from Python or C: it takes a sixth of the time of compilation."""
