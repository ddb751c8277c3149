"""Flow-stress laws: what a law is, and where the solver finds its numbers and its function.

A law is a part: a frozen dataclass whose fields declare their `Parameter`, with a static method
`stress`. A material file names it by its kind::

    @FLOW_LAWS.part
    @dataclass(frozen=True)
    class Hollomon(FlowStress):
        kind: ClassVar[str] = "hollomon"
        strength: Annotated[float, Parameter("K.", STRESS, over=0.0)]
        exponent: Annotated[float, Parameter("n.", least=0.0)]

        @staticmethod
        def stress(strain, rate, temperature, law):
            return law.strength * strain**law.exponent
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from itertools import count
from typing import Any, ClassVar, Final

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import ArrayLike, NDArray

from chipglow.cutting.lanes import INLINE
from chipglow.quantities import Family, Part

FLOW_LAWS: Final = Family("flow_law")
"""Laws by their kind."""

_RELATIVE_STEP: Final = 1e-6
"""Relative step of strain and rate for the slopes of a law that states none."""

_KERNELS: Final[dict[Any, Any]] = {}
_OWN_LAWS: Final = count(1)


class _NumbersOfLaw:
    """Named tuple of a law's numbers, made when it is asked for: the fields are known by then."""

    def __get__(self, instance: object, law: Any) -> Any:
        return _numbers_of(law)


class FlowStress(Part):
    """Base of the flow-stress laws: a law defines `stress`, or for speed `stress_and_slopes`.

    Attributes
    ----------
    stress_and_slopes : compiled function
        Return, for the arguments of `stress`, the flow stress and its derivatives by strain and by
        the logarithm of the rate. Taken from differences of `stress` without it.
    """

    Numbers: ClassVar[Any] = _NumbersOfLaw()
    """Named tuple of the law's numbers: what kernels get."""

    @staticmethod
    def stress(strain: Any, rate: Any, temperature: Any, law: Any) -> Any:
        """Return the flow stress in Pa; compiled by Numba.

        Takes the plastic strain and its rate in 1/s, both positive, the temperature in K, and a
        named tuple of the law's numbers, by the names of its fields.
        """
        raise NotImplementedError

    def numbers(self) -> Any:
        """Return the law's numbers for kernels."""
        return self.Numbers(*(float(getattr(self, name)) for name in self.Numbers._fields))

    def at(self, strain: ArrayLike, rate: ArrayLike, temperature: ArrayLike) -> NDArray[np.float64]:
        """Return the flow stress in Pa at strains, rates (1/s) and temperatures (K), broadcast."""
        each = np.broadcast_arrays(strain, rate, temperature)
        numbers = self.numbers()
        points = np.stack([np.ravel(one) for one in each], axis=-1).astype(np.float64)
        alone = _kept if comes_with_chipglow(type(numbers)) else flow_stress
        values = [alone(*point, numbers) for point in points]
        return np.array(values).reshape(each[0].shape)


def comes_with_chipglow(kind: type) -> bool:
    """Return whether a law, or the named tuple of its numbers, is not a user's own."""
    return kind.__module__.startswith("chipglow.")


@cache
def _numbers_of(law: Any) -> Any:
    # Numba tells compiled functions apart by the names of their arguments' types, those that it
    # has on disk among them: a law that is defined again needs another name.
    number = "" if comes_with_chipglow(law) else next(_OWN_LAWS)
    names = [one.name for one in fields(law)]
    numbers: Any = namedtuple(f"{law.__name__}{number}", names)  # type: ignore[misc]
    # Numba's cache finds the type again by these.
    numbers.__module__ = law.__module__
    numbers.__qualname__ = f"{law.__qualname__}.Numbers"
    _KERNELS[numbers] = _kernel(law)
    return numbers


def _kernel(law: Any) -> Any:
    """Return what the nearest class defines: a law whose `stress` is another has other slopes."""
    nearest = next(one for one in law.__mro__ if {"stress", "stress_and_slopes"} & vars(one).keys())
    if "stress_and_slopes" in vars(nearest):
        return law.stress_and_slopes
    return _by_differences(law.stress)


def _by_differences(stress: Callable[..., Any]) -> Any:
    law_stress = njit(**INLINE)(stress)

    @njit(**INLINE)
    def stress_and_slopes(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        held = max(strain, 1e-9)  # hardening has no finite slope at no strain
        here = law_stress(held, rate, temperature, law)
        strained = law_stress(held * (1.0 + _RELATIVE_STEP), rate, temperature, law)
        faster = law_stress(held, rate * (1.0 + _RELATIVE_STEP), temperature, law)
        return here, (strained - here) / (held * _RELATIVE_STEP), (faster - here) / _RELATIVE_STEP

    return stress_and_slopes


def stress_and_slopes(strain: float, rate: float, temperature: float, law: Any) -> Any:
    """Return flow stress (Pa) and derivatives by strain and by ln rate; for kernels only."""
    raise NotImplementedError("called from compiled code only")


@overload(stress_and_slopes, jit_options=INLINE)
def _choose(strain, rate, temperature, law):  # type: ignore[no-untyped-def]  # pragma: no cover
    kernel = _KERNELS.get(getattr(law, "instance_class", None))
    if kernel is None:
        return None
    return lambda strain, rate, temperature, law: kernel(strain, rate, temperature, law)


@njit(**INLINE)
def flow_stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
    """Return the flow stress in Pa at a plastic strain, its rate (1/s) and temperature (K)."""
    return stress_and_slopes(strain, rate, temperature, law)[0]


_kept: Final = njit(cache=True, **INLINE)(flow_stress.py_func)
"""`flow_stress` kept on disk, for the laws of which `advance_with` keeps the code."""
