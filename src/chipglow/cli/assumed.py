"""What a measurement states of its own making, on the screen."""

from collections.abc import Iterable

from chipglow.camera import Measurement
from chipglow.cli.screen import current


def say_of_measurements(*measurements: Measurement) -> None:
    """Say what was assumed of measurements, and their warnings, each sentence once.

    Measurements of a camera's file keep both as attributes, a sentence a line.
    """
    current().assumed(_sentences(measurements, "assumed"))
    current().warnings(_sentences(measurements, "warnings"))


def _sentences(measurements: Iterable[Measurement], kind: str) -> list[str]:
    lines = (str(one.data.attrs.get(kind, "")).splitlines() for one in measurements)
    return list(dict.fromkeys(line for of in lines for line in of))
