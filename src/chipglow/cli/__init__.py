"""The command line: ``chipglow``."""

from chipglow.cli.app import app, main

__all__ = ["app", "main"]
