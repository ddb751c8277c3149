"""Where errors become one line and an exit code."""

import sys
from typing import Any, Final

import typer
from typer.core import TyperGroup

BAD_INPUT: Final = 2
FAILED: Final = 1
INTERRUPTED: Final = 130


class Boundary(TyperGroup):
    """Commands that end in one line and an exit code, never in a traceback, if they fail.

    2 for what the user can put right (input, files, disk), 1 for a simulation that went wrong,
    130 after Ctrl-C. Anything else is a defect of the program and keeps its traceback.
    """

    def invoke(self, ctx: Any) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
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
