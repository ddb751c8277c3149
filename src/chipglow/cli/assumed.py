"""Assumptions and warnings of results, on the terminal."""

from collections.abc import Iterable

from rich.console import Console

from chipglow.camera import Measurement


def say_assumed(sentences: Iterable[str]) -> None:
    """Say on stderr what had to be assumed, a sentence each."""
    console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
    for sentence in sentences:
        console.print(f"Assumed: {sentence}")


def say_warnings(sentences: Iterable[str]) -> None:
    """Say beside the results their warnings, a sentence each."""
    console = Console(highlight=False, markup=False, soft_wrap=True)
    for sentence in sentences:
        console.print(f"Warning: {sentence}")


def say_missing(sentences: Iterable[str]) -> None:
    """Say beside the results what is not among them, and why, a sentence each."""
    console = Console(highlight=False, markup=False, soft_wrap=True)
    for sentence in sentences:
        console.print(f"Missing: {sentence}")


def say_of_measurements(*measurements: Measurement) -> None:
    """Say what was assumed of measurements, and their warnings, each sentence once.

    Measurements of a camera's file keep both as attributes, a sentence a line.
    """
    say_assumed(_sentences(measurements, "assumed"))
    say_warnings(_sentences(measurements, "warnings"))


def _sentences(measurements: Iterable[Measurement], kind: str) -> list[str]:
    lines = (str(one.data.attrs.get(kind, "")).splitlines() for one in measurements)
    return list(dict.fromkeys(line for of in lines for line in of))
