"""Flow-stress laws: what a law is, and the registry that the solver finds it in.

A law is a frozen dataclass of numbers in SI units with a static method `stress`. Registered, it can
be given to the solver and named in a material's file::

    @flow_stress_law("hollomon")
    @dataclass(frozen=True)
    class Hollomon(FlowStress):
        strength: float
        exponent: float

        @staticmethod
        def stress(strain, rate, temperature, law):
            return law.strength * strain**law.exponent
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import fields
from typing import Any, ClassVar, Final, TypeVar

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import ArrayLike, NDArray

from chipglow.cutting.lanes import INLINE

_DIFFERENCE: Final = 1e-6
_Law = TypeVar("_Law", bound="type[FlowStress]")


class FlowStress:
    """Base of the flow-stress laws."""

    Numbers: ClassVar[Any]
    """Named tuple of the law's numbers: what kernels get."""

    @staticmethod
    def stress(strain: Any, rate: Any, temperature: Any, law: Any) -> Any:
        """Flow stress in Pa; compiled by Numba.

        Parameters
        ----------
        strain, rate, temperature : float
            Plastic strain (over 0), its rate in 1/s (over 0), temperature in K.
        law : named tuple
            The law's numbers, by the names of its fields.
        """
        raise NotImplementedError

    def numbers(self) -> Any:
        """The law's numbers for kernels."""
        return self.Numbers(*(float(getattr(self, name)) for name in self.Numbers._fields))

    def at(self, strain: ArrayLike, rate: ArrayLike, temperature: ArrayLike) -> NDArray[np.float64]:
        """Flow stress in Pa at plastic strains, rates (1/s) and temperatures (K), broadcast."""
        each = np.broadcast_arrays(strain, rate, temperature)
        numbers = self.numbers()
        points = np.stack([np.ravel(one) for one in each], axis=-1).astype(np.float64)
        alone = _kept if comes_with_chipglow(type(numbers)) else flow_stress
        values = [alone(*point, numbers) for point in points]
        return np.array(values).reshape(each[0].shape)


LAWS: Final[dict[str, type[FlowStress]]] = {}
"""Laws by name."""

_KERNELS: Final[dict[Any, Any]] = {}


def flow_stress_law(name: str, stress_and_slopes: Any = None) -> Callable[[_Law], _Law]:
    """Class decorator that registers a law, to be put above ``@dataclass(frozen=True)``.

    Parameters
    ----------
    name : str
        What a material's file calls it.
    stress_and_slopes : compiled function, optional
        For speed: of the arguments of `FlowStress.stress`, the flow stress and its derivatives by
        strain and by the logarithm of the rate. Taken from differences of `stress` without it.

    Raises
    ------
    ValueError
        If the name is taken by another law.
    """

    def register(law: _Law) -> _Law:
        taken = LAWS.get(name, law)
        if (taken.__module__, taken.__qualname__) != (law.__module__, law.__qualname__):
            raise ValueError(f"flow-stress law {name!r}: the name is taken")
        # Numba tells compiled functions apart by the names of their arguments' types.
        typename = f"Law{len(_KERNELS)}"
        numbers: Any = namedtuple(typename, [f.name for f in fields(law)])  # type: ignore[arg-type,misc]
        # Numba's cache finds the type again by these.
        numbers.__module__ = law.__module__
        numbers.__qualname__ = f"{law.__qualname__}.Numbers"
        law.Numbers = numbers
        LAWS[name] = law
        _KERNELS[numbers] = stress_and_slopes or _by_differences(law.stress)
        return law

    return register


def comes_with_chipglow(kind: type) -> bool:
    """Whether a law, or the named tuple of its numbers, is not a user's own."""
    return kind.__module__.startswith("chipglow.")


def _by_differences(stress: Callable[..., Any]) -> Any:
    law_stress = njit(**INLINE)(stress)

    @njit(**INLINE)
    def stress_and_slopes(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        held = max(strain, 1e-9)
        here = law_stress(held, rate, temperature, law)
        strained = law_stress(held * (1.0 + _DIFFERENCE), rate, temperature, law)
        faster = law_stress(held, rate * (1.0 + _DIFFERENCE), temperature, law)
        return here, (strained - here) / (held * _DIFFERENCE), (faster - here) / _DIFFERENCE

    return stress_and_slopes


def stress_and_slopes(strain: float, rate: float, temperature: float, law: Any) -> Any:
    """Flow stress (Pa) and its derivatives by strain and by ln rate; for kernels only."""
    raise NotImplementedError("called from compiled code only")


@overload(stress_and_slopes, jit_options=INLINE)
def _choose(strain, rate, temperature, law):  # type: ignore[no-untyped-def]  # pragma: no cover
    kernel = _KERNELS.get(getattr(law, "instance_class", None))
    if kernel is None:
        return None
    return lambda strain, rate, temperature, law: kernel(strain, rate, temperature, law)


@njit(**INLINE)
def flow_stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
    """Flow stress in Pa at a plastic strain, its rate (1/s) and temperature (K)."""
    return stress_and_slopes(strain, rate, temperature, law)[0]


_kept: Final = njit(cache=True, **INLINE)(flow_stress.py_func)
"""`flow_stress` kept on disk, for the laws of which `advance_with` keeps the code."""
