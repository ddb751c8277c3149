"""Assumptions and warnings that belong to a result."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any


@dataclass(frozen=True)
class Notes:
    """Assumptions, warnings and remarks on a result in sentences; ``a + b`` holds each once."""

    assumed: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def __add__(self, other: "Notes") -> "Notes":
        return Notes(
            *(list(dict.fromkeys([*getattr(self, kind), *getattr(other, kind)])) for kind in _KINDS)
        )

    def about(self, name: str) -> "Notes":
        """Return the notes with a name before each sentence."""
        return Notes(*([f"{name}: {text}" for text in getattr(self, kind)] for kind in _KINDS))

    def attrs(self) -> dict[str, str]:
        """Return the notes as attributes of a file, one sentence per line."""
        return {kind: "\n".join(lines) for kind in _KINDS if (lines := getattr(self, kind))}

    @classmethod
    def from_attrs(cls, attrs: Mapping[Any, Any]) -> "Notes":
        """Read notes from attributes that `attrs` wrote."""
        return cls(*(str(attrs.get(kind, "")).splitlines() for kind in _KINDS))


_KINDS = tuple(each.name for each in fields(Notes))
