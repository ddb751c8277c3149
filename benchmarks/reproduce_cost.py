"""Cost of the paper's study, or of any: time and peak memory of the whole command, nothing cached.

    python benchmarks/reproduce_cost.py [quick] [full] [STUDY.yaml]

The first run in a fresh environment compiles the kernels; the time of that is part of it.
"""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

COMMANDS = {"quick": ["reproduce", "--quick"], "full": ["reproduce"]}
LIMITS = {"quick": 90.0, "full": 600.0}
MEMORY_LIMIT = 4.0


def cost(what: str) -> tuple[float, float]:
    """Seconds and peak memory in GB of one run."""
    arguments = COMMANDS.get(what, ["run", what])
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "CHIPGLOW_CACHE": str(Path(folder, "cache"))}
        command = [sys.executable, "-c", "from chipglow.cli import main; main()", *arguments]
        start = perf_counter()
        subprocess.run(
            [*command, "--out", str(Path(folder, "run"))],
            env=environment,
            stdout=subprocess.DEVNULL,
            check=True,
        )
        seconds = perf_counter() - start
    return seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6


def main() -> None:
    """Run what is asked for and print the table."""
    chosen = sys.argv[1:] or list(LIMITS)
    print(f"{os.cpu_count()} processors")
    print(f"{'study':10} {'time / s':>9} {'limit / s':>10} {'peak / GB':>10} {'limit / GB':>11}")
    for what in chosen:
        seconds, memory = cost(what)
        limit = f"{LIMITS[what]:.0f}" if what in LIMITS else "–"
        name = Path(what).stem
        print(f"{name:10} {seconds:9.0f} {limit:>10} {memory:10.2f} {MEMORY_LIMIT:11.1f}")


if __name__ == "__main__":
    main()
