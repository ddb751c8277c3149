"""Worker processes of a sweep: those of a Dask cluster, or of this machine."""

from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from importlib import import_module
from itertools import islice
from os import cpu_count
from pathlib import Path
from shutil import rmtree
from typing import Any, Final, TypeAlias

from chipglow.io.parent import end_with_parent
from chipglow.text import needs_extra

Client: TypeAlias = Any
"""A `distributed.Client`."""

_THREADS: Final = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"), "1")
_TASKS_PER_WORKER: Final = 4
"""Tasks that are submitted at a time, so that memory does not grow with the number of points."""

_ALLOWED_FAILURES: Final = 10
"""Number of workers that may die with a task before the task fails."""

_SILENCE: Final = 60.0
"""Time in s without a finished task after which the cluster is asked for its workers."""


def connected(scheduler: str) -> Client:
    """Return a client of the cluster with this scheduler, such as ``tcp://node1:8786``."""
    return _distributed().Client(scheduler)


def dask_setup(worker: Any) -> None:
    """Let a worker of this machine end with the sweep; Dask calls it when the worker starts."""
    end_with_parent()


@contextmanager
def local_client(
    client: Client | None, workers: int | None, most: int, scratch: Path
) -> Iterator[Client | None]:
    """Yield the client, or one of new processes of this machine; None for this process.

    The new processes, of which there are up to `most`, keep their files in the folder `scratch`. It
    is removed when they end, and before they start if a killed sweep left it.
    """
    if client is not None or workers == 0 or most == 0:
        yield client
        return
    distributed = _distributed()
    dask: Any = import_module("dask")
    count = min(workers or cpu_count() or 1, most)
    options = {
        "distributed.scheduler.allowed-failures": _ALLOWED_FAILURES,
        "temporary-directory": str(scratch),
    }
    with ExitStack() as stack:
        rmtree(scratch, ignore_errors=True)
        stack.callback(rmtree, scratch, ignore_errors=True)
        stack.enter_context(dask.config.set(options))
        try:
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    env=_THREADS,
                    dashboard_address=":0",  # any free port
                    silence_logs="ERROR",
                    preload=[__name__],
                )
            )
            own = stack.enter_context(distributed.Client(cluster))
        except (RuntimeError, OSError) as error:
            raise ConnectionError(
                f"the worker processes did not start ({error}); the computed points are kept, run "
                "the sweep again to continue"
            ) from None
        yield own


def on_client(
    client: Client | None, function: Callable[..., None], every: Sequence[tuple[Any, ...]]
) -> Iterator[None]:
    """Call a function with each of many arguments; yield after each call that is finished."""
    if client is None:
        for arguments in every:
            function(*arguments)
            yield
        return
    waiting = iter(every)

    def submit(count: int) -> list[Any]:
        return [
            client.submit(_with_one_thread, function, *arguments, pure=False)
            for arguments in islice(waiting, count)
        ]

    running = set(submit(_TASKS_PER_WORKER * max(len(client.ncores()), 1)))
    while running:
        for future in _finished(client, running):
            # Not `result`, which would fetch it and repeat the task if its worker died meanwhile.
            if future.status == "error":
                raise future.exception()
            running.remove(future)
            future.release()
            running.update(submit(1))
            yield


def _finished(client: Client, running: Collection[Any]) -> Collection[Any]:
    """Return the tasks that are finished, one or more; wait while the cluster has workers."""
    while True:
        try:
            return set(_distributed().wait(list(running), _SILENCE, "FIRST_COMPLETED").done)
        except CancelledError:
            raise _lost("the scheduler of the cluster") from None
        except TimeoutError:
            if not client.ncores():
                raise _lost("every worker of the cluster") from None


def _lost(what: str) -> ConnectionError:
    return ConnectionError(
        f"{what} is lost; the computed points are kept, run the sweep again to continue"
    )


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError:
        needed = needs_extra("a sweep on several processes", "Dask", "sweep")
        raise ValueError(f"{needed}, or set the number of workers to 0") from None


def _with_one_thread(function: Callable[..., None], *arguments: Any) -> None:
    from numba import set_num_threads

    set_num_threads(1)
    function(*arguments)
