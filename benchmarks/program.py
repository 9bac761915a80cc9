"""Counts of what was really run against the program, kept in program.json."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from filelock import FileLock

FILE = Path(__file__).with_suffix(".json")
LOCK = Path(tempfile.gettempdir()) / "kemba-program.lock"


def load() -> dict[str, dict[str, Any]]:
    """All counts: study -> part -> key -> number."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else {}


def add(study: str, part: str, count: Mapping[str, int]) -> None:
    """Add counts to those of earlier runs; a largest value (`slowest...`) is not summed."""
    with FileLock(LOCK):
        whole = load()
        kept = whole.setdefault(study, {}).setdefault(part, {})
        for key, number in count.items():
            slow = key.startswith("slowest")
            kept[key] = max(kept.get(key, 0), number) if slow else kept.get(key, 0) + number
        _write(whole)


def put(study: str, part: str, facts: Mapping[str, Any]) -> None:
    """Replace what is known about a part of a study."""
    with FileLock(LOCK):
        whole = load()
        whole.setdefault(study, {})[part] = dict(facts)
        _write(whole)


def _write(whole: dict[str, dict[str, Any]]) -> None:
    FILE.write_text(json.dumps(whole, indent=1, sort_keys=True) + "\n", encoding="utf-8")
