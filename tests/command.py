"""The command line in this process, and a disk that fills up."""

import shlex
from contextlib import contextmanager

from typer.testing import CliRunner

from chipglow.cli import app


def chipglow(*arguments, code=0, **environment):
    """What a command prints, which must end with this code."""
    result = CliRunner().invoke(app, [str(one) for one in arguments], env=environment)
    assert result.exit_code == code, result.output
    return result


def typed(command, code=0):
    """What a command line prints, which must end with this code."""
    return chipglow(*shlex.split(command), code=code, COLUMNS="160")


def run(*arguments, code=0, width=160):
    """Text that a command prints, which must end with this code."""
    return chipglow(*arguments, code=code, COLUMNS=str(width)).output


def settings_of(fields):
    """Options with the settings of a description."""
    return [f"--set={field}" for field in fields]


def words(text):
    """A text without the breaks of its lines."""
    return " ".join(text.split())


def refusal(command):
    """The one line with which a command line ends that is refused."""
    lines = refused(shlex.split(command), COLUMNS="160").strip().splitlines()
    assert lines[-1].startswith("chipglow: ")
    return lines[-1]


def refused(arguments, *parts, code=2, **environment):
    """What a command prints that is refused: one line of its own, which has the parts."""
    output = chipglow(*arguments, code=code, **environment).output
    (line,) = (line for line in output.splitlines() if line.startswith("chipglow: "))
    assert "Traceback" not in output
    for part in parts:
        assert part in line
    return output


@contextmanager
def full_disk(most_bytes):
    """No file can grow beyond some bytes, as on a disk that fills up."""
    import resource  # not on Windows, where other tests need this module

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
