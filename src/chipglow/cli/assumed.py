"""What had to be assumed, and what is doubtful, on the terminal."""

from collections.abc import Iterable

from rich.console import Console


def say_assumed(sentences: Iterable[str]) -> None:
    """Say on stderr what had to be assumed, a sentence each."""
    console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
    for sentence in sentences:
        console.print(f"Assumed: {sentence}")


def say_doubtful(sentences: Iterable[str]) -> None:
    """Say beside the results what cannot be relied on, a sentence each."""
    console = Console(highlight=False, markup=False, soft_wrap=True)
    for sentence in sentences:
        console.print(f"Doubtful: {sentence}")
