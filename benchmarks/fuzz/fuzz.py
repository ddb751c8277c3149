"""Outcomes of reading damaged files.

    python benchmarks/fuzz/fuzz.py [--cases 100000] [--only .vtu .npz] [--processes 2] [--log FILE]

Files of every format, YAML of every kind and messages to the app are damaged, and read in forks of
this process, with limits of memory and time as the product sets them. Whatever is no plain
refusal is read once more the way the product does, in `chipglow.io.sandbox` where it uses one, and
has to end in one error there (three of a kind and hundred cases).

The change is determined by the file and the number of the case, so that --first continues a
campaign; cases that --log notes are not run again. After 5 hangs the rest of a hundred cases is
left. The command fails if a case is not contained. Linux only.
"""

import gc
import json
import os
import re
import resource
import signal
import sys
import tempfile
import traceback
from collections import Counter
from copy import deepcopy
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from random import Random
from time import perf_counter

os.environ["NUMBA_NUM_THREADS"] = "1"  # a fork has no threads but the one that made it
from targets import SNIPPETS, target_of, write_targets

from chipglow.io.sandbox import Sandbox, limit_memory

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import arguments, print_head, print_row

PATIENCE, MEMORY, ENOUGH_HANGS, CHUNK = 4, 1024**3, 5, 100
FAILED = 3
"""Exit code of a fork that this program made fail, not a case."""
OUTCOMES = ("read", "refused", "stumbled", "memory", "crash", "hang")
CHANGES = ("cut", "byte", "word", "number", "repeat", "remove", "splice")
VALUES = (
    None, True, -1, 10**400, 1e308, float("nan"), "", "0", "-40,200", "1e999 um", "a" * 10_000,
    "../x", "\0", "\ud800", [], {}, [[]], {"a": {}}, ["1 um"] * 1000, {"camera.pitch": "1e-23 m"},
    {"cursor": "1e300,0"}, {"surface.emissivity": "0"}, "change", "draw", "save", "chip", "theme",
)  # fmt: skip
NUMBERS = (b"0", b"-1", b"1e308", b"nan", b"inf", b"99999999999", b"4294967295", b"", b"\x00")
WORDS = (b"\x00" * 8, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80", b"\x01\x00\x00\x00")
NUMBER = re.compile(rb"[0-9][0-9.+\-eE]*")


def damaged(content, other, random, snippets):
    data = bytearray(content)
    for _ in range(random.randint(1, 4)):
        # Headers decide what is allocated: half of the changes are made in the first 512 bytes.
        at = random.randint(0, random.choice((len(data), min(len(data), 512))))
        part = slice(at, at + 1 + int(4096 * random.random() ** 4))
        match random.choice(CHANGES + ("snippet",) * bool(snippets)):
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
            case "snippet":
                data[at:at] = random.choice(snippets)
            case "repeat":
                data[at:at] = data[part] * random.randint(1, 3)
            case "remove":
                del data[part]
            case "splice":
                start = random.randint(0, len(other))
                data[part] = other[start : start + part.stop - at]
    return bytes(data)


def changed(content, random):
    """Return a message of the page with other values, of any type, at some of its places."""
    message = json.loads(content)
    for _ in range(random.randint(1, 3)):
        inner = message
        while True:
            key = random.choice([*inner])
            if not isinstance(inner[key], dict) or not inner[key] or random.random() < 0.3:
                break
            inner = inner[key]
        if random.random() < 0.2:
            del inner[key]
        else:
            inner[key] = deepcopy(random.choice(VALUES))
        if not message or not inner:
            break
    return json.dumps(message).encode()


def outcomes_of(prepare, read, numbers):
    """Return how reading ends, one of `OUTCOMES` for each case, in forks without a sandbox.

    A fork reads one case after another, until one ends it. Memory that runs out after other cases
    may be theirs: such a case is read once more, in a fork of its own.
    """
    found, outcome = [], partial(_read_alone, prepare, read)
    while len(found) < len(numbers) and found.count("hang") < ENOUGH_HANGS:
        ended, code = _read_in_fork(outcome, numbers[len(found) :], leave_sandbox)
        if ended[-1:] == ["memory"] and len(ended) > 1:
            ended.pop()
        elif code < 0:
            ended.append("hang" if code == -signal.SIGALRM else "crash")
        elif code == FAILED:
            raise RuntimeError(f"a fork failed at case {numbers[len(found) + len(ended)]}")
        found += ended
    return found


def outcome_in_product(read):
    """Return how reading ends as the product does it, one of `OUTCOMES`."""
    ended, code = _read_in_fork(lambda number: _outcome(read, 1000), [0], lambda: None)
    return ended[0] if ended else "hang" if code == -signal.SIGALRM else "crash"


def leave_sandbox():
    """Read in this process, with the sandbox's limit of memory."""
    Sandbox.answer = lambda self, function: function()
    limit_memory(MEMORY)


def _read_alone(prepare, read, number):
    prepare(number)
    return _outcome(read, PATIENCE)


def _outcome(read, patience):
    signal.alarm(patience)
    try:
        read()
        return "read"
    except MemoryError:
        return "memory"
    except (ValueError, OSError):
        return "refused"
    except BaseException:
        return "stumbled"
    finally:
        signal.alarm(0)


def _read_in_fork(outcome, numbers, begin):
    """Return the outcomes of cases in one fork, and the code with which it ended."""
    receiver, sender = os.pipe()
    child = os.fork()
    if not child:
        _report_outcomes(outcome, numbers, begin, sender)
    os.close(sender)
    with os.fdopen(receiver, "rb") as pipe:
        ended = [OUTCOMES[code] for code in pipe.read()]
    return ended, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _report_outcomes(outcome, numbers, begin, sender):
    said = os.dup(2)
    try:
        begin()
        devnull = os.open(os.devnull, os.O_RDWR)
        for number in range(3):
            os.dup2(devnull, number)
        for number in numbers:
            found = outcome(number)
            os.write(sender, bytes([OUTCOMES.index(found)]))
            if found == "memory":
                break
        os._exit(0)
    except BaseException:
        os.write(said, traceback.format_exc().encode())
        os._exit(FAILED)


def fuzz(contents, chunk):
    """Return a chunk of cases of one file with their outcomes, and those not contained."""
    name, first, last = chunk
    counts, escaped, begin = Counter(), [], perf_counter()
    target, path = target_of(Path.cwd(), name), Path(name)
    prepare = partial(write_case, contents, name)
    for number, outcome in enumerate(outcomes_of(prepare, target.alone, range(first, last)), first):
        counts[outcome] += 1
        if outcome not in ("read", "refused") and counts[outcome] <= 3:
            prepare(number)
            found = outcome_in_product(target.product)
            if found not in ("read", "refused"):
                escaped.append(f"{name}: case {number}: {found}")
    path.write_bytes(contents[name])
    return chunk, [counts[one] for one in OUTCOMES], perf_counter() - begin, escaped


def write_case(contents, name, number):
    """Write a file with the damage of a case."""
    random = Random(f"{name} {number}")
    if name.endswith(".message"):
        content = changed(contents[name], random)
    else:
        snippets = SNIPPETS if name.endswith(".yaml") else ()
        content = damaged(contents[name], random.choice([*contents.values()]), random, snippets)
    Path(name).write_bytes(content)


def enter_own_folder(folder):
    own = Path(tempfile.mkdtemp(dir=folder))
    os.chdir(own)
    write_targets(own)


def noted(log):
    """Return chunks in a log, with their counts and the cases that were not contained."""
    if not log or not Path(log).exists():
        return {}
    rows = (line.split(",") for line in Path(log).read_text().splitlines())
    return {
        (name, int(first), int(last)): (
            list(map(int, counts)),
            [one for one in wrong.split(";") if one],
        )
        for name, first, last, *counts, wrong in rows
    }


def main():
    given = arguments(__doc__, cases=100_000, only=[], first=0, processes=1, log="")
    log = given.log and Path(given.log).resolve()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    escaped, counts, seconds = [], {}, Counter()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        os.chdir(folder)
        contents = {name: (folder / name).read_bytes() for name in write_targets(folder)}
        chosen = [name for name in contents if not given.only or kind_of(name) in given.only]
        for name in chosen:
            target_of(folder, name).alone()  # compiles what the forks then have
        gc.freeze()
        each = -(-given.cases // len(chosen))
        last = given.first + each
        chunks = [
            (name, at, min(at + CHUNK, last))
            for at in range(given.first, last, CHUNK)
            for name in chosen
        ]
        before = noted(log)
        for chunk in set(chunks) & before.keys():
            counts[chunk], wrong = before[chunk]
            escaped += wrong
        todo = [chunk for chunk in chunks if chunk not in before]
        make = get_context("fork").Pool
        with make(given.processes, enter_own_folder, (folder,)) as pool:
            for chunk, found, taken, wrong in pool.imap_unordered(partial(fuzz, contents), todo):
                counts[chunk] = found
                seconds[chunk[0]] += taken
                escaped += wrong
                if log:
                    with log.open("a") as file:
                        print(*chunk, *found, ";".join(wrong), sep=",", file=file)
        os.chdir("/")
    print_table(chosen, counts, seconds)
    cases = sum(map(sum, counts.values()))
    print(f"{cases} cases, {len(escaped)} that the product does not contain")
    print(*escaped, sep="\n")
    sys.exit(bool(escaped))


def print_table(names, counts, seconds):
    print_head("file", *OUTCOMES, "ms a case")
    for name in names:
        of_name = [found for chunk, found in counts.items() if chunk[0] == name]
        sums = [sum(column) for column in zip(*of_name, strict=True)]
        each = f"{1e3 * seconds[name] / max(sum(sums), 1):.0f}"
        print_row(name, *map(str, sums), each)
    total = [sum(column) for column in zip(*counts.values(), strict=True)]
    print_row("all", *map(str, total), "")


def kind_of(name):
    """Return the ending of a file, or of the folder that it is a part of."""
    return Path(Path(name).parts[0]).suffix


if __name__ == "__main__":
    main()
