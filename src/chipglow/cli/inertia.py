"""What to know of a cut, on the terminal: what its scaled mass amounts to, and its warnings."""

from collections.abc import Iterable
from math import isfinite

from rich.console import Console

from chipglow.laboratory.chip import Inertia


def say_of_cut(inertia: Inertia | None, warnings: Iterable[str] = ()) -> None:
    """Say on stderr what kinetic energy and momentum the scaled mass has; warn if too much.

    Parameters
    ----------
    inertia : Inertia, optional
        That of the cut, with a warning of its own.
    warnings : iterable of str, optional
        The cut's other warnings, a sentence each.
    """
    console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
    parts = _known(inertia) if inertia else []
    if parts:
        console.print(f"Scaled mass after the build-up: {', '.join(parts)}.")
    own = [inertia.warning] if inertia and inertia.warning else []
    for warning in (*own, *warnings):
        console.print(f"Warning: {warning}")


def _known(inertia: Inertia) -> list[str]:
    known = (
        (inertia.kinetic_fraction, "kinetic energy at most {} of the work"),
        (inertia.force_fraction, "momentum flux {} of the mean cutting force"),
    )
    return [text.format(f"{fraction:.2%}") for fraction, text in known if isfinite(fraction)]
