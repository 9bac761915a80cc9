"""The table's statistics, from made-up records."""

import csv
from pathlib import Path
from typing import Any

import pytest

from kemba.config import Document
from kemba.errors import KembaError
from kemba.files import read_json
from kemba.scenarios.share import wilson
from kemba.sweep import Case, Sweep, open_folder, write_results
from kemba.sweep.results import costliest, influence, summarise

SPREAD = {"low": "0.4 m", "high": "0.6 m"}


def sweep(kind: str = "solve", **more: Any) -> Sweep:
    block = {"kind": kind, "task": "jump.yaml", "vary": {"height": SPREAD}, "cases": 4} | more
    return Sweep.model_validate({"name": "made-up", "blocks": {"a": block}})


def case(index: int, problem: str = "p", **values: Any) -> Case:
    return Case("a", index, values, "nowhere:none", {"number": index}, problem)


def solved(seconds: float, cost: float) -> dict[str, Any]:
    answer = {"status": "solved", "good": True, "sentence": "solved: well"}
    return answer | {"solve_s": seconds, "cost": {"torque_squared_integral": cost}}


FAILED = {"status": "stalled", "good": False, "sentence": "stalled, badly", "solve_s": 4.0}


def test_wilson_interval() -> None:
    low, high = wilson(98, 100)
    assert (low, high) == pytest.approx((0.92999, 0.99450), abs=1e-5)
    assert wilson(100, 100)[1] == 1.0 and wilson(0, 10)[0] == 0.0


def test_rates_times_and_costs() -> None:
    cases = [case(0), case(1), case(2), case(3, "q")]
    found = [solved(1.0, 2.0), solved(2.0, 3.0), FAILED, solved(3.0, 9.0)]
    records = {c.key: r for c, r in zip(cases, found, strict=True)}
    block = summarise(sweep(), cases, records)["blocks"]["a"]
    assert (block["cases"], block["succeeded"], block["unfinished"]) == (4, 3, 0)
    assert block["solve_s"] == {"min": 1.0, "median": 2.5, "p90": pytest.approx(3.7), "max": 4.0}
    assert block["cost_ratio"]["max"] == 1.5  # the case alone with its problem says nothing
    assert block["statuses"] == {"solved": 3, "stalled": 1}
    assert not block["met"]
    assert summarise(sweep(expect=0.75), cases, records)["good"]


def test_cases_without_an_answer_are_failures() -> None:
    cases = [case(0), case(1)]
    summary = summarise(sweep(expect=0.0), cases, {cases[0].key: solved(1.0, 1.0)})
    assert summary["blocks"]["a"]["unfinished"] == 1 and not summary["good"]
    assert summary["blocks"]["a"]["interval"] == pytest.approx(wilson(1, 2))
    assert "1 of 2 solved" in summary["sentence"] and "without an answer" in summary["sentence"]


def test_a_bad_plan_has_no_cost() -> None:
    """Cheap because it does not arrive: it is not the best known, and has no ratio."""
    cases = [case(0), case(1), case(2)]
    found = [solved(1.0, 2.0), solved(1.0, 3.0), solved(1.0, 0.1) | {"good": False}]
    records = {c.key: r for c, r in zip(cases, found, strict=True)}
    ratio = summarise(sweep(), cases, records)["blocks"]["a"]["cost_ratio"]
    assert (ratio["min"], ratio["max"]) == (1.0, 1.5)


def test_influence_names_what_costs_most() -> None:
    cases = [
        case(i, height=f"{400 + i} mm", supply=f"0.7{(7 * i) % 20:02d} MPa") for i in range(20)
    ]
    rows = [(c, {"good": c.index < 11, "apex_m": 0.5 - 0.01 * ((7 * c.index) % 20)}) for c in cases]
    found = influence(rows)
    assert found["costs_most"] == "height"
    assert found["ranks"]["supply"]["apex"]["correlation"] == pytest.approx(-1.0)
    assert costliest({"x": {"landing": None, "apex": None}}) is None


def test_what_costs_on_either_side_of_zero_is_found() -> None:
    cases = [case(i, **{"start.body/pitch": f"{i - 14.5} deg"}) for i in range(30)]
    rows = [(c, {"good": 8 <= c.index < 22, "apex_m": 0.5}) for c in cases]
    found = influence(rows)
    assert abs(found["ranks"]["start.body/pitch"]["landing"]["correlation"]) < 0.1
    assert found["ranks"]["|start.body/pitch|"]["landing"]["correlation"] < -0.8
    assert found["costs_most"] == "|start.body/pitch|"


def test_table_and_summary_are_written(tmp_path: Path) -> None:
    asked, cases = sweep(), [case(0, height="0.4 m"), case(1, height="0.5 m")]
    folder = open_folder(tmp_path / "out", asked, Document({"name": "made-up"}))
    write_results(folder, asked, cases, {cases[0].key: solved(1.0, 2.0)}, "limit")
    rows = list(csv.DictReader((folder / "results.csv").read_text().splitlines()))
    assert [row["height"] for row in rows] == ["0.4 m", "0.5 m"]
    assert [row["status"] for row in rows] == ["solved", "missing"]
    results = read_json(folder / "results.json")
    assert results["status"] == "limit" and "cores" in results["machine"]
    assert results["blocks"]["a"]["succeeded"] == 1
    open_folder(folder, asked, Document({}))  # continues


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(KembaError, match="holds other files"):
        open_folder(tmp_path, sweep(), Document({}))
