"""Commands as a user gives them."""

from typer.testing import CliRunner

from chipglow.cli import app


def run(*arguments, code=0, width=160):
    """What a command says, which must end with this code."""
    result = CliRunner().invoke(app, list(map(str, arguments)), env={"COLUMNS": str(width)})
    assert result.exit_code == code, result.output
    return result.output


def settings_of(fields):
    """Options that say the same as a description."""
    return [f"--set={field}" for field in fields]
