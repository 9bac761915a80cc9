"""Running cases on Dask: every result is kept at once, nothing is done twice."""

import logging
import os
import platform
import re
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from kemba.effects import BY_KIND
from kemba.errors import KembaError
from kemba.files import write_json
from kemba.sweep.cases import Case, Record, perform

# Instead of Dask's own, with which workers give memory back at once; a solver asks for it again at
# once, which costs a fifth of the time.
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": 1}

Tell = Callable[[Case, Record], None]


REACHING = 5.0  # s; for a connection to a scheduler (slow networks take a second)
CLOSING = 3.0  # s that workers in the middle of a case take to end
RESULT = 30.0  # s; for a result that a worker holds


def run_cases(
    cases: Sequence[Case],
    folder: Path,
    scheduler: str | None = None,
    jobs: int | None = None,
    time_limit: float | None = None,
    tell: Tell = lambda case, record: None,
) -> dict[str, Record]:
    """Run those of the `cases` that have no result in `folder`, `jobs` at the same time; `tell` is
    called after each. Returns records by key.

    Cases that `time_limit` [s] cut off are missing from the answer. A case whose workers die
    repeatedly is an error in the answer, but not in the folder, so the next run tries it again.
    Raises KembaError when the `scheduler` cannot be reached.
    """
    due = time.monotonic() + (np.inf if time_limit is None else time_limit)
    (folder / "cases").mkdir(parents=True, exist_ok=True)
    found: dict[str, Record] = {}
    waiting: dict[str, Case] = {}
    for case in cases:
        record = case.record(folder)
        if record is None:
            waiting.setdefault(case.key, case)
        else:
            found[case.key] = record
    if waiting:
        with _client(scheduler, jobs, len(waiting)) as client:
            found |= _gather(client, waiting, folder, due, tell)
    return found


def _gather(
    client: Any, waiting: dict[str, Case], folder: Path, due: float, tell: Tell
) -> dict[str, Record]:
    from distributed import TimeoutError as TimeIsUp
    from distributed import as_completed

    found: dict[str, Record] = {}
    tasks = {
        client.submit(
            perform, case.function, dict(case.work), str(case.path(folder).absolute()),
            BY_KIND.files, key=f"kemba-{case.key}", pure=False,
        ): case
        for case in waiting.values()
    }  # fmt: skip
    left = max(0.1, due - CLOSING - time.monotonic()) if np.isfinite(due) else None
    ended = as_completed(tasks, loop=client.loop, timeout=left)
    try:
        for task in ended:
            case = tasks[task]
            record = case.record(folder) or _record(task)
            if record is None:  # its result was lost with its worker
                ended.add(task)
                continue
            if record["status"] != "lost" and case.record(folder) is None:
                write_json(case.path(folder), record)  # the worker does not see our files
            found[case.key] = record
            tell(case, record)
            task.release()
    except TimeIsUp:
        client.cancel(list(tasks), force=True)
    return found


def _record(task: Any) -> Record | None:
    """The result of a task: `lost` when its workers died, None when it is run again."""
    from distributed import TimeoutError as TimeIsUp

    try:
        if task.status == "finished":
            return dict(task.result(timeout=RESULT))
        if task.status == "error":
            error = task.exception(timeout=RESULT)
            sentence = f"its worker died, again and again ({type(error).__name__})"
            if isinstance(error, KembaError):  # it could not begin
                sentence = str(error)
            return {"status": "lost", "good": False, "sentence": sentence}
    except TimeIsUp:
        pass
    return None


ADDRESS = re.compile(r"(?:(?:tcp|tls)://)?(?P<host>\[[^\]]+\]|[^:/\[\]]+):(?P<port>\d{1,5})")


def check_scheduler(scheduler: str) -> None:
    """Raise KembaError when nothing answers at the address; Dask itself would try for 40 s."""
    match = ADDRESS.fullmatch(scheduler)
    if match is None:
        what = "is no address of a scheduler"
        raise KembaError(f"--scheduler {scheduler}", what, "such as tcp://host:8786")
    try:
        place = (match["host"].strip("[]"), int(match["port"]))
        socket.create_connection(place, timeout=REACHING).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise _unreachable(scheduler, error) from None


def _unreachable(scheduler: str, error: Exception) -> KembaError:
    what = f"cannot be reached: {error}".splitlines()[0]
    hint = "start one with: dask scheduler"
    return KembaError(f"--scheduler {scheduler}", what, "such as tcp://host:8786", hint)


@contextmanager
def _client(scheduler: str | None, jobs: int | None, most: int) -> Iterator[Any]:
    """A client of the cluster asked for, or of a local one that ends with the block.

    Our own workers are given one case at a time, so that a case that kills its worker does
    not affect others.
    """
    import dask
    from distributed import Client, LocalCluster

    count = min(jobs or os.cpu_count() or 1, most)
    if scheduler is not None:
        check_scheduler(scheduler)
        try:
            client = Client(scheduler, timeout=10, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise _unreachable(scheduler, error) from None
        with client:
            yield client
        return
    with (
        dask.config.set(
            {
                "distributed.scheduler.worker-saturation": 1.0,
                "distributed.nanny.pre-spawn-environ": ENVIRONMENT,
            }
        ),
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # any free port
            silence_logs=logging.CRITICAL,
            preload=["kemba.sweep.preload"],
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        # a worker that could not be started again, as on a machine short of time, is replaced
        cluster.adapt(minimum=count, maximum=count)
        yield client


def machine() -> str:
    """Processor, number of cores and system: `AMD EPYC 7B13, 2 cores, Linux 6.1`."""
    system = f"{platform.system()} {platform.release().partition('-')[0]}"
    return f"{_processor()}, {os.cpu_count()} cores, {system}"


def _processor() -> str:
    listed = Path("/proc/cpuinfo")
    if listed.is_file():
        for line in listed.read_text(encoding="utf-8").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()
