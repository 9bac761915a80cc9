"""benchmarks/nosbench.py: files are drawn once, and answers are judged and counted."""

from pathlib import Path
from typing import Any

import nosbench


def test_files_that_were_tuned_on_are_never_drawn(tmp_path: Path) -> None:
    for i in range(100):
        (tmp_path / f"{i:03d}.json").write_text("x" * (i + 1))
    drawn = [path for path, _ in nosbench.drawn(tmp_path, 1, 100)]
    assert len(drawn) == len(set(drawn))
    assert sum(large for _, large in nosbench.drawn(tmp_path, 1, 20)) == 10
    few = [path for path, _ in nosbench.drawn(tmp_path, 1, 20)]
    assert few == drawn[:20]  # more files begin with the same ones


def row(method: str, f: float | None, products: float = 0.0) -> dict[str, Any]:
    """An answer on one file."""
    return {"file": "a.json", "large": False, "method": method, "f": f, "cpu": 1.0, "seed": 1,
            "violation": 0.0, "products": products, "limit": 9, "there": 1}  # fmt: skip


def test_what_is_not_solved_is_no_best_cost() -> None:
    plain, schedule, heart = nosbench.COMPARED
    rows = [row(plain, 2.0), row(schedule, 1.0, products=1e-3), row(heart, 4.0), row("Uno", None)]
    table = nosbench.table(rows)
    assert "| 1 of 1 (21% to 100%) | 0 of 1" in table[2]
    assert "| 0 of 1 (0% to 79%) | none" in table[3]
    assert "| 1 of 1 (21% to 100%) | 1 of 1" in table[4] and "2.0000" in table[4]
