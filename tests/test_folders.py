"""Results are kept: one writer at a time, nothing overwritten, and full disks told in words."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from kemba.errors import KembaError
from kemba.files import DiskFull, WriteError, atomic_path, atomic_text
from kemba.folders import LOCK, UNFINISHED, claimed, fresh, held, next_free, try_writing, typed
from kemba.runs import RunFolder

AS_ROOT = os.name == "posix" and os.geteuid() == 0


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def elsewhere(code: str) -> subprocess.CompletedProcess[str]:
    """Python in another process."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)


TAKE = "from kemba.runs import RunFolder; RunFolder.create('out', 'jump')"


def test_two_cannot_fill_one_run_folder() -> None:
    first = RunFolder.create("out", "jump")
    second = elsewhere(TAKE)
    assert "out: another kemba-opt is writing to this folder; wait until" in second.stderr
    first.finish("solved")
    assert "holds a finished run already" in elsewhere(TAKE).stderr


def test_what_died_lets_its_folder_go() -> None:
    code = "import os, signal;" + TAKE.replace("RunFolder.create", "r = RunFolder.create")
    killed = elsewhere(code + "; os.kill(os.getpid(), signal.SIGKILL)")
    assert killed.returncode == -9 and (Path("out") / "manifest.json").is_file()
    RunFolder.create("out", "jump").finish("solved")


def test_numbered_runs_do_not_meet() -> None:
    first, second = RunFolder.create(None, "jump"), RunFolder.create(None, "jump")
    assert first.path != second.path


def test_a_finished_answer_is_kept() -> None:
    with claimed("answer", "answer", "*.json") as folder:
        (folder / "answer.json").write_text("1")
    message = r"^answer: holds results already \(answer.json\); give another name, or --force"
    with pytest.raises(KembaError, match=message), claimed("answer", "answer", "*.json"):
        pass
    with claimed("answer", "answer", "*.json", force=True) as folder:
        assert (folder / "answer.json").read_text() == "1"  # until there is a new one


def test_default_folders_are_numbered() -> None:
    for name in ("answer", "answer-2", "answer-3"):
        with claimed(None, "answer", "*.json") as folder:
            assert folder == Path(name)
            (folder / "answer.json").touch()


def test_a_failure_leaves_no_empty_folder() -> None:
    with pytest.raises(ZeroDivisionError), claimed(None, "answer", "*.json"):
        raise ZeroDivisionError
    assert not Path("answer").exists()


def test_an_unfinished_answer_is_marked_and_written_again() -> None:
    def begin(force: bool = False) -> None:
        with claimed("answer", "answer", "*.json", force) as folder:
            (folder / "a.json").touch()
            raise ZeroDivisionError

    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            begin()
        assert (Path("answer") / UNFINISHED).read_text().startswith("kemba-opt writes here, or was")
    with pytest.raises(ZeroDivisionError), claimed("answer", "answer", "*.json"):
        raise ZeroDivisionError  # before anything was written: it is as unfinished as it was
    assert (Path("answer") / UNFINISHED).exists()
    with claimed("answer", "answer", "*.json"):
        pass
    assert not (Path("answer") / UNFINISHED).exists()
    with pytest.raises(ZeroDivisionError), claimed("answer", "answer", "*.json", force=True):
        raise ZeroDivisionError  # before anything was written: what is there is still whole
    assert not (Path("answer") / UNFINISHED).exists()
    with pytest.raises(KembaError), claimed("answer", "answer", "*.json"):
        pass


def test_two_cannot_write_one_answer() -> None:
    code = "from kemba.folders import held\nfrom pathlib import Path\nwith held(Path('logs')): pass"
    with held(Path("logs")):
        assert "another kemba-opt is writing to this folder" in elsewhere(code).stderr
    assert elsewhere(code).returncode == 0
    assert not (Path("logs") / LOCK).exists()


def test_files_are_kept() -> None:
    Path("a.png").touch()
    with pytest.raises(KembaError, match=r"--save a\.png: exists already; give another name, or"):
        fresh("a.png", option="--save")
    assert fresh("a.png", force=True) == Path("a.png")
    assert next_free(Path("a.png")) == Path("a-2.png")
    assert next_free(Path("b.png")) == Path("b.png")
    with pytest.raises(KembaError, match=r"^\.: is a folder"):
        fresh(".", force=True)


@pytest.mark.skipif(AS_ROOT, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_told_first() -> None:
    Path("shut").mkdir(mode=0o500)
    with pytest.raises(WriteError, match="shut: cannot be written: Permission denied; give a"):
        try_writing("shut")
    with pytest.raises(WriteError):
        RunFolder.create("shut/run", "jump")


def test_a_file_in_the_way_is_told() -> None:
    Path("file").touch()
    with pytest.raises(WriteError, match="file/out: cannot be written: Not a directory"):
        try_writing("file/out")
    with pytest.raises(WriteError), atomic_text("file/out/x.txt") as stream:
        stream.write("1")


def full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_is_told_and_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("x.txt").write_text("old")
    told = r"x\.txt: cannot be written: No space left on device; free"
    with pytest.raises(DiskFull, match=told), atomic_text("x.txt") as stream:
        stream.write("new")
        full()
    assert Path("x.txt").read_text() == "old"
    with pytest.raises(DiskFull), atomic_path("y.bin") as path:
        path.write_bytes(b"1")
        full()
    assert sorted(path.name for path in Path().iterdir()) == ["x.txt"]
    monkeypatch.setattr("tempfile.TemporaryFile", full)
    with pytest.raises(DiskFull, match="out: cannot be written: No space left"):
        RunFolder.create("out", "jump")


def test_logs_are_named_as_they_are_typed() -> None:
    assert typed(["a b.csv", Path("c.csv")]) == "'a b.csv' c.csv"
    assert typed(["a.csv"], "map.yaml", "mine.yaml") == "a.csv --map map.yaml --model mine.yaml"
    many = [Path(f"logs/log-{number}.csv") for number in range(6)]
    many[0].parent.mkdir()
    for log in many:
        log.touch()
    assert typed(many, "m.yaml") == "logs/*.csv --map m.yaml"
    assert typed([*many, "a.csv"]) == "logs/*.csv a.csv"


def test_no_pattern_takes_in_logs_of_other_machines() -> None:
    many = [f"log-{number}.csv" for number in range(6)]
    for log in [*many, "of_another_machine.csv"]:
        Path(log).touch()
    assert typed(many) == " ".join(many)
