"""What a command prints: text and tables for people, or one JSON object for programs."""

import json
import os
import sys
from collections.abc import Collection, Iterable, Mapping
from contextvars import ContextVar
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from chipglow.cli.tables import screen_table

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console
    from rich.table import Table

    from chipglow.cli.tables import Columns
    from chipglow.text import Notes
    from chipglow.uncertainty import Estimate

_PIPE_WIDTH: Final = 200
"""Columns of text for a pipe or a file, which has none of its own: tables keep one line a row."""

Facts: TypeAlias = Iterable[tuple[str, str]]
"""Names and what they are."""


class Screen:
    """Where a command's results go.

    For people they are printed as they come: tables, sentences, names of written files; what was
    assumed goes to stderr. For programs they are kept, and printed by `close` as one JSON object.
    """

    def __init__(self) -> None:
        self._kept: dict[str, Any] | None = None

    def for_programs(self) -> None:
        """Print one JSON object in the place of text."""
        self._kept = {
            "chipglow": version("chipglow"),
            "tables": {},
            "facts": {},
            "values": {},
            "sentences": [],
            "assumed": [],
            "warnings": [],
            "missing": [],
            "files": [],
        }

    @property
    def is_for_programs(self) -> bool:
        """Whether one JSON object is printed."""
        return self._kept is not None

    def table(
        self,
        name: str | None,
        frame: "pd.DataFrame",
        columns: "Columns" = (),
        title: str | None = None,
        unbroken: Collection[str] = (),
    ) -> None:
        """A frame of a result, as `screen_table`; for programs its columns, a record a row.

        Without a name it is for people alone: what the program finds in another table.
        """
        if self._kept is None:
            self._print(screen_table(frame, columns, title, unbroken))
        elif name is not None:
            records = frame.to_dict("records")
            self._kept["tables"].setdefault(name, []).extend(map(_plain, records))

    def budget(self, name: str, estimate: "Estimate", title: str) -> None:
        """What makes values in K uncertain, below a title."""
        from chipglow.cli.tables import budget_frame

        self.heading(f"\n{title}")
        self.table(name, budget_frame(estimate))
        self.heading()

    def facts(self, name: str, rows: Facts) -> None:
        """Names and what they are, side by side."""
        if self._kept is not None:
            self._kept["facts"].setdefault(name, {}).update(rows)
            return
        from chipglow.cli.tables import facts_table

        self._out().print(facts_table(rows))

    def heading(self, text: str = "") -> None:
        """A line for people alone: what comes next."""
        if self._kept is None:
            self._out().print(text, soft_wrap=True)

    def say(self, sentence: str, values: Mapping[str, Any] | None = None) -> None:
        """A sentence of the result, and the numbers in it for programs."""
        if self._kept is None:
            self._out().print(sentence, soft_wrap=True)
        else:
            self._kept["sentences"].append(sentence.strip())
            self._kept["values"].update(_plain(values or {}))

    def aside(self, sentence: str, values: Mapping[str, Any] | None = None) -> None:
        """A sentence beside the result, as `say`, for people on stderr."""
        if self._kept is None:
            print(sentence, file=sys.stderr, flush=True)
        else:
            self.say(sentence, values)

    def values(self, values: Mapping[str, Any]) -> None:
        """Numbers for programs alone, of what people read elsewhere."""
        if self._kept is not None:
            self._kept["values"].update(_plain(values))

    def notes(self, notes: "Notes") -> None:
        """Print assumptions and warnings on stderr."""
        self._sentences("assumed", "Assumed", notes.assumed, sys.stderr)
        self._sentences("warnings", "Warning", notes.warnings, sys.stderr)

    def remarks(self, notes: "Notes") -> None:
        """Print the remarks among notes."""
        for sentence in notes.remarks:
            self.say(sentence)

    def missing(self, sentences: Iterable[str]) -> None:
        """Print which results are missing, and why."""
        self._sentences("missing", "Missing", sentences, sys.stdout)

    def file(self, path: Path, what: str = "") -> None:
        """A file that was written."""
        if self._kept is None:
            print(f"{what}: {path}" if what else path)
        else:
            self._kept["files"].append(str(path))

    def close(self) -> None:
        """Print the object for programs, if it is for them, and once: a server does so early."""
        if self._kept is not None:
            found = json.dumps(self._kept, ensure_ascii=False, allow_nan=False, indent=1)
            print(found, flush=True)
            self._kept = None

    def _print(self, table: "Table") -> None:
        """A table; where the terminal is too narrow, each row as a list of its cells."""
        from rich.measure import Measurement

        from chipglow.cli.tables import facts_table

        console = self._out()
        if Measurement.get(console, console.options, table).minimum <= console.width:
            console.print(table)
            return
        if table.title:
            console.print(table.title)
        heads = [str(column.header) for column in table.columns]
        for row in zip(*(column.cells for column in table.columns), strict=True):
            console.print()
            console.print(facts_table(zip(heads, map(str, row), strict=True)))

    def _sentences(self, key: str, head: str, sentences: Iterable[str], stream: Any) -> None:
        for sentence in sentences:
            if self._kept is None:
                print(f"{head}: {sentence}", file=stream, flush=True)
            else:
                self._kept[key].append(sentence)

    def _out(self) -> "Console":
        from rich.console import Console

        console = Console(highlight=False, markup=False)
        if not sys.stdout.isatty() and "COLUMNS" not in os.environ:
            console.width = _PIPE_WIDTH
        return console


_CURRENT: ContextVar[Screen] = ContextVar("screen")


def begin() -> Screen:
    """A new screen, for a command that begins."""
    screen = Screen()
    _CURRENT.set(screen)
    return screen


def current() -> Screen:
    """The screen of the command that runs."""
    return _CURRENT.get()


def _plain(value: Any) -> Any:
    """A value as JSON has it: what is no number is null, an array a list."""
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
