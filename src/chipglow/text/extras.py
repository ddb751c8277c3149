"""Extras of chipglow: how to install them, for messages."""


def install_command(extra: str) -> str:
    """Return the command that installs an extra in the folder of chipglow's source."""
    return f'python -m pip install ".[{extra}]"'


def needs_extra(subject: object, needed: str, extra: str) -> str:
    """Return the message that a subject needs a library of an extra."""
    return (
        f"{subject}: needs {needed}; run {install_command(extra)} in the folder of chipglow's "
        "source"
    )
