"""Outcomes of commands that are killed, or that lack disk, memory, permissions or whole files.

    python benchmarks/faults/faults.py [--cases 1000] [--only killed signalled] [--processes 2]

A case is a command in a fork of this process, and one fault at a place or time that the kind and
the number of the case determine. It fails if the command prints a traceback, hangs, changes its
input, or leaves an output that is not whole. Kinds:

    killed     SIGKILL at a random time
    signalled  SIGINT, SIGTERM or SIGHUP at a random time
    full       no file can grow beyond a random size, as on a disk that fills up
    memory     the process may take a random amount of memory more
    read-only  the folder of the output cannot be written
    special    input or output is a pipe, a socket, a device, a folder or a loop of links
    twice      the same command twice at the same time
    damaged    bytes of an input are changed, or its end is missing or zero

With --log FILE each case that ends is noted there; cases in the file are not run again. Linux only.
"""

import os
import resource
import shutil
import signal
import socket
import sys
import tempfile
import time
from collections import Counter, defaultdict
from contextlib import suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from random import Random

os.environ["NUMBA_NUM_THREADS"] = "1"  # a fork has no threads but the one that made it
import numpy as np

from chipglow.cli import app
from chipglow.io import write_scene
from chipglow.io.digest import is_intact
from chipglow.scene import Raster, Scene

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import arguments, print_head, print_row

KINDS = ("killed", "signalled", "full", "memory", "read-only", "special", "twice", "damaged")
OUTCOMES = ("done", "refused", "ended", "failed")
JOBS = {
    "init": ("init", "study-2.yaml"),
    "measure": ("measure", "scene.nc", "--study", "study.yaml", "--out", "measured.nc"),
    "show": ("show", "scene.nc", "--plot", "shown.png"),
    "sweep": (
        "sweep", "study.yaml", "--vary", "camera.pitch=4um,6um", "--workers", "0", "--out", "sweep",
    ),
}  # fmt: skip
OUTPUTS = {"init": "study-2.yaml", "measure": "measured.nc", "show": "shown.png", "sweep": "sweep"}
INPUTS = ("scene.nc", "study.yaml")
STUDY = """
scene: scene.nc
surface: {kind: uniform, emissivity: 0.6}
camera: {integration_time: 2 us, lower_limit: none}
analysis: {exposures: 2, phases: 1, points: {middle: [0 um, 0 um]}}
"""
LONGEST = 300  # s: a command that takes more hangs; they take up to 10, on a busy machine 100
NOBODY = 65534
CODES = {0: "done", 1: "refused", 2: "refused", 130: "ended"}


def write_inputs(folder):
    raster = Raster(left=-20e-6, top=20e-6, spacing=1e-6, rows=40, columns=40)
    times = 1e-6 * np.arange(6)
    hot = [600 + 500 * np.exp(-(((raster.x - 4 * time) / 10e-6) ** 2)) for time in times]
    frames = np.stack([np.broadcast_to(one, raster.shape) for one in hot])
    write_scene(Scene.from_fields(raster, times, {"temperature": frames}), folder / "scene.nc")
    (folder / "study.yaml").write_text(STUDY)


def run(folder, words, prepare=lambda: None):
    """Start a command in a fork, which ends with its exit code; what it prints goes to a file."""
    child = os.fork()
    if child:
        return child
    code = 70
    try:
        os.chdir(folder)
        os.setsid()
        said = os.open("said", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        for number in (1, 2):
            os.dup2(said, number)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        for name in ("SIGTERM", "SIGHUP", "SIGINT"):
            signal.signal(getattr(signal, name), signal.default_int_handler)
        prepare()
        try:
            app(list(words))
        except SystemExit as end:
            code = end.code or 0
        sys.stdout.flush()
    except BaseException:
        import traceback

        with suppress(BaseException):
            traceback.print_exc()
            sys.stderr.flush()
    os._exit(code)


def ended(child, until=None):
    """Return the exit code of a fork, negative for a signal; None if it hangs."""
    end = time.monotonic() + LONGEST if until is None else until
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.001)
    if until is None:
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
    return None


def stopped_at(number, moment, child):
    """Send a signal to a fork at a time, unless it has ended; return its exit code."""
    code = ended(child, moment)
    if code is None:
        with suppress(ProcessLookupError):
            os.kill(child, number)
        code = ended(child)
    return code


def limited(kind, amount):
    if kind == resource.RLIMIT_DATA:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        amount += 1024 * int(status.partition("VmData:")[2].split()[0])
    else:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(kind, (amount, amount))


def as_nobody():
    if os.getuid() == 0:
        os.setgid(NOBODY)
        os.setuid(NOBODY)


def make_special(path, kind):
    path.unlink(missing_ok=True)
    match kind:
        case "pipe":
            os.mkfifo(path)
        case "socket":
            with socket.socket(socket.AF_UNIX) as made:
                made.bind(os.path.relpath(path))
        case "device":
            path.symlink_to("/dev/zero")
        case "folder":
            path.mkdir()
        case "loop":
            path.symlink_to(path.name)


def damage(path, random):
    content = bytearray(path.read_bytes())
    at = random.randrange(len(content))
    match random.choice(("bit", "end", "zeros")):
        case "bit":
            content[at] ^= 1 << random.randrange(8)
        case "end":
            del content[at:]
        case "zeros":
            content[at:] = bytes(len(content) - at)
    path.write_bytes(content)


def outcome_of(source, times, case):
    """Return kind, number, outcome and what is wrong of a case."""
    kind, number = case
    random = Random(f"{kind} {number}")
    job = random.choice([*JOBS] if kind != "damaged" else ["measure", "show", "sweep"])
    with tempfile.TemporaryDirectory(prefix="fault-") as temporary:
        folder = Path(temporary)
        for name in INPUTS:
            shutil.copy(source / name, folder / name)
        os.chdir(folder)
        changed = set()
        codes = apply(kind, job, folder, times[job], random, changed)
        wrong = list(problems(source, folder, job, kind, codes, changed))
        said = (folder / "said").read_text(errors="replace") if (folder / "said").exists() else ""
        os.chdir("/")
    if kind in ("killed", "signalled") and any(code is not None and code < 0 for code in codes):
        outcome = "ended"
    else:
        outcome = max((CODES.get(code, "failed") for code in codes), key=OUTCOMES.index)
    if wrong:
        last = " ".join(said.split())[-200:]
        return kind, number, "failed", f"{job}: {'; '.join(wrong)}: {last}"
    return kind, number, outcome, ""


def apply(kind, job, folder, usual, random, changed):
    """Run the command of a job with a fault; return the exit codes."""
    words, output = JOBS[job], folder / OUTPUTS[job]
    start = time.monotonic()
    match kind:
        case "killed" | "signalled":
            signals = (signal.SIGKILL,) if kind == "killed" else (
                signal.SIGINT, signal.SIGTERM, signal.SIGHUP,
            )  # fmt: skip
            moment = start + usual * random.uniform(0.0, 1.1)
            return [stopped_at(random.choice(signals), moment, run(folder, words))]
        case "full":
            most = int(10 ** random.uniform(0, 5))
            return [ended(run(folder, words, partial(limited, resource.RLIMIT_FSIZE, most)))]
        case "memory":
            most = int(10 ** random.uniform(4, 8.3))
            return [ended(run(folder, words, partial(limited, resource.RLIMIT_DATA, most)))]
        case "read-only":
            (folder / "said").touch()
            (folder / "said").chmod(0o666)
            folder.chmod(0o555)
            code = ended(run(folder, words, as_nobody))
            folder.chmod(0o755)
            return [code]
        case "special":
            path = random.choice([output, *(folder / name for name in words if name in INPUTS)])
            make_special(path, random.choice(("pipe", "socket", "device", "folder", "loop")))
            changed |= {path.name}
            return [ended(run(folder, words))]
        case "twice":
            children = [run(folder, words) for _ in range(2)]
            return [ended(child) for child in children]
        case "damaged":
            name = random.choice([name for name in words if name in INPUTS])
            damage(folder / name, random)
            changed |= {name}
            return [ended(run(folder, words))]


def problems(source, folder, job, kind, codes, changed):
    """Yield what a command should not have done."""
    said = (folder / "said").read_text(errors="replace") if (folder / "said").exists() else ""
    if "Traceback" in said:
        yield "a traceback"
    for code in codes:
        if code is None:
            yield f"no end in {LONGEST} s"
        elif code not in CODES and kind not in ("killed", "signalled"):
            yield f"exit code {code}"
    for name in INPUTS:
        if name not in changed and (folder / name).read_bytes() != (source / name).read_bytes():
            yield f"{name} is changed"
    if OUTPUTS[job] in changed:
        return
    output = folder / OUTPUTS[job]
    if output.exists() and not is_whole(output):
        yield f"{output.name} is not whole"
    if not output.exists() and all(code == 0 for code in codes):
        yield f"{output.name} is missing"
    if kind != "killed":
        left = [one.name for one in folder.iterdir() if one.name.startswith(".")]
        if left:
            yield f"left {', '.join(left)}"


def is_whole(path):
    """Return whether an output is complete, by what its format states of its end."""
    if path.is_dir():
        points = (path / "points").glob("*.json")
        return all(one.read_bytes().endswith(b"}") for one in points)
    content = path.read_bytes()
    if path.suffix == ".nc":
        return bool(is_intact(path))
    return content.endswith(b"IEND\xaeB`\x82" if path.suffix == ".png" else b"\n")


def usual_times(source):
    """Return the time that each command takes in a fork without a fault, which must be done."""
    times = {}
    for job, words in JOBS.items():
        with tempfile.TemporaryDirectory(prefix="fault-") as temporary:
            folder = Path(temporary)
            for name in INPUTS:
                shutil.copy(source / name, folder / name)
            start = time.monotonic()
            code = ended(run(folder, words))
            times[job] = time.monotonic() - start
            if code != 0 or not is_whole(folder / OUTPUTS[job]):
                sys.exit(f"{job}: {code}: {(folder / 'said').read_text()}")
    return times


def warm_up(source):
    """Run each command once in this process, so that the forks have its libraries and kernels."""
    with tempfile.TemporaryDirectory(prefix="fault-") as temporary:
        folder = Path(temporary)
        for name in INPUTS:
            shutil.copy(source / name, folder / name)
        os.chdir(folder)
        with Path(os.devnull).open("w") as null:
            streams = sys.stdout, sys.stderr
            sys.stdout = sys.stderr = null
            try:
                for words in JOBS.values():
                    app(list(words), standalone_mode=False)
            finally:
                sys.stdout, sys.stderr = streams
        os.chdir("/")


def noted(log):
    """Return the cases in a log, by kind and number."""
    if not log or not Path(log).exists():
        return {}
    rows = (line.split(",", 3) for line in Path(log).read_text().splitlines())
    return {(kind, int(number)): (outcome, wrong) for kind, number, outcome, wrong in rows}


def main():
    given = arguments(__doc__, cases=1000, first=0, only=[*KINDS], processes=1, log="")
    log = given.log and Path(given.log).resolve()
    every = [
        (kind, n) for n in range(given.first, given.first + given.cases) for kind in given.only
    ]
    found = {case: one for case, one in noted(log).items() if case in set(every)}
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="faults-") as temporary:
        source = Path(temporary)
        source.chmod(0o755)
        os.environ["CHIPGLOW_CACHE"] = str(source / "cache")
        write_inputs(source)
        warm_up(source)
        times = usual_times(source)
        todo = [case for case in every if case not in found]
        with get_context("fork").Pool(given.processes) as pool:
            for kind, number, *one in pool.imap_unordered(partial(outcome_of, source, times), todo):
                found[kind, number] = one
                if log:
                    with log.open("a") as file:
                        print(kind, number, *one, sep=",", file=file)
    print_table(found, time.monotonic() - begin)
    sys.exit(any(outcome == "failed" for outcome, _ in found.values()))


def print_table(found, seconds):
    counts = defaultdict(Counter)
    for (kind, _), (outcome, _) in found.items():
        counts[kind][outcome] += 1
    print_head("fault", "cases", *OUTCOMES)
    for kind, one in counts.items():
        print_row(kind, str(one.total()), *(str(one[outcome]) for outcome in OUTCOMES))
    total = sum(counts.values(), Counter())
    print_row("all", str(total.total()), *(str(total[outcome]) for outcome in OUTCOMES))
    print(f"{seconds:.0f} s")
    for (kind, number), (outcome, wrong) in sorted(found.items()):
        if outcome == "failed":
            print(f"{kind}, case {number}: {wrong}")


if __name__ == "__main__":
    main()
