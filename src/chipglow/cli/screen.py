"""Output of a command: text and tables, or one JSON object."""

import json
import os
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from chipglow.cli.tables import budget_frame, facts_table, screen_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure
    from rich.console import Console
    from rich.table import Table
    from rich.text import TextType

    from chipglow.cli.tables import Columns
    from chipglow.text import Notes
    from chipglow.uncertainty import Estimate

_PIPE_WIDTH: Final = 200
"""Width of tables in a pipe or a file, so that each row is one line."""


class Screen:
    """Output of one command: text at once, or one JSON object at the end."""

    def __init__(self, json: bool = False) -> None:
        self.json = json
        self._record: dict[str, Any] = {key: {} for key in ("tables", "facts", "values")}
        for key in ("sentences", "assumed", "warnings", "missing", "files"):
            self._record[key] = []

    def table(
        self,
        name: str | None,
        frame: "pd.DataFrame",
        columns: "Columns" = (),
        title: str | None = None,
        unbroken: Collection[str] = (),
    ) -> None:
        """Print a frame as `screen_table` does; without a name it is not in the JSON object."""
        if name is not None:
            self._record["tables"].setdefault(name, []).extend(frame.to_dict("records"))
        if not self.json:
            self._print(screen_table(frame, columns, title, unbroken))

    def budget(self, name: str, estimate: "Estimate", title: str) -> None:
        self.heading(f"\n{title}")
        self.table(name, budget_frame(estimate))
        self.heading()

    def facts(self, name: str, rows: Iterable[tuple[str, str]]) -> None:
        rows = list(rows)
        self._record["facts"].setdefault(name, {}).update(rows)
        if not self.json:
            self._show(facts_table(rows))

    def heading(self, text: str = "", stream: TextIO | None = None) -> None:
        """Print a line that the JSON object omits, by default on stdout."""
        if not self.json:
            print(text, file=stream, flush=True)

    def say(
        self, sentence: str, values: Mapping[str, Any] | None = None, stream: TextIO | None = None
    ) -> None:
        """Print a sentence of the result; the JSON object also gets its numbers."""
        self.heading(sentence, stream)
        self._record["sentences"].append(sentence.strip())
        self.values(values or {})

    def values(self, values: Mapping[str, Any]) -> None:
        """Add numbers to the JSON object only."""
        self._record["values"].update(values)

    def notes(self, notes: "Notes", missing: Iterable[str] = ()) -> None:
        """Print assumptions and warnings on stderr, and which results are missing on stdout."""
        self._sentences("assumed", "Assumed", notes.assumed, sys.stderr)
        self._sentences("warnings", "Warning", notes.warnings, sys.stderr)
        self._sentences("missing", "Missing", missing, sys.stdout)

    def remarks(self, notes: "Notes") -> None:
        for sentence in notes.remarks:
            self.say(sentence)

    def file(self, path: Path, what: str = "") -> None:
        self.heading(f"{what}: {path}" if what else str(path))
        self._record["files"].append(str(path))

    def close(self) -> None:
        """Print the JSON object, if any, once; a server does so early."""
        if self.json and self._record:
            from importlib.metadata import version

            result = {"chipglow": version("chipglow")} | _plain(self._record)
            print(json.dumps(result, ensure_ascii=False, allow_nan=False, indent=1), flush=True)
            self._record = {}

    def _print(self, table: "Table") -> None:
        """Print a table; on a narrow terminal each row becomes a list of its cells."""
        from rich.measure import Measurement

        console = self._console()
        unlimited = console.options.update(max_width=10 * _PIPE_WIDTH)
        if Measurement.get(console, unlimited, table).minimum <= console.width:
            self._show(table)
            return
        if table.title:
            self._show(table.title)
        heads = [str(column.header) for column in table.columns]
        for row in zip(*(column.cells for column in table.columns), strict=True):
            self.heading()
            self._show(facts_table(zip(heads, map(str, row), strict=True)))

    def _show(self, content: "Table | TextType") -> None:
        console = self._console()
        with console.capture() as text:
            console.print(content)
        self.heading(text.get().removesuffix("\n"))

    def _sentences(self, key: str, head: str, sentences: Iterable[str], stream: TextIO) -> None:
        # A sentence printed before a computation is not repeated after it.
        for sentence in [one for one in sentences if one not in self._record[key]]:
            self._record[key].append(sentence)
            self.heading(f"{head}: {sentence}", stream)

    def _console(self) -> "Console":
        from rich.console import Console

        console = Console(highlight=False, markup=False)
        if not sys.stdout.isatty() and "COLUMNS" not in os.environ:
            console.width = _PIPE_WIDTH
        return console


_CURRENT: ContextVar[Screen] = ContextVar("screen")


def begin() -> None:
    """Start the output of a command."""
    _CURRENT.set(Screen())


def current() -> Screen:
    """Return the output of the running command."""
    return _CURRENT.get()


def finish(notes: "Notes", *files: tuple[Path | None, Callable[[Path], object]]) -> None:
    """Print assumptions and warnings, then write each file that has a path."""
    screen = current()
    screen.notes(notes)
    for path, write in files:
        if path is not None:
            write(path)
            screen.file(path)


def figure(draw: "Callable[..., Figure]", *arguments: Any) -> Callable[[Path], None]:
    """Return a function that draws a figure and writes it in the format of the file's name."""

    def write(path: Path) -> None:
        from chipglow.drawing.drawing import DPI
        from chipglow.io import atomic_path

        drawn = draw(*arguments)
        with atomic_path(path) as temporary:
            drawn.savefig(temporary, format=path.suffix[1:].lower(), dpi=DPI)

    return write


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
