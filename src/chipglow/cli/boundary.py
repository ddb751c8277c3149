"""Conversion of errors to one line and an exit code."""

import os
import sys
from collections.abc import Callable
from typing import Any, Final

import typer
from typer.core import TyperGroup

from chipglow.cli import options as opt, screen, streams
from chipglow.cli.shortage import was_short_of_memory

BAD_INPUT: Final = 2
"""Exit status after invalid input; Click uses the same."""

FAILED: Final = 1
"""Exit status after a failure."""

INTERRUPTED: Final = 130
"""Exit status after Ctrl-C. Shells use the same: 128 plus the number of the signal."""

_LONGEST_MESSAGE: Final = 2000
"""Characters of an error that are shown; a longer one quotes a value of the input."""

_NO_THREAD: Final = "can't start new thread"
_RESERVE: Final = 2**20
"""Bytes kept for the line that says that memory is missing."""

_FEWER: Final = "end other programs, raise the limit (ulimit -u), or set OMP_NUM_THREADS=1"
_SMALLER: Final = "choose fewer or coarser samples, or end other programs"


class Boundary(TyperGroup):
    """Commands that end in one line and an exit code if they fail, never in a traceback."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        _complete(self, next(option for option in self.params if option.name == "json"))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; options may choose what the screen shows."""
        screen.begin()
        return super().parse_args(ctx, args)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run a command; what it could not print is an error at the end."""
        reserve = bytearray(_RESERVE)
        try:
            return super().main(*args, **kwargs)
        except Exception as error:
            del reserve
            if (message := _failure(error)) is None:
                raise
            print(f"chipglow: {message}", file=sys.stderr)
            sys.exit(FAILED)
        finally:
            if unwritten := streams.failure():
                print(f"chipglow: standard output: {unwritten.strerror}", file=sys.stderr)
                sys.exit(FAILED)

    def invoke(self, ctx: Any) -> Any:
        try:
            done = super().invoke(ctx)
            screen.current().close()
            return done
        except typer.Exit:
            raise
        except typer.BadParameter as error:
            if error.param is None or not error.message:  # a missing value
                raise
            message = error.message.removeprefix("Value error, ")
            raise _ended(f"{error.param.opts[0]}: {message}", BAD_INPUT) from None
        except (ValueError, OSError) as error:
            # The system states a number, a library that could not be loaded does not.
            if getattr(error, "errno", 0) is None and was_short_of_memory():
                raise
            raise _ended(_one_line(error), BAD_INPUT) from None
        except OverflowError as error:
            raise _ended(f"a number is too large: {_one_line(error)}", BAD_INPUT) from None
        except RecursionError:
            raise _ended("the input is nested too deeply", BAD_INPUT) from None
        except KeyboardInterrupt as error:
            kept = (
                f"{error}: --resume continues from there" if str(error) else "nothing was written"
            )
            raise _ended(f"interrupted, {kept}", INTERRUPTED) from None


def _failure(error: Exception) -> str | None:
    """Return what to print for an error that is no refusal; None if nothing explains it."""
    if isinstance(error, MemoryError):
        said = _one_line(error)
        return f"not enough memory{': ' * bool(said)}{said}; {_SMALLER}"
    # A command that simulates has imported the class; memory may be too short for an import.
    cutting = sys.modules.get("chipglow.cutting")
    if cutting and isinstance(error, cutting.SolverError):
        return _one_line(error)
    if was_short_of_memory():
        said = f"{type(error).__name__}: {_one_line(error)}"
        return f"probably not enough memory ({said}); {_SMALLER}"
    if isinstance(error, RuntimeError) and str(error) == _NO_THREAD:
        return f"the system starts no more threads or processes; {_FEWER}"
    return None


def _ended(message: str, code: int) -> typer.Exit:
    print(f"chipglow: {message}", file=sys.stderr)
    return typer.Exit(code)


def _one_line(error: Exception) -> str:
    text = str(error)
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    line, half = " ".join(text.split()), _LONGEST_MESSAGE // 2
    return line if len(line) <= _LONGEST_MESSAGE else f"{line[:half]} … {line[-half:]}"


def _complete(group: TyperGroup, option: Any) -> None:
    """Add the program's option and the check of its files to every command of a group."""
    for command in group.commands.values():
        if isinstance(command, TyperGroup):
            _complete(command, option)
        else:
            command.callback = _checked(command.callback)
            command.params.append(option)


def _checked(run: Any) -> Callable[..., Any]:
    def checked(**values: Any) -> Any:
        if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
            raise ValueError("NUMBA_DISABLE_JIT is set, but chipglow needs compiled code: unset it")
        with opt.checked_files(run, values):
            return run(**values)

    return checked
