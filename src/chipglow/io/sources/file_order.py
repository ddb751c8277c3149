"""The order of files by the numbers in their names."""

import re


def natural(name: str) -> tuple[tuple[int, str], ...]:
    """Key that sorts 9 before 10."""
    words = re.split(r"(\d+)", name)
    return tuple((int(word), "") if word.isdecimal() else (-1, word) for word in words)
