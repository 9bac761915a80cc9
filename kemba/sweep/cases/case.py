"""A case: one piece of work of a sweep, identified by the hash of its content."""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

from kemba.effects import load_effects
from kemba.errors import KembaError
from kemba.files import plain, read_json, write_json
from kemba.stopwatch import Stopwatch

Record = dict[str, Any]
Work = Mapping[str, Any]


def content_hash(data: Any) -> str:
    """A short hash of plain data, whatever the order of its keys."""
    text = json.dumps(plain(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:20]


@dataclass(frozen=True)
class Case:
    """Work for `function` (`module:name`), whose `problem` says what is solved.

    `values` are what varies, as the sweep's table shows it. Cases with equal content have equal
    keys, and their work is done once.
    """

    block: str
    index: int
    values: Mapping[str, Any]
    function: str
    work: Work = field(repr=False)
    problem: str = ""

    @cached_property
    def key(self) -> str:
        """Hash of the function and its work: equal cases have equal keys, and are computed once."""
        return content_hash([self.function, self.work])

    def path(self, folder: Path) -> Path:
        """Where its result is kept."""
        return folder / "cases" / f"{self.key}.json"

    def record(self, folder: Path) -> Record | None:
        """Its result, None while there is none, or none that can be used."""
        return read_record(self.path(folder))


NUMBERS = (
    "apex_m", "apex_error_m", "touchdown_error_s", "final_error_m", "pitch_rad", "duration_s",
    "solve_s", "solve_cpu_s", "build_s", "wall_s", "cpu_s", "iterations", "variables",
)  # fmt: skip


def read_record(path: Path) -> Record | None:
    """The result in a case's file; None when there is none, or it is damaged and must be redone."""
    try:
        record = read_json(path) if path.is_file() else None
    except KembaError:
        return None
    return record if _is_record(record) else None


def _is_record(record: Any) -> bool:
    """Whether it holds what the table and the summary read, each of its type."""
    if not isinstance(record, dict) or not isinstance(record.get("good"), bool):
        return False
    cost = record.get("cost") or {}
    numbers = [record.get(name) for name in NUMBERS]
    numbers.append(cost.get("torque_squared_integral") if isinstance(cost, dict) else cost)
    return (
        all(isinstance(record.get(name), str) for name in ("status", "sentence"))
        and all(n is None or (isinstance(n, (int, float)) and math.isfinite(n)) for n in numbers)
        and not any(isinstance(n, bool) for n in numbers)
    )


def perform(
    function: str, work: Work, path: str, effects: Mapping[str, str] | None = None
) -> Record:
    """Do a case's work and keep its result at `path`, at once and completely. Runs in a worker.

    An error in it is a result too. Where the folder of `path` is not visible, the record is
    only returned. Work that another worker has already done is not repeated. `effects`: files of
    effects from outside, by path, with the hash of their content.
    Raises KembaError when these cannot be loaded.
    """
    load_effects(effects or {})
    if (known := read_record(Path(path))) is not None:
        return known
    working = Stopwatch()
    try:
        with working.running():
            result = resolve(function)(work)
    except Exception as error:
        result = {"status": "error", "good": False, "sentence": f"{type(error).__name__}: {error}"}
    record = {
        **result,
        "wall_s": working.wall,
        "cpu_s": working.cpu,
        "finished": time.time(),
    }
    if Path(path).parent.is_dir():
        write_json(path, record)
    return record


def resolve(function: str) -> Callable[[Work], Record]:
    """The function called `module:name`."""
    module, name = function.split(":")
    found: Callable[[Work], Record] = getattr(import_module(module), name)
    return found
