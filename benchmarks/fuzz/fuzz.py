"""Outcomes of reading damaged files.

    python benchmarks/fuzz/fuzz.py [--cases 100000] [--only .vtu .npz]

Real and generated files of every format are damaged by Hypothesis: cut, bytes changed, numbers made
huge, parts repeated, removed or exchanged with another file. They are read in forks of this
process, 200 cases each, with limits of memory and time as the product sets them. Whatever is no
plain refusal is read once more the way the product does, in `chipglow.io.sandbox`, and has
to end in one `SourceError` there (three of a kind and file). After 50 hangs a file is left. The
command fails if a case is not contained.
Linux only.
"""

import argparse
import gc
import os
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from multiprocessing import get_context
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, settings, strategies as st
from seeds import seeds

from chipglow.io.sandbox import Isolated, limit_memory
from chipglow.io.sources import SourceError
from chipglow.scene import Raster

FORK = get_context("fork")
RASTER = Raster(0.0, 1.0, 1.0 / 24, 24, 24)
PATIENCE = 4
MEMORY = 1024**3
CASES_OF_A_FORK = 200
ENOUGH_HANGS = 50
OUTCOMES = ("read", "refused", "stumbled", "memory", "crash", "hang")
READ, REFUSED, STUMBLED, OUT_OF_MEMORY = range(4)
NUMBERS = (b"0", b"-1", b"1e308", b"nan", b"inf", b"99999999999", b"4294967295", b"", b"\x00")
WORDS = (b"\x00" * 8, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80", b"\x01\x00\x00\x00")


@st.composite
def damages(draw):
    """Draw up to four changes of a file, each a kind, two places and a value."""
    return draw(
        st.lists(
            st.tuples(
                st.sampled_from(("cut", "byte", "word", "number", "repeat", "remove", "splice")),
                st.floats(0.0, 1.0),
                st.floats(0.0, 1.0),
                st.integers(0, 255),
            ),
            min_size=1,
            max_size=4,
        )
    )


def damaged(content, other, changes):
    """Return the content with the changes applied."""
    data = bytearray(content)
    for kind, first, second, value in changes:
        size = len(data)
        # Headers decide what is allocated: half of the changes are made in the first 512 bytes.
        reach = min(size, 512) if value % 2 else size
        at, length = int(first * reach), 1 + int(second**4 * 4096)
        if kind == "cut":
            del data[at:]
        elif kind == "byte":
            data[at : at + 1] = bytes([value])
        elif kind == "word":
            word = WORDS[value % len(WORDS)]
            data[at : at + len(word)] = word
        elif kind == "number":
            replace_number(data, at, NUMBERS[value % len(NUMBERS)])
        elif kind == "repeat":
            data[at:at] = data[at : at + length] * (1 + value % 3)
        elif kind == "remove":
            del data[at : at + length]
        else:
            start = int(second * len(other))
            data[at : at + length] = other[start : start + length]
    return bytes(data)


def replace_number(data, at, number):
    """Replace the next number in digits."""
    digits = b"0123456789.+-eE"
    start = at
    while start < len(data) and data[start] not in b"0123456789":
        start += 1
    end = start
    while end < len(data) and data[end] in digits:
        end += 1
    data[start:end] = number


def read(source):
    """Return the index in `OUTCOMES` of reading a source."""
    try:
        source.survey()
        for count, _ in enumerate(source.frames(RASTER)):
            if count == 2:
                break
    except MemoryError:
        return OUT_OF_MEMORY
    except (SourceError, OSError):
        return REFUSED
    except Exception:
        return STUMBLED
    return READ


class Reader:
    """A fork of this process that reads one source after the other; a new one if it ends."""

    def __init__(self):
        self._child = None
        self._left = 0

    def outcome(self, source):
        """Return the outcome of reading a source."""
        if self._left == 0:
            self._start()
        self._left -= 1
        self._pipe.send(source)
        try:
            return OUTCOMES[self._pipe.recv()]
        except EOFError:
            self._left = 0
            self._child.join()
            return "hang" if self._child.exitcode == -signal.SIGALRM else "crash"

    def _start(self):
        if self._child is not None:
            self._child.kill()
            self._child.join()
        self._pipe, end = FORK.Pipe()
        self._child, self._left = (
            FORK.Process(target=serve, args=(end,), daemon=True),
            CASES_OF_A_FORK,
        )
        self._child.start()
        end.close()


def serve(pipe):
    """Read sources in a fork and send the outcomes."""
    devnull = os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, 1)
    os.dup2(devnull, 2)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    limit_memory(MEMORY)
    while True:
        source = pipe.recv()
        signal.alarm(PATIENCE)
        found = read(source)
        signal.alarm(0)
        pipe.send(found)


def read_as_the_product_does(source, name):
    """Read a source in a subprocess; a plain refusal is no error."""
    isolated = Isolated(source, name, memory=MEMORY, patience=PATIENCE)
    try:
        isolated.survey()
        for count, _ in enumerate(isolated.frames(RASTER)):
            if count == 2:
                break
    except (SourceError, OSError):
        return


def fuzz(seed, others, cases, folder, reader, escaped):
    """Count the outcomes of damaged copies of one file."""
    counts = Counter()
    path = folder / seed.name
    twice = Counter()

    @settings(
        max_examples=cases,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        derandomize=True,
    )
    @given(changes=damages(), other=st.integers(0, len(others) - 1))
    def case(changes, other):
        if counts["hang"] == ENOUGH_HANGS:
            return
        path.write_bytes(damaged(seed.content, others[other].content, changes))
        source = seed.source(path)
        found = reader.outcome(source)
        counts[found] += 1
        if found not in ("read", "refused") and twice[found] < 3:
            twice[found] += 1
            try:
                read_as_the_product_does(source, seed.name)
            except Exception as error:
                escaped.append(f"{seed.name}: {changes}: {type(error).__name__}: {error}")

    case()
    if seed.is_part:
        seed.written(folder)
    return counts


def main():
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--only", nargs="*", default=[], metavar="SUFFIX")
    wanted = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    escaped, total, reader = [], Counter(), Reader()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        everything = seeds(folder)
        chosen = [s for s in everything if not wanted.only or s.suffix in wanted.only]
        print("| file | " + " | ".join(OUTCOMES) + " | ms a case |")
        print("|---" * (len(OUTCOMES) + 2) + "|")
        for seed in chosen:
            read(seed.source(seed.written(folder)))  # compiles what the forks then have
            if reader.outcome(seed.source(seed.written(folder))) != "read":
                escaped.append(f"{seed.name}: the file itself cannot be read")
            gc.freeze()
            begin = time.perf_counter()
            counts = fuzz(
                seed, everything, -(-wanted.cases // len(chosen)), folder, reader, escaped
            )
            spent = (time.perf_counter() - begin) / max(sum(counts.values()), 1)
            total += counts
            row = " | ".join(str(counts[key]) for key in OUTCOMES)
            print(f"| {seed.name} | {row} | {spent * 1e3:.0f} |", flush=True)
    print("| all | " + " | ".join(str(total[key]) for key in OUTCOMES) + " | |")
    print(f"{sum(total.values())} cases, {len(escaped)} that the product does not contain")
    for text in escaped:
        print(text)
    sys.exit(bool(escaped))


if __name__ == "__main__":
    main()
