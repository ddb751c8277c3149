"""Output of a command: text and tables, or one JSON object."""

import json
import os
import sys
from collections.abc import Collection, Iterable, Mapping
from contextvars import ContextVar
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
"""Width of tables in a pipe or a file, so that each row is one line."""

Facts: TypeAlias = Iterable[tuple[str, str]]
"""Names with their texts."""


class Screen:
    """Output of one command.

    Text is printed immediately: results on stdout, notes on stderr. With JSON, everything is
    collected and printed by `close` as one object.
    """

    def __init__(self) -> None:
        self._kept: dict[str, Any] | None = None

    def for_programs(self) -> None:
        """Print one JSON object instead of text."""
        from importlib.metadata import version

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
        """Print a frame as `screen_table` formats it, or add its rows to the JSON object.

        A table without a name repeats another one and is omitted from the JSON object.
        """
        if self._kept is None:
            self._print(screen_table(frame, columns, title, unbroken))
        elif name is not None:
            records = frame.to_dict("records")
            self._kept["tables"].setdefault(name, []).extend(map(_plain, records))

    def budget(self, name: str, estimate: "Estimate", title: str) -> None:
        """Print the uncertainty budget of values in K below a title."""
        from chipglow.cli.tables import budget_frame

        self.heading(f"\n{title}")
        self.table(name, budget_frame(estimate))
        self.heading()

    def facts(self, name: str, rows: Facts) -> None:
        """Print names with their texts."""
        if self._kept is not None:
            self._kept["facts"].setdefault(name, {}).update(rows)
            return
        from chipglow.cli.tables import facts_table

        self._out().print(facts_table(rows))

    def heading(self, text: str = "") -> None:
        """Print a line that the JSON object omits."""
        if self._kept is None:
            self._out().print(text, soft_wrap=True)

    def say(self, sentence: str, values: Mapping[str, Any] | None = None) -> None:
        """Print a sentence of the result; the JSON object also gets its numbers."""
        if self._kept is None:
            self._out().print(sentence, soft_wrap=True)
        else:
            self._kept["sentences"].append(sentence.strip())
            self._kept["values"].update(_plain(values or {}))

    def aside(self, sentence: str, values: Mapping[str, Any] | None = None) -> None:
        """Print a sentence on stderr; the JSON object treats it as `say` does."""
        if self._kept is None:
            print(sentence, file=sys.stderr, flush=True)
        else:
            self.say(sentence, values)

    def values(self, values: Mapping[str, Any]) -> None:
        """Add numbers to the JSON object only."""
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
        """Print the name of a written file."""
        if self._kept is None:
            print(f"{what}: {path}" if what else path)
        else:
            self._kept["files"].append(str(path))

    def close(self) -> None:
        """Print the JSON object, if any, once; a server does so early."""
        if self._kept is not None:
            found = json.dumps(self._kept, ensure_ascii=False, allow_nan=False, indent=1)
            print(found, flush=True)
            self._kept = None

    def _print(self, table: "Table") -> None:
        """Print a table; on a narrow terminal each row becomes a list of its cells."""
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
    """Start the output of a command."""
    screen = Screen()
    _CURRENT.set(screen)
    return screen


def current() -> Screen:
    """Return the output of the running command."""
    return _CURRENT.get()


def _plain(value: Any) -> Any:
    """Return a value for JSON: NaN becomes null, an array a list."""
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
