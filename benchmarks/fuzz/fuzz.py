"""Outcomes of reading damaged files.

    python benchmarks/fuzz/fuzz.py [--cases 100000] [--only .vtu .npz]

Files of every format are damaged, and each is read in a fork of this process, with limits of memory
and time as the product sets them. Whatever is no plain refusal is read once more the way the
product does, in `chipglow.io.sandbox`, and has to end in one `SourceError` there (three of a kind
and file). After 50 hangs a file is left. The command fails if a case is not contained. Linux only.
"""

import gc
import os
import re
import resource
import signal
import sys
import tempfile
from collections import Counter
from contextlib import suppress
from itertools import islice
from pathlib import Path
from random import Random
from time import perf_counter

from seeds import source_of, write_seeds

from chipglow.io.sandbox import Isolated, limit_memory
from chipglow.io.sources import SourceError
from chipglow.scene import Raster

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import arguments, print_head, print_row

RASTER = Raster(0.0, 1.0, 1.0 / 24, 24, 24)
PATIENCE, MEMORY, ENOUGH_HANGS = 4, 1024**3, 50
OUTCOMES = ("read", "refused", "stumbled", "memory", "crash", "hang")
CHANGES = ("cut", "byte", "word", "number", "repeat", "remove", "splice")
NUMBERS = (b"0", b"-1", b"1e308", b"nan", b"inf", b"99999999999", b"4294967295", b"", b"\x00")
WORDS = (b"\x00" * 8, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80", b"\x01\x00\x00\x00")
NUMBER = re.compile(rb"[0-9][0-9.+\-eE]*")


def damaged(content, other, random):
    data = bytearray(content)
    for _ in range(random.randint(1, 4)):
        # Headers decide what is allocated: half of the changes are made in the first 512 bytes.
        at = random.randint(0, random.choice((len(data), min(len(data), 512))))
        part = slice(at, at + 1 + int(4096 * random.random() ** 4))
        match random.choice(CHANGES):
            case "cut":
                del data[at:]
            case "byte":
                data[at : at + 1] = random.randbytes(1)
            case "word":
                word = random.choice(WORDS)
                data[at : at + len(word)] = word
            case "number":
                if found := NUMBER.search(data, at):
                    data[slice(*found.span())] = random.choice(NUMBERS)
            case "repeat":
                data[at:at] = data[part] * random.randint(1, 3)
            case "remove":
                del data[part]
            case "splice":
                start = random.randint(0, len(other))
                data[part] = other[start : start + part.stop - at]
    return bytes(data)


def read(source):
    source.survey()
    for _ in islice(source.frames(RASTER), 3):
        pass


def outcome_of(source):
    """One of `OUTCOMES`: how reading a source in a fork ends."""
    child = os.fork()
    if child:
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        return "hang" if code == -signal.SIGALRM else "crash" if code < 0 else OUTCOMES[code]
    devnull = os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, 1)
    os.dup2(devnull, 2)
    limit_memory(MEMORY)
    signal.alarm(PATIENCE)
    code = OUTCOMES.index("read")
    try:
        read(source)
    except MemoryError:
        code = OUTCOMES.index("memory")
    except (SourceError, OSError):
        code = OUTCOMES.index("refused")
    except Exception:
        code = OUTCOMES.index("stumbled")
    os._exit(code)


def fuzz(name, contents, cases, folder, escaped):
    counts, others = Counter(), list(contents.values())
    source, path = source_of(folder, name), folder / name
    for number in range(cases):
        random = Random(f"{name} {number}")
        path.write_bytes(damaged(contents[name], random.choice(others), random))
        outcome = outcome_of(source)
        counts[outcome] += 1
        if outcome not in ("read", "refused") and counts[outcome] <= 3:
            try:
                with suppress(SourceError, OSError):
                    read(Isolated(source, name, memory=MEMORY, patience=PATIENCE))
            except Exception as error:
                escaped.append(f"{name}: case {number}: {type(error).__name__}: {error}")
        if counts["hang"] == ENOUGH_HANGS:
            break
    path.write_bytes(contents[name])
    return counts


def main():
    given = arguments(__doc__, cases=100_000, only=[])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    escaped, total = [], Counter()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        contents = {name: (folder / name).read_bytes() for name in write_seeds(folder)}
        kinds = {name: Path(Path(name).parts[0]).suffix for name in contents}
        chosen = [name for name in contents if not given.only or kinds[name] in given.only]
        print_head("file", *OUTCOMES, "ms a case")
        for name in chosen:
            read(source_of(folder, name))  # compiles what the forks then have
            gc.freeze()
            begin = perf_counter()
            counts = fuzz(name, contents, -(-given.cases // len(chosen)), folder, escaped)
            spent = (perf_counter() - begin) / counts.total()
            total += counts
            print_row(name, *(str(counts[one]) for one in OUTCOMES), f"{spent * 1e3:.0f}")
    print_row("all", *(str(total[one]) for one in OUTCOMES), "")
    print(f"{total.total()} cases, {len(escaped)} that the product does not contain")
    print(*escaped, sep="\n")
    sys.exit(bool(escaped))


if __name__ == "__main__":
    main()
