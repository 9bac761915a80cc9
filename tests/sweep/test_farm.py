"""Cases on a local cluster: kept at once, none lost, none repeated, whoever is killed."""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from sweep.fakes import cases

from kemba.effects import BY_KIND
from kemba.files import read_json
from kemba.sweep import Case, run_cases

TESTS = Path(__file__).parent.parent

# dask's own clean-up, none of it ours: sockets and event loops of a cluster that was just closed
# are collected with a warning, and workers that were killed are missed by their nannies
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(autouse=True)
def workers_find_the_fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    known = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(TESTS), known])))


def traces(folder: Path) -> Counter[int]:
    """How often each case has ended."""
    return Counter(int(p.name.partition("-")[0]) for p in (folder / "traces").iterdir())


def finished(folder: Path) -> set[str]:
    return {path.stem for path in (folder / "cases").glob("*.json")}


def start(folder: Path, count: int, seconds: float, jobs: int = 2) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "sweep.fakes", str(folder)]
    return subprocess.Popen([*command, str(count), str(seconds), str(jobs)])


def wait_for(folder: Path, count: int, client: subprocess.Popen[bytes]) -> None:
    """Until so many results are there."""
    deadline = time.monotonic() + 60
    while len(finished(folder)) < count:
        assert client.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)


def children(pid: int) -> list[int]:
    """Dask's worker processes below a client."""
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    spawned = [p for p in listed if b"spawn_main" in Path(f"/proc/{p}/cmdline").read_bytes()]
    return [int(p) for p in spawned]


def gone(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat")
    return not status.exists() or status.read_text().rpartition(")")[2].split()[0] == "Z"


def check_all_done(folder: Path, listed: list[Case], before: set[str]) -> None:
    """Resume: nothing finished before is done again, nothing is missing."""
    counts = traces(folder)
    done_again: list[str] = []
    records = run_cases(listed, folder, jobs=2, tell=lambda case, _: done_again.append(case.key))
    assert not before & set(done_again)
    assert sorted(done_again) == sorted({case.key for case in listed} - before)
    assert [records[case.key]["square"] for case in listed] == [i**2 for i in range(len(listed))]
    after = traces(folder)
    for case in listed:
        if case.key in before:
            assert after[case.index] == counts[case.index]


def test_results_are_kept_and_never_done_twice(tmp_path: Path) -> None:
    listed = cases(tmp_path, 6, 0.0)
    first = run_cases([*listed, *listed], tmp_path, jobs=2)
    assert traces(tmp_path) == Counter(range(6))
    told: list[Case] = []
    assert run_cases(listed, tmp_path, jobs=2, tell=lambda case, _: told.append(case)) == first
    assert not told and traces(tmp_path) == Counter(range(6))


def test_a_crash_is_an_outcome(tmp_path: Path) -> None:
    (case,) = cases(tmp_path, 1, 0.0, "crash")
    record = run_cases([case], tmp_path, jobs=1)[case.key]
    assert (record["status"], record["good"]) == ("error", False)
    assert record["sentence"] == "ZeroDivisionError: case 0 divides by zero"
    assert read_json(case.path(tmp_path)) == record


def test_the_time_limit_keeps_what_is_done(tmp_path: Path) -> None:
    listed = [*cases(tmp_path, 1, 0.0), *cases(tmp_path, 2, 60.0)]
    started = time.monotonic()
    records = run_cases(listed, tmp_path, jobs=1, time_limit=9.0)
    assert time.monotonic() - started < 40
    assert set(records) == {listed[0].key} == finished(tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="reads /proc to find the processes")
@pytest.mark.parametrize("seed", [1, 2])
def test_killing_the_client_loses_and_repeats_nothing(tmp_path: Path, seed: int) -> None:
    moment = random.Random(seed)
    listed = cases(tmp_path, 12, 0.3)
    client = start(tmp_path, 12, 0.3)
    wait_for(tmp_path, 2, client)
    time.sleep(moment.uniform(0.0, 0.6))
    workers = children(client.pid)
    client.send_signal(signal.SIGKILL)
    client.wait()
    deadline = time.monotonic() + 20
    while not all(gone(pid) for pid in workers):  # they notice and end
        assert time.monotonic() < deadline
        time.sleep(0.05)
    before = finished(tmp_path)
    assert 2 <= len(before) < 12
    check_all_done(tmp_path, listed, before)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="reads /proc to find the processes")
@pytest.mark.parametrize("seed", [3, 4])
def test_killing_workers_loses_and_repeats_nothing(tmp_path: Path, seed: int) -> None:
    moment = random.Random(seed)
    listed = cases(tmp_path, 10, 0.3)
    client = start(tmp_path, 10, 0.3)
    wait_for(tmp_path, 1, client)
    for _ in range(2):
        time.sleep(moment.uniform(0.1, 0.5))
        for worker in children(client.pid):
            os.kill(worker, signal.SIGKILL)
    before = finished(tmp_path)
    assert client.wait(timeout=90) == 0  # the same client finishes on new workers
    assert before <= finished(tmp_path) == {case.key for case in listed}
    assert all(traces(tmp_path)[case.index] == 1 for case in listed if case.key in before)
    check_all_done(tmp_path, listed, finished(tmp_path))


def test_a_case_that_kills_its_workers_does_not_end_the_sweep(tmp_path: Path) -> None:
    bad, good = cases(tmp_path, 1, 0.0, "kill_own_worker"), cases(tmp_path, 3, 0.0)
    records = run_cases([good[0], *bad, *good[1:]], tmp_path, jobs=1)
    assert all(traces(tmp_path)[number] == 1 for number in range(3))
    assert records[bad[0].key]["status"] == "lost"
    assert "worker died" in records[bad[0].key]["sentence"]
    assert finished(tmp_path) == {case.key for case in good}


def test_workers_know_effects_from_outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("_kinds", "_files"):
        monkeypatch.setattr(BY_KIND, name, dict(getattr(BY_KIND, name)))
    own = tmp_path / "own.py"
    own.write_text(
        "from typing import Literal\nfrom kemba.effects import Effect\n"
        'class Sticky(Effect):\n    kind: Literal["sticky"] = "sticky"\n'
    )
    BY_KIND.load_file(own)
    listed = cases(tmp_path, 2, 0.0, "knows_effect")
    records = run_cases(listed, tmp_path / "a", jobs=1)
    assert all(record["good"] for record in records.values())
    own.write_text(own.read_text() + "# changed since\n")
    records = run_cases(listed, tmp_path / "b", jobs=1)
    assert {record["status"] for record in records.values()} == {"lost"}
    told = {record["sentence"] for record in records.values()}
    assert told == {f"{own}: has another content than where this work was asked for"}
    assert not list((tmp_path / "b" / "cases").iterdir())
