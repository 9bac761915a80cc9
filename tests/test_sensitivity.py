"""The sensitivity study runs again what reads a setting, and nothing else."""

import sys
from pathlib import Path
from typing import Any

import pytest

from kemba.settings import Settings, setting

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from sensitivity_cases import Case
from sensitivity_page import Change, flipped, section


class Early(Settings):
    """Read by the first stage."""

    gain: float = setting(2.0, "1", "a factor", "convention: two", decides=True)


class Late(Settings):
    """Read by the last stage."""

    limit: int = setting(3, "1", "a limit", "convention: three", decides=True)
    parts: tuple[float, ...] = setting((1.0, 2.0), "1", "parts", "convention: two", decides=True)


class Unread(Settings):
    """Read by no stage."""

    number: float = setting(1.0, "1", "a number", "convention: one", decides=True)


@pytest.fixture
def runs() -> list[str]:
    return []


@pytest.fixture
def case(runs: list[str]) -> Case:
    def first(_: Any) -> float:
        runs.append("first")
        return 2.0 * Early.current().gain

    def last(found: float) -> dict[str, Any]:
        runs.append("last")
        return {"verdict": "large" if found > Late.current().limit else "small"}

    made = Case("schedule:toy", [("first", first), ("last", last)])
    assert made.base() == {"verdict": "large"}
    runs.clear()
    return made


def test_a_change_runs_from_the_first_stage_on_that_reads_it(case: Case, runs: list[str]) -> None:
    assert case.answer(Change(Late, "limit", 2.0)) == {"verdict": "small"}
    assert runs == ["last"]
    assert case.answer(Change(Early, "gain", 0.5)) == {"verdict": "small"}
    assert runs == ["last", "first", "last"]
    assert case.answer(Change(Unread, "number", 2.0)) is None


def test_whole_numbers_stay_whole() -> None:
    assert [Change(Late, "limit", f).value for f in (0.5, 2.0, 0.01)] == [2, 6, 1]
    assert Change(Late, "parts", 0.5).value == (0.5, 1.0)


def test_the_page_marks_what_flips_when_doubled(case: Case) -> None:
    changes = [Change(Late, "limit", f) for f in (0.5, 2.0)]
    records = [{"case": case.name, "setting": "", "factor": 1.0, "answer": {"verdict": "large"}}]
    for change in changes:
        answer = case.answer(change)
        name = {"case": case.name, "setting": change.name, "factor": change.factor}
        records.append({**name, "answer": answer})
    text = section("Plans", changes, records)
    assert "| **`Late.limit`** | 3 | 1 | 1 | 0 | 1 | -, -; -, - | convention: three |" in text
    assert "Run on" not in text  # of records without a date
    dated = section("Plans", changes, [{**r, "date": "2026-11-22"} for r in records])
    assert "Run on 2026-11-22." in dated
    assert flipped({case.name: {"verdict": "large"}}, {case.name: None}) == []


def test_the_page_keeps_what_was_found_of_settings_that_are_gone(case: Case) -> None:
    base = {"case": case.name, "setting": "", "factor": 1.0, "answer": {"verdict": "large"}}
    gone = {**base, "setting": "Old.step", "factor": 2.0, "answer": {"verdict": "small"}}
    text = section("Plans", [], [base, gone])
    assert "`Old.step` (half 0, double 1 of 1)" in text and "| Old.step" not in text
