"""Counts of what was really run against the program, kept in program.json.

Beside them stand the commits of the code that was tried: `code`, by study and part.
"""

import json
import subprocess
import tempfile
from collections.abc import Mapping
from functools import cache
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
        _stamp(whole, study, part)
        _write(whole)


def put(study: str, part: str, facts: Mapping[str, Any]) -> None:
    """Replace what is known about a part of a study."""
    with FileLock(LOCK):
        whole = load()
        whole.setdefault(study, {})[part] = dict(facts)
        _stamp(whole, study, part)
        _write(whole)


def forget(study: str, part: str) -> None:
    """Drop the counts of a part: they were of older code."""
    with FileLock(LOCK):
        whole = load()
        for known in (whole, whole.get("code", {})):
            known.get(study, {}).pop(part, None)
        _write(whole)


def _stamp(whole: dict[str, dict[str, Any]], study: str, part: str) -> None:
    """Add the commit of today's code to those of a part."""
    commits = whole.setdefault("code", {}).setdefault(study, {}).setdefault(part, [])
    if (commit := _commit()) and commit not in commits:
        commits.append(commit)


@cache
def _commit() -> str | None:
    """Of the working tree; None where there is no git."""
    asked = ["git", "-C", str(FILE.parent), "rev-parse", "--short=10", "HEAD"]
    try:
        done = subprocess.run(asked, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()


def _write(whole: dict[str, dict[str, Any]]) -> None:
    FILE.write_text(json.dumps(whole, indent=1, sort_keys=True) + "\n", encoding="utf-8")
