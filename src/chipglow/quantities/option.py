"""Quantities with units on the command line."""

from typing import overload

from chipglow.quantities.units import Quantity


@overload
def parse(option: str, quantity: Quantity, text: str) -> float: ...


@overload
def parse(option: str, quantity: Quantity, text: str | None) -> float | None: ...


def parse(option: str, quantity: Quantity, text: str | None) -> float | None:
    """SI number of an option's text such as ``18 um``; None for an option that is not given."""
    try:
        return None if text is None else quantity.parse(text)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
