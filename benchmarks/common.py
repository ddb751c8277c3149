"""What the programs of this folder share: arguments, tables and times."""

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from time import perf_counter, process_time

import numpy as np


def arguments(text, given=None, /, **defaults):
    """Parse options whose defaults tell their type; a list takes any number of values.

    ``names=None`` takes words without an option, a tuple such words or numbers, all by default;
    words have to be of the tuple. A type instead of a default has none.
    """
    parser = ArgumentParser(description=text, formatter_class=RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        option = f"--{name.replace('_', '-')}"
        if default is None:
            parser.add_argument(name, nargs="*")
        elif isinstance(default, tuple):
            kind = type(default[0])
            known = default if kind is str else None
            parser.add_argument(name, nargs="*", type=kind, choices=known)
        elif isinstance(default, bool):
            parser.add_argument(option, action="store_true")
        elif isinstance(default, list):
            kind = type(default[0]) if default else str
            parser.add_argument(option, nargs="*", type=kind, default=default)
        elif isinstance(default, type):
            parser.add_argument(option, type=default)
        else:
            parser.add_argument(option, type=type(default), default=default)
    found = parser.parse_args(given)
    for name, default in defaults.items():
        if isinstance(default, tuple) and not getattr(found, name):
            setattr(found, name, default)
    return found


def print_head(*heads):
    print_row(*heads)
    print("|---" * len(heads) + "|")


def print_row(*cells):
    print(f"| {' | '.join(cells)} |", flush=True)


def print_tables(tables, markdown=False):
    """Print tables whose rows are texts, a head first: as Markdown, or in columns."""
    for head, *rows in tables:
        print()
        if markdown:
            print_head(*head)
            for row in rows:
                print_row(*row)
            continue
        widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        for row in (head, *rows):
            print("  ".join(map(str.ljust, row, widths)).rstrip())


def minus(text):
    """Return a number with a minus sign in place of the hyphen."""
    return text.replace("-", "−")


def spread(values, decimals=0):
    deviation = f" ± {np.std(values, ddof=1):.{decimals}f}" if len(values) > 1 else ""
    return f"{np.mean(values):.{decimals}f}{deviation}"


def timed(call):
    """Return the result of a call, and its wall and processor time in s."""
    begin, busy = perf_counter(), process_time()
    result = call()
    return result, perf_counter() - begin, process_time() - busy


def best_of(calls, rounds):
    """Return least wall and processor times of calls by name, made in turn.

    A first round, which may compile, does not count.
    """
    taken = {name: [] for name in calls}
    for _ in range(rounds + 1):
        for name, call in calls.items():
            taken[name].append(timed(call)[1:])
    return {name: np.min(times[1:], axis=0) for name, times in taken.items()}
