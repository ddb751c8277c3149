"""Sweeps on Dask: overhead, two workers against one, and a run with killed processes.

    python benchmarks/sweeps.py [--tasks N] [--points N] [--kills N]

Overhead and efficiency: tasks that sleep 0.2 s, so that other programs on the machine do not count.
Kills: at random times a worker, the scheduler or the client is killed (SIGKILL) and started again.
The files of the points are compared with those of one process, and computations are counted.
"""

import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
from common import arguments, print_head, print_row, print_tables, timed

from chipglow.io import write_scene
from chipglow.scene import Raster, Scene
from chipglow.study import Study, sweep, sweeps
from chipglow.study.workers import local_client, on_client

DURATION = 0.2
PAUSE = 1.5  # s, mean between two kills


def main():
    given = arguments(__doc__, tasks=100, points=1000, kills=20, client=[""])
    if given.client[0]:
        run_client(*given.client)
        return
    print_head("workers", "time / s", "ideal / s", "overhead / %")
    with tempfile.TemporaryDirectory() as folder:
        for workers in (1, 2):
            with local_client(None, workers, given.tasks, Path(folder) / "workers") as client:
                run_all(client, workers * 4)
                _, wall, _ = timed(partial(run_all, client, given.tasks))
            ideal = DURATION * given.tasks / workers
            over = f"{100 * (wall / ideal - 1):.1f}"
            print_row(str(workers), f"{wall:.2f}", f"{ideal:.2f}", over)
        kill_at_random(Path(folder), given.points, given.kills)


def run_all(client, count):
    for _ in on_client(client, time.sleep, [(DURATION,)] * count):
        pass


def study_of(folder):
    """Return a study of a small scene, of which a point takes some hundredths of a second."""
    file = folder / "band.nc"
    if not file.exists():
        raster = Raster(left=-40e-6, top=40e-6, spacing=1e-6, rows=80, columns=80)
        times = 1e-6 * np.arange(8)
        moving = [600 + 500 * np.exp(-(((raster.x - 4 * t) / 10e-6) ** 2)) for t in times]
        frames = np.stack([np.broadcast_to(one, raster.shape) for one in moving])
        write_scene(Scene.from_fields(raster, times, {"temperature": frames}), file)
    return Study(
        scene=str(file),
        surface={"kind": "uniform", "emissivity": 0.6},
        camera={"integration_time": "2 us", "lower_limit": None},
        analysis={"exposures": 3, "phases": 1},
    )


def run_client(address, folder, points):
    from distributed import Client

    compute = sweeps.compute_point

    def counted(study, at, path):
        if not path.exists():
            with path.with_suffix(".count").open("a") as file:
                file.write("x")
        compute(study, at, path)

    sweeps.compute_point = counted
    with Client(address, timeout=10) as client:
        swept(Path(folder), int(points), "killed", client=client)


def swept(folder, points, name, **options):
    vary = {"camera.pitch": f"3 um:9 um:{points}"}
    return sweep(study_of(folder), vary, folder / name, **options)


def kill_at_random(folder, points, kills):
    """Print how often points were computed, and whether all files are those of one process."""
    generator = random.Random(1)
    reference, wall, _ = timed(lambda: swept(folder, points, "serial", workers=0))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    address = f"tcp://127.0.0.1:{port}"
    worker = ["-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    commands = {
        "scheduler": ["-m", "distributed.cli.dask_scheduler", "--port", port, "--no-dashboard"],
        "worker 1": worker,
        "worker 2": worker,
        "client": [str(Path(__file__).resolve()), "--client", address, str(folder), str(points)],
    }
    env = {**os.environ, "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet |= {"env": env, "cwd": folder, "start_new_session": True}
    killed = dict.fromkeys(("client", "scheduler", "worker"), 0)
    started, processes = time.perf_counter(), {}
    due = time.perf_counter() + 2 * PAUSE
    while "client" not in processes or processes["client"].poll() != 0:
        for name, command in commands.items():
            if name not in processes or processes[name].poll() is not None:
                processes[name] = subprocess.Popen([sys.executable, *command], **quiet)
        if sum(killed.values()) < kills and time.perf_counter() > due:
            name = generator.choice(list(commands))
            os.killpg(processes[name].pid, signal.SIGKILL)
            processes[name].wait()
            killed[name.partition(" ")[0]] += 1
            due = time.perf_counter() + generator.uniform(0.5, 1.5) * PAUSE
        time.sleep(0.05)
    for process in processes.values():
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    names = [f"{key}.json" for key in reference.keys]
    again, serial = folder / "killed" / "points", folder / "serial" / "points"
    same = sum((again / name).read_bytes() == (serial / name).read_bytes() for name in names)
    counts = [path.stat().st_size for path in again.glob("*.count")]
    heads = "points", "kills", "identical files", "computed again", "time / s", "one process / s"
    stated = ", ".join(f"{count} {name}" for name, count in killed.items())
    seconds = f"{time.perf_counter() - started:.0f}", f"{wall:.0f}"
    row = str(points), stated, str(same), str(sum(counts) - points), *seconds
    print_tables([[heads, row]], markdown=True)


if __name__ == "__main__":
    main()
