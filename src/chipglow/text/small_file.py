"""Text files that people write by hand: descriptions, tables of points, columns of numbers."""

from pathlib import Path
from typing import Final

_LARGEST_FILE: Final = 1_000_000


def read_small_text(path: Path) -> str:
    """Text of a file in UTF-8, with or without a mark of its order of bytes."""
    if path.stat().st_size > _LARGEST_FILE:
        raise ValueError(f"{path}: expected a file of up to {_LARGEST_FILE // 1000} kB")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected text in UTF-8") from None
