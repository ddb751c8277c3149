"""The command line in this process, and a disk that fills up."""

import resource
from contextlib import contextmanager

from typer.testing import CliRunner

from chipglow.cli import app


def chipglow(*arguments, code=0, **environment):
    """What a command prints, which must end with this code."""
    result = CliRunner().invoke(app, [str(one) for one in arguments], env=environment)
    assert result.exit_code == code, result.output
    return result


def refused(arguments, *parts, code=2):
    """What a command prints that is refused: one line of its own, which has the parts."""
    output = chipglow(*arguments, code=code).output
    (line,) = (line for line in output.splitlines() if line.startswith("chipglow: "))
    assert "Traceback" not in output
    for part in parts:
        assert part in line
    return output


@contextmanager
def full_disk(most_bytes):
    """No file can grow beyond some bytes, as on a disk that fills up."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
