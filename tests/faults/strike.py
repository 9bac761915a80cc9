"""Faults while a verb works: signals, full disks, folders that cannot be written, a clock that goes
back; and the verb again."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from faults.verbs import Verb, contents, emptied, half_written
from kemba.folders import LOCK

MAIN = "from kemba_cli.main import main; main()"
# time.time() jumps back by a day at its 20th call, as after a wrong clock was corrected
CLOCK = """\
import itertools, time
real, calls = time.time, itertools.count()
time.time = lambda: real() - 86400.0 * (next(calls) > 20)
"""
FULL = """\
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
"""
# root could write everywhere: without its capabilities it is a user like any other (Linux)
PLAIN_USER = """\
import ctypes, os
if os.geteuid() == 0:
    header, none = (ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)()
    assert ctypes.CDLL(None).capset(header, none) == 0
"""
INTERRUPTED = 130
LONGEST = 600.0  # s of wall time; a busy machine is slow


@dataclass(frozen=True)
class Fault:
    """`signal` after a share `when` of the usual time, no file larger than `size` bytes, a `clock`
    that goes back, a folder that is `shut`: nothing can be written into it."""

    name: str
    signal: int | None = None
    when: float = 0.5
    size: int | None = None
    clock: bool = False
    shut: bool = False

    @property
    def code(self) -> str:
        """The Python that is run."""
        before = (CLOCK if self.clock else "") + (PLAIN_USER if self.shut else "")
        if self.size is not None:
            before += FULL.format(size=self.size)
        return before + MAIN


@dataclass(frozen=True)
class Trace:
    """What a fault left behind: `wrong` lists what must not be."""

    fault: Fault
    exit_code: int
    said: str
    wrong: list[str] = field(default_factory=list)


def run(verb: Verb, folder: Path, code: str = MAIN) -> subprocess.CompletedProcess[str]:
    """The verb, to its end."""
    return subprocess.run(
        [sys.executable, "-c", code, *verb.words],
        cwd=folder, capture_output=True, text=True, timeout=LONGEST,
    )  # fmt: skip


def reference(verb: Verb, folder: Path) -> tuple[dict[str, Any], float]:
    """What the verb writes when nothing happens, and the seconds that it takes."""
    verb.begin(emptied(folder))
    began = time.monotonic()
    done = run(verb, folder)
    assert done.returncode == 0, done.stderr
    return contents(folder / verb.out, verb.results), time.monotonic() - began


def struck(verb: Verb, fault: Fault, folder: Path, usual: dict[str, Any], seconds: float) -> Trace:
    """Run the verb with a fault, look at what it left, run it again, and look again."""
    verb.begin(emptied(folder))
    if fault.shut:
        folder.chmod(0o555)
    code, said = _struck(verb, fault, folder, seconds)
    folder.chmod(0o755)
    wrong = [f"half a file: {text}" for text in half_written(folder)]
    if fault.shut and "cannot be written" not in said:
        wrong.append(f"not told that the folder is shut: exit code {code}: {said[-300:]}")
    if "unexpectedly" in said or "Traceback" in said:
        wrong.append(f"no words: {said[-300:]}")
    out = folder / verb.out
    whole = code == 0
    if whole and contents(out, verb.results) != usual:
        wrong.append("exit code 0, but other results")
    if code == INTERRUPTED and _status(out) == "interrupted":
        pass  # the best plan so far: clearly partial, and continued with --resume
    elif not whole:
        again = run(verb, folder)
        finished = again.returncode == 2 and "holds" in again.stderr  # a run or results
        if again.returncode and not finished:
            wrong.append(f"cannot be run again: {again.stderr[-300:]}")
        elif contents(out, verb.results) != usual:
            wrong.append("other results after it was run again")
    left = [p.name for p in out.glob(".*") if p.name != LOCK] if out.is_dir() else []
    if left and fault.signal not in (signal.SIGKILL, signal.SIGTERM):  # these end it at once
        wrong.append(f"left {left}")
    return Trace(fault, code, said, wrong)


def _status(out: Path) -> str:
    file = out / "manifest.json"
    return str(json.loads(file.read_text())["status"]) if file.is_file() else ""


def _struck(verb: Verb, fault: Fault, folder: Path, seconds: float) -> tuple[int, str]:
    if fault.signal is None:
        done = run(verb, folder, fault.code)
        return done.returncode, done.stderr
    process = subprocess.Popen(
        [sys.executable, "-c", fault.code, *verb.words],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    time.sleep(fault.when * seconds)
    process.send_signal(fault.signal)
    try:
        said = process.communicate(timeout=LONGEST)[1]
    finally:
        if fault.signal == signal.SIGKILL:
            _end_children(process.pid)
    return process.returncode, said


def _end_children(group: int) -> None:
    """A killed verb cannot end its own workers."""
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return
