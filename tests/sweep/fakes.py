"""Cheap case functions, and a client to kill: `python -m sweep.fakes FOLDER COUNT SECONDS JOBS`."""

import os
import signal
import sys
import time
import uuid
from pathlib import Path
from typing import Any

from kemba.sweep import Case, run_cases


def slow_square(work: dict[str, Any]) -> dict[str, Any]:
    """Leaves a trace for every time it ends, then answers."""
    time.sleep(work["seconds"])
    (Path(work["traces"]) / f"{work['number']}-{uuid.uuid4().hex}").touch()
    return {"status": "solved", "good": True, "sentence": "solved", "square": work["number"] ** 2}


def crash(work: dict[str, Any]) -> dict[str, Any]:
    raise ZeroDivisionError(f"case {work['number']} divides by zero")


def knows_effect(work: dict[str, Any]) -> dict[str, Any]:
    """Whether this worker knows an effect from outside the package."""
    from kemba.effects import BY_KIND

    known = "sticky" in BY_KIND
    return {"status": "solved" if known else "failed", "good": known, "sentence": ""}


def kill_own_worker(work: dict[str, Any]) -> dict[str, Any]:
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def cases(folder: Path, count: int, seconds: float, function: str = "slow_square") -> list[Case]:
    """`count` fake cases that leave their traces in `folder`."""
    (folder / "traces").mkdir(parents=True, exist_ok=True)
    shared = {"seconds": seconds, "traces": str(folder / "traces")}
    return [
        Case("fake", i, {"number": i}, f"sweep.fakes:{function}", {**shared, "number": i})
        for i in range(count)
    ]


if __name__ == "__main__":
    place = Path(sys.argv[1])
    listed = cases(place, int(sys.argv[2]), float(sys.argv[3]))
    run_cases(listed, place, jobs=int(sys.argv[4]))
