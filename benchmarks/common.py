"""What the programs of this folder share: arguments, tables and times."""

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from time import perf_counter, process_time

import numpy as np


def arguments(text, **defaults):
    """Parse options whose defaults tell their type; a list takes any number of values.

    ``names=None`` takes words without an option, and a type instead of a default has none.
    """
    parser = ArgumentParser(description=text, formatter_class=RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        option = f"--{name.replace('_', '-')}"
        if default is None:
            parser.add_argument(name, nargs="*")
        elif isinstance(default, bool):
            parser.add_argument(option, action="store_true")
        elif isinstance(default, list):
            kind = type(default[0]) if default else str
            parser.add_argument(option, nargs="*", type=kind, default=default)
        elif isinstance(default, type):
            parser.add_argument(option, type=default)
        else:
            parser.add_argument(option, type=type(default), default=default)
    return parser.parse_args()


def print_head(*heads):
    """Print the head of a Markdown table."""
    print_row(*heads)
    print("|---" * len(heads) + "|")


def print_row(*cells):
    """Print a row of a Markdown table."""
    print(f"| {' | '.join(cells)} |", flush=True)


def timed(call):
    """Return the result of a call, and its wall and processor time in s."""
    begin, busy = perf_counter(), process_time()
    result = call()
    return result, perf_counter() - begin, process_time() - busy


def best_of(calls, rounds, prepare=None):
    """Return least wall and processor times of calls by name, made in turn.

    A first round, which may compile, does not count; what `prepare` does before each call neither.
    """
    taken = {name: [] for name in calls}
    for _ in range(rounds + 1):
        for name, call in calls.items():
            if prepare:
                prepare(name)
            taken[name].append(timed(call)[1:])
    return {name: np.min(times[1:], axis=0) for name, times in taken.items()}
