"""``python -m chipglow``: the command."""

from chipglow.cli import main

main()
