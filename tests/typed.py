"""Commands as a user types them."""

import shlex

from typer.testing import CliRunner

from chipglow.cli import app


def typed(command, code=0):
    """What a command prints; it must end with this code."""
    result = CliRunner().invoke(app, shlex.split(command), env={"COLUMNS": "160"})
    assert result.exit_code == code, result.output
    return result


def words(text):
    """A text without the breaks of its lines."""
    return " ".join(text.split())


def refused(command):
    """The one line with which a command ends that cannot be done."""
    lines = typed(command, code=2).output.strip().splitlines()
    assert [line for line in lines if line.startswith("chipglow: ")] == lines[-1:]
    return lines[-1]
