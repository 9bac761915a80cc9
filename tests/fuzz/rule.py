"""The rule that every input must keep, however broken: an answer in words, and in time.

Exit code 0; or 1 with a reason; or 2 with a message that names the file. Never a crash ("kemba
failed unexpectedly"), never a hang.
"""

import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from typer.testing import CliRunner

from kemba_cli.main import app

LONGEST = {"check": 10.0, "map": 10.0, "compare": 60.0, "discover": 120.0, "solve": 30.0}  # CPU s


class Hang(BaseException):
    """The verb took longer than it may."""


@dataclass(frozen=True)
class Outcome:
    """What a verb did with an input; `broken` says which part of the rule it broke, if any."""

    exit_code: int | None
    said: str
    seconds: float
    broken: str = ""


def outcome(verb: str, file: Path, *options: str) -> Outcome:
    """Run a verb on a file in this process and hold the answer against the rule."""
    began = _cpu()
    try:
        with limited(LONGEST[verb]):
            done = CliRunner().invoke(app, [verb, str(file), *options])
    except Hang:
        return Outcome(None, "", LONGEST[verb], f"hang: more than {LONGEST[verb]:g} CPU s")
    said = done.stderr + done.stdout
    seconds = _cpu() - began
    broken = _broken(done.exit_code, said, done.exception, file)
    if not broken and seconds > LONGEST[verb]:
        broken = f"hang: {seconds:.0f} CPU s, more than {LONGEST[verb]:g}"
    return Outcome(done.exit_code, said, seconds, broken)


def _cpu() -> float:
    """CPU time [s] of this process and of those that it waited for."""
    return sum(os.times()[:4])


def _broken(code: int, said: str, error: BaseException | None, file: Path) -> str:
    if error is not None and not isinstance(error, SystemExit):
        return f"crash: {error!r}"
    if "unexpectedly" in said or "Traceback" in said:
        return f"crash: {said[:300]}"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if code and not said.strip():
        return f"exit code {code} without a word"
    if code == 2 and file.name.split(".")[0] not in said:
        return f"no place: {said[:300]}"
    return ""


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise Hang in the block after so many seconds of CPU time."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGPROF"):
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
