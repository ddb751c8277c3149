"""What to know of a cut, on the terminal: what its scaled mass amounts to, and its warnings."""

from collections.abc import Iterable
from math import isfinite

from chipglow.cli.screen import current
from chipglow.laboratory.chip import Inertia
from chipglow.text import Notes


def say_of_cut(inertia: Inertia | None, warnings: Iterable[str] = ()) -> None:
    """Say on stderr what kinetic energy and momentum the scaled mass has; warn if too much."""
    parts = _known(inertia) if inertia else {}
    if parts:
        current().aside(
            f"Scaled mass after the build-up: {', '.join(text for text, _ in parts.values())}.",
            {name: number for name, (_, number) in parts.items()},
        )
    own = [inertia.warning] if inertia and inertia.warning else []
    current().notes(Notes(warnings=[*own, *warnings]))


def _known(inertia: Inertia) -> dict[str, tuple[str, float]]:
    """What is known, by its name for programs: as text, and the number."""
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
