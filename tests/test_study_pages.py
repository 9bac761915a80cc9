# ruff: noqa: E402  (benchmarks are no package)
"""Pages of the studies of landing and of learning say what their records hold."""

import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))

import ablation
import full_plant_page
import learning_page
import robustness_page

from kemba.scenarios.draw import load_uncertainties
from kemba.units import read_si


def test_every_rule_that_is_switched_off_is_one_of_the_program() -> None:
    """A rule that was taken out of the program stopped the study at its first case."""
    with ablation.watched(set()):
        pass


def execution(index: int, way: str, fault: str, of: str = "new") -> dict[str, Any]:
    return {
        "task": "stand", "conditions": "twice", "way": way, "of": of, "drawn": 8, "index": index,
        "fault": fault, "apex_error_m": -0.01 * index, "final_error_m": 0.02 * index, "cpu_s": 0.1,
        "machine": "here", "on": "2026-11-22", "values": {"payload": f"{0.1 * index} kg"},
    }  # fmt: skip


def test_shares_are_of_the_latest_table_only() -> None:
    old = [execution(i, "open loop", "tips over", "old") for i in range(8)]
    new = [execution(i, "open loop", "tips over" if i > 5 else "") for i in range(8)]
    text = robustness_page.page([*old, *new], costs={"stand": 0.0594})
    row = "| stand | not run | 75.0 % of 8 (41 to 93) | not run | 0.0594 | 2026-11-22 |"
    assert row in text
    assert "- stand, twice, open loop: tips over (2)" in text


def test_a_robot_that_lands_elsewhere_is_told_apart() -> None:
    """Ends are 0, 2, 4, ... cm off: three of eight are within 5 cm."""
    rows = [execution(i, "feedback", "") for i in range(8)]
    ends = robustness_page.page(rows).split("ends where it should")[1]
    assert "37.5 % of 8" in ends.split("## ")[0]


def test_what_costs_most_is_named() -> None:
    rows = [execution(i, "open loop", "tips over" if i > 3 else "") for i in range(8)]
    assert "`payload` -0.87" in robustness_page.page(rows)


def test_twice_is_what_the_page_says() -> None:
    usual, twice = (load_uncertainties(name)[0].vary for name in ("usual", "twice"))
    assert usual.keys() == twice.keys()
    for key in ("effects.valve_delay.dt", "start.body/pitch"):
        first, second = (read_si(spread.sigma)[0] for spread in (usual[key], twice[key]))
        assert second == pytest.approx(2.0 * first)


def machine(seed: int, way: str, errors: list[float], lost: bool = False) -> dict[str, Any]:
    rounds = [{"apex_error_m": [e, e], "landed": [True, not lost]} for e in errors]
    return {"seed": seed, "way": way, "effects": {"payload": {"m": 0.3}}, "rounds": rounds,
            "facts": [{} for _ in errors[1:]], "cpu_s": 1.0, "machine": "here"}  # fmt: skip


def test_machines_are_counted_by_round() -> None:
    rows = [
        machine(1, "learn", [0.02, 0.004]),
        machine(2, "learn", [-0.03, -0.006], lost=True),
        machine(1, "correction", [0.02, 0.008]),
    ]
    text = learning_page.section(rows)
    assert "| learn | 2 | 25.0 (0: 0 to 66 %) | 5.0 (1: 9 to 91 %) | 1 of 2 | 1 |" in text
    assert "| 2 | payload | -30.0 -6.0, falls | not run |" in text


def test_figures_of_the_full_plant_stand_beside_the_truth() -> None:
    """One set named the line, another one friction with an effect that the plant does not have."""

    def record(number: int, error: float, *rows: tuple[str, str, float, str]) -> dict[str, Any]:
        ranking = [
            {"effect": e, "parameters": {n: {"value": v, "low": v, "high": v, "unit": u}}}
            for e, n, v, u in rows
        ]
        found = [e for e, *_ in rows[:-1]]  # the last one is ranked, but not in the answer
        answer = {"verdict": "missing", "error_before": 2.4, "error_after": error,
                  "ranking": ranking, "found": found}  # fmt: skip
        return {"set": number, "seconds": 90.0, "answer": answer, "compare": {"plant": 0.9}}

    line, friction = ("supply_line", "a", 4e-6, "m2"), ("seal_friction", "F_c", 4.0, "N")
    records = [record(0, 0.9, line, friction), record(1, 1.6, friction, ("payload", "m", 0.1, "kg"),
                                                      line)]  # fmt: skip
    text = full_plant_page.page(records, {0: ["a", "b", "c"], 1: ["d", "e", "f"], 2: ["g"]})
    assert "2 of 3 sets have run; 1 answers leave 1.5 times" in text
    assert "| `supply_line` a | 3.65 mm2 | 4 (4 to 4) mm2 | not named |" in text
    assert "| `seal_friction` F_c | 5 N | not named | 4 (4 to 4) N |" in text
    assert "| `payload` m | not in the plant | not named | 0.1 (0.1 to 0.1) kg |" in text
    assert "| a | missing | 2.40 | 0.90 | - | 0.90 | - | 90 |" in text
    assert text.endswith("0 of 2 intervals contain the plant's figure.")
