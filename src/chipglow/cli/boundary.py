"""Where errors become one line and an exit code."""

import sys
from collections.abc import Callable
from typing import Annotated, Any, Final

import typer
from typer.core import TyperGroup

from chipglow.cli import screen
from chipglow.cli.options import check_outputs

BAD_INPUT: Final = 2
FAILED: Final = 1
INTERRUPTED: Final = 130


class Boundary(TyperGroup):
    """Commands that end in one line and an exit code, never in a traceback, if they fail.

    Each has an option ``--json``: its results as one object on stdout, if it does not fail. What a
    command writes is checked before it begins.

    2 for what the user can put right (input, files, disk), 1 for a simulation that went wrong,
    130 after Ctrl-C. Anything else is a defect of the program and keeps its traceback.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        _complete(self)

    def invoke(self, ctx: Any) -> Any:
        """Run a command."""
        shown = screen.begin()
        try:
            done = super().invoke(ctx)
            shown.close()
            return done
        except BrokenPipeError:
            raise
        except (ValueError, OSError) as error:
            raise _ended(_one_line(error), BAD_INPUT) from None
        except KeyboardInterrupt as error:
            kept = f"{error}: --resume goes on from there" if str(error) else "nothing was written"
            raise _ended(f"interrupted, {kept}", INTERRUPTED) from None
        except RuntimeError as error:
            from chipglow.cutting import SolverError

            if not isinstance(error, SolverError):
                raise
            raise _ended(_one_line(error), FAILED) from None


def _ended(message: str, code: int) -> typer.Exit:
    print(f"chipglow: {message}", file=sys.stderr)
    return typer.Exit(code)


def _one_line(error: Exception) -> str:
    text = str(error)
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(text.split())


def _complete(group: TyperGroup) -> None:
    """Give every command of a group the option for programs and the check of its outputs."""
    for command in group.commands.values():
        if isinstance(command, TyperGroup):
            _complete(command)
        else:
            command.callback = _checked(command.callback)
            command.params.extend(typer.main.get_command(_JSON).params)


def _checked(run: Any) -> Callable[..., Any]:
    def checked(**values: Any) -> Any:
        check_outputs(run, values)
        return run(**values)

    return checked


_JSON: Final = typer.Typer(add_completion=False)
"""A command that has only that option, to take it from."""


def _chosen(wanted: bool) -> None:
    if wanted:
        screen.current().for_programs()


@_JSON.command()
def _with_json(
    json: Annotated[
        bool,
        typer.Option(
            "--json",
            callback=_chosen,
            expose_value=False,
            help="Print the results as one JSON object, for programs.",
        ),
    ] = False,
) -> None:
    pass
