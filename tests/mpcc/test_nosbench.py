"""benchmarks/nosbench.py: files are drawn once, and answers are judged and counted."""

from pathlib import Path
from typing import Any

import nosbench
import pytest


def test_files_that_were_tuned_on_are_never_drawn(tmp_path: Path) -> None:
    for i in range(100):
        (tmp_path / f"{i:03d}.json").write_text("x" * (i + 1))
    drawn = [path for path, _ in nosbench.drawn(tmp_path, 1, 100)]
    assert len(drawn) == len(set(drawn))
    assert sum(large for _, large in nosbench.drawn(tmp_path, 1, 20)) == 10
    few = [path for path, _ in nosbench.drawn(tmp_path, 1, 20)]
    assert few == drawn[:20]  # more files begin with the same ones


def test_every_file_is_either_drawn_or_tuned_on(tmp_path: Path) -> None:
    for i in range(100):
        (tmp_path / f"{i:03d}.json").write_text("x" * (i + 1))
    drawn, tuned = nosbench.drawn(tmp_path, 1, 100), nosbench.tuned(tmp_path)
    assert len(tuned) == 42 and len(dict(drawn + tuned)) == len(drawn + tuned) == 100
    assert sum(large for _, large in tuned) == 12


def row(method: str, f: float | None, products: float = 0.0) -> dict[str, Any]:
    """An answer on one file."""
    return {"file": "a.json", "large": False, "method": method, "f": f, "cpu": 1.0, "seed": 1,
            "violation": 0.0, "products": products, "limit": 9, "there": 1}  # fmt: skip


def test_what_is_not_solved_is_no_best_cost() -> None:
    plain, schedule, heart, _ = nosbench.METHODS
    rows = [row(plain, 2.0), row(schedule, 1.0, products=1e-3), row(heart, 4.0), row("Uno", None)]
    table = nosbench.table(rows)
    assert "| 1 of 1 (21% to 100%) | 0 of 1" in table[2]
    assert "| 0 of 1 (0% to 79%) | none" in table[3]
    assert "| 1 of 1 (21% to 100%) | 1 of 1" in table[4] and "2.0000" in table[4]


def test_files_that_were_tuned_on_have_a_table_of_their_own() -> None:
    rows = [row(method, 1.0) for method in nosbench.COMPARED]
    of = {"file": "b.json", "tuned": True, "limit": 3}
    lines = nosbench.page([*rows, *({**answer, **of} for answer in rows)])
    assert lines[0] == "The smaller half, 1 files:"
    assert "On which figures were chosen, 1 files:" in lines
    assert "at most: plain homotopy 9, solve_mpcc 9." in lines[-1]


def test_a_process_of_its_own_answers_or_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def solved(path: Path, method: str) -> dict[str, Any]:
        while method == "endless":
            pass
        raise ValueError("no such file")

    monkeypatch.setattr(nosbench, "solved", solved)
    assert nosbench.tried(tmp_path, "plain", 9)["why"] == "ValueError: no such file"
    stopped = nosbench.tried(tmp_path, "endless", 1)
    assert stopped["why"] == "stopped after 1 CPU seconds" and 0.5 < stopped["cpu"] < 2
