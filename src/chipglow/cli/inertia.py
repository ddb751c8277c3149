"""What the scaled mass of a cut amounts to, on the terminal."""

from math import isfinite

from rich.console import Console

from chipglow.laboratory.chip import Inertia


def say_inertia(inertia: Inertia | None) -> None:
    """Say on stderr what kinetic energy and momentum the scaled mass has; warn if too much."""
    if inertia is None:
        return
    known = (
        (inertia.kinetic_fraction, "kinetic energy at most {} of the work"),
        (inertia.force_fraction, "momentum flux {} of the mean cutting force"),
    )
    parts = [text.format(f"{share:.2%}") for share, text in known if isfinite(share)]
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    if parts:
        console.print(f"Scaled mass after the build-up: {', '.join(parts)}.")
    if inertia.warning:
        console.print(f"Warning: {inertia.warning}")
