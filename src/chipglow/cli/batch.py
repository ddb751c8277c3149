"""Commands that take many files: progress, output files, and what their notes have in common."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from chipglow.camera import Measurement
    from chipglow.text import Notes

Made = TypeVar("Made")

_NAMED: Final = 3
"""Files that a note names, at most."""


def load_measurements(images: Sequence[Path], settings: Iterable[str]) -> "list[Measurement]":
    """Read measurements or camera files, with a progress bar for several."""
    from chipglow.laboratory.recordings import load_measurement

    settings = list(settings)
    with many_files(images) as files:
        return [load_measurement(image, settings) for image in files]


@contextmanager
def many_files(files: Sequence[Path]) -> Iterator[Iterator[Path]]:
    """Yield an iterator of files that shows its progress and reads them in one subprocess."""
    from chipglow.cli.progress import progress_bars
    from chipglow.io.sandbox import one_process

    if len(files) == 1:
        yield iter(files)
        return
    with one_process(), progress_bars() as progress:

        def shown() -> Iterator[Path]:
            for number, file in enumerate(files):
                progress("files", number / len(files))
                yield file
            progress("files", 1.0)

        yield shown()


def for_each(files: Sequence[Path], make: Callable[[Path], Made]) -> dict[Path, Made]:
    """Return the result of a function for each file; a ValueError at the end names the failures."""
    made: dict[Path, Made] = {}
    failed: dict[Path, str] = {}
    with many_files(files) as shown:
        for file in shown:
            try:
                made[file] = make(file)
            except (ValueError, OSError) as error:
                failed[file] = str(error)
    if failed:
        name, reason = next(iter(failed.items()))
        text = reason if str(name) in reason else f"{name}: {reason}"
        raise ValueError(
            f"{len(failed)} of {len(files)} files cannot be used, the others are done; the first "
            f"is {text}"
        )
    return made


def output_files(
    sources: Sequence[Path], folder: Path, ending: str, force: bool
) -> dict[Path, Path]:
    """Return a file in a folder for each source, named after it, and create the folder.

    Raises
    ------
    ValueError
        If two sources have the same name, or a file would replace an input.
    FileExistsError
        If a file exists, without `force`.
    """
    from chipglow.io.atomic import check_output

    targets = {source: folder / f"{source.stem}{ending}" for source in sources}
    if len(set(targets.values())) < len(sources):
        names = [target.name for target in targets.values()]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{folder / twice}: is the output of several files, rename one of them")
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is not a folder, expected one for several files")
    folder.mkdir(exist_ok=True)
    for target in targets.values():
        check_output(target)
        if target.exists() and not force:
            raise FileExistsError(f"{target}: already exists; choose another folder or --force")
    return targets


def common_notes(notes: "Mapping[Path, Notes]") -> "Notes":
    """Return the notes of many files, each once, with the files that it is about if not all."""
    from chipglow.text import Notes

    def joined(kind: str) -> list[str]:
        files: dict[str, list[Path]] = {}
        for file, one in notes.items():
            for text in getattr(one, kind):
                files.setdefault(text, []).append(file)
        return [_about(text, those, len(notes)) for text, those in files.items()]

    return Notes(joined("assumed"), joined("warnings"))


def _about(text: str, files: Sequence[Path], count: int) -> str:
    if len(files) == count:
        return text
    named = ", ".join(map(str, files[:_NAMED]))
    more = f" and {len(files) - _NAMED} other files" if len(files) > _NAMED else ""
    return f"{named}{more}: {text}"
