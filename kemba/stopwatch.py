"""Time of long work: seconds spent, and the stages that are told to whoever waits."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

Tell = Callable[[str], None]  # gets the name of every stage of long work as it begins


def silent(text: str) -> None:
    """Tells nobody."""


def watched() -> Tell:
    """Tells stages and their times on stderr in notebooks and on terminals, nobody elsewhere."""
    started = time.monotonic()

    def tell(text: str) -> None:
        print(f"{time.monotonic() - started:6.1f} s  {text}", file=sys.stderr, flush=True)

    return tell if "ipykernel" in sys.modules or sys.stderr.isatty() else silent


class Stage(str):
    """The name of a stage that is one of several alike: part `part` of `parts`.

    As text it says so: `refitting valve_delay (2 of 8)`.
    """

    name: str
    part: int
    parts: int

    def __new__(cls, name: str, part: int, parts: int) -> Stage:
        stage = super().__new__(cls, f"{name} ({part} of {parts})")
        stage.name, stage.part, stage.parts = name, part, parts
        return stage


@dataclass
class Stopwatch:
    """Wall and processor time [s] of everything done while it runs; do not nest it."""

    wall: float = 0.0
    cpu: float = 0.0

    @contextmanager
    def running(self) -> Iterator[None]:
        """Counts what is done inside."""
        started, busy = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.wall += time.perf_counter() - started
            self.cpu += time.process_time() - busy
