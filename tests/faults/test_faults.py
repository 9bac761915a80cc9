"""After a fault results are whole, or clearly partial and completed by the same command."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from faults.strike import MAIN, Fault, reference, run, struck
from faults.verbs import VERBS, emptied

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")

QUICK = {
    "solve": [Fault("killed", signal.SIGKILL, 0.8), Fault("disk full", size=2000)],
    "simulate": [Fault("ended", signal.SIGTERM, 0.8), Fault("shut", shut=True)],
}
MOMENTS = (0.2, 0.5, 0.7, 0.85, 0.95)
SIGNALS = {"killed": signal.SIGKILL, "ended": signal.SIGTERM, "interrupted": signal.SIGINT}
MANY = [
    *(Fault(f"{name} {m}", number, m) for name, number in SIGNALS.items() for m in MOMENTS),
    *(Fault(f"disk full {size}", size=size) for size in (0, 200, 5000, 50_000)),
    Fault("clock back", clock=True),
    Fault("shut", shut=True),
]
FEW = [*MANY[2::5], *MANY[-3:]]  # of a verb that takes a minute


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[dict[str, Any], float]]:
    """Results and time of each verb without a fault, found when first needed."""
    known: dict[str, tuple[dict[str, Any], float]] = {}

    class Found(dict[str, tuple[dict[str, Any], float]]):
        def __missing__(self, name: str) -> tuple[dict[str, Any], float]:
            self[name] = reference(VERBS[name], tmp_path_factory.mktemp(name))
            return self[name]

    return Found(known)


@pytest.mark.parametrize(
    ("name", "fault"), [(n, f) for n, faults in QUICK.items() for f in faults], ids=str
)
def test_a_fault_loses_nothing(name: str, fault: Fault, usual: Any, tmp_path: Path) -> None:
    assert struck(VERBS[name], fault, tmp_path / "work", *usual[name]).wrong == []


@pytest.mark.nightly
@pytest.mark.parametrize("name", VERBS)
def test_many_faults_lose_nothing(name: str, usual: Any, tmp_path: Path) -> None:
    for fault in FEW if name == "learn" else MANY:
        found = struck(VERBS[name], fault, tmp_path / "work", *usual[name])
        assert found.wrong == [], f"{name}, {fault.name}: {found}"


@pytest.mark.nightly
@pytest.mark.parametrize("name", VERBS)
def test_of_two_at_a_time_one_is_refused(name: str, usual: Any, tmp_path: Path) -> None:
    verb, folder = VERBS[name], tmp_path / "work"
    verb.begin(emptied(folder))
    both = [
        subprocess.Popen(
            [sys.executable, "-c", MAIN, *verb.words], cwd=folder, stderr=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    said = [process.communicate()[1] for process in both]
    assert sorted(process.returncode for process in both) == [0, 2]
    refused = said[[process.returncode for process in both].index(2)]
    assert "another kemba-opt is writing" in refused or "holds" in refused


def test_the_comparison_sees_a_lost_file(usual: Any, tmp_path: Path) -> None:
    """Else the tests above could not fail."""
    results, seconds = usual["simulate"]
    wanted = {**results, "one-more.csv": b""}
    found = struck(VERBS["simulate"], Fault("nothing"), tmp_path / "work", wanted, seconds)
    assert found.exit_code == 0 and found.wrong == ["exit code 0, but other results"]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder with a file system of 100 kB; skipped where nothing may be mounted."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting a small disk needs the rights of an administrator")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_small_disk_is_told_before_the_work(small_disk: Path) -> None:
    VERBS["solve"].begin(small_disk)
    done = run(VERBS["solve"], small_disk)
    assert done.returncode == 1
    assert "No space left on device; free some space" in done.stderr
    assert not any((small_disk / "out").glob("*"))


@pytest.mark.nightly
def test_a_user_without_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOME", raising=False)
    VERBS["solve"].begin(emptied(tmp_path / "work"))
    assert run(VERBS["solve"], tmp_path / "work").returncode == 0
