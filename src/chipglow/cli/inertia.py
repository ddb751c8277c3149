"""Effects of the scaled mass of a cut, on the terminal."""

from collections.abc import Iterable
from math import isfinite

from chipglow.cli.screen import current
from chipglow.laboratory.chip import Inertia
from chipglow.text import Notes


def say_of_cut(inertia: Inertia | None, warnings: Iterable[str] = ()) -> None:
    """Print kinetic energy and momentum of the scaled mass, and the warnings of the cut."""
    parts = _known(inertia) if inertia else {}
    if parts:
        current().aside(
            f"Scaled mass after the build-up: {', '.join(text for text, _ in parts.values())}.",
            {name: number for name, (_, number) in parts.items()},
        )
    own = [inertia.warning] if inertia and inertia.warning else []
    current().notes(Notes(warnings=[*own, *warnings]))


def _known(inertia: Inertia) -> dict[str, tuple[str, float]]:
    """Return the known effects by name, as text and number."""
    known = {
        "kinetic_fraction": "kinetic energy at most {:.2%} of the work",
        "force_fraction": "momentum flux {:.2%} of the mean cutting force",
    }
    numbers = {name: float(getattr(inertia, name)) for name in known}
    return {
        name: (known[name].format(number), number)
        for name, number in numbers.items()
        if isfinite(number)
    }
