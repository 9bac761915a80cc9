# ruff: noqa: E402  (benchmarks are no package)
"""Bugs at random: what is changed, what is left out, and that equivalent ones are survivors."""

import json
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))

from mutations import Places

from kemba.config import load_yaml


def changed(line: str, alike: dict[str, list[str]] | None = None) -> list[str]:
    """The line after each of its changes."""
    found = Places(line, alike or {}).found
    return [
        (line.encode()[:first] + new.encode() + line.encode()[last:]).decode()
        for _, first, last, new, _ in found
    ]


def test_a_line_is_changed_in_the_usual_ways() -> None:
    assert changed("ω = a <= b") == ["ω = a < b"]
    assert changed("y = (a + b) * c") == ["y = (a + b) / c", "y = (a - b) * c"]
    assert changed("y = a and not b") == ["y = a or not b", "y = a and (b)"]
    assert changed("y = a if a is not b else c") == [
        "y = a if False else c",
        "y = a if a is b else c",
    ]
    assert changed("y = x[0]") == ["y = x[-1]", "y = x[1]"]
    assert changed("y = np.min(x, axis=k)") == ["y = np.max(x, axis=k)", "y = np.min(x)"]
    assert changed("f(k=a, m=b)") == ["f(m=b)", "f(k=a)"]
    assert changed("f(a, b, c)", {"f": ["int", "float", "float"]}) == ["f(a, c, b)"]


def test_texts_and_annotations_are_left_out() -> None:
    for line in (
        "x: Literal[1]",
        "raise ValueError(1 + 2)",
        "assert a < b",
        "y = f'{a + b}'",
        "def __repr__(self): return 1",
        "y = Field(description=a)",
    ):
        assert changed(line) == []


def test_equivalent_bugs_are_survivors_of_the_list() -> None:
    lines = (ROOT / "benchmarks" / "random_mutants.jsonl").read_text("utf-8").splitlines()
    survivors = {
        (bug["file"], bug["now"].splitlines()[-1].strip())
        for bug in map(json.loads, lines)
        if bug.get("outcome") == "survived" and bug.get("again") != "killed"
    }
    for bug in load_yaml(ROOT / "benchmarks" / "random_mutants.yaml").data:
        assert (bug["file"], bug["now"]) in survivors
        assert len(bug["why"]) > 10
