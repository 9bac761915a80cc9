"""Broken inputs are answered in words and in time: a short run, and all that was ever found.

`benchmarks/fuzz.py` is the long run. What it finds is written to `corpus` by hand, as small as it
can be made, under a name that says what happened.
"""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fuzz import sound
from fuzz.logs import cells, text
from fuzz.rule import outcome
from fuzz.trial import TRIALS
from kemba.trajectory import Trajectory

CORPUS = sorted((Path(__file__).parent / "corpus").glob("[!.]*"))
EXAMPLES = {
    "bench logs": 12,
    "mapped logs": 6,
    "sidecars": 6,
    "other formats": 12,
}  # of files 10 each
SLOW = {"robot logs": 20, "compare": 20, "discover": 6}


def tried(name: str, examples: int, folder: Path) -> None:
    """Try so many inputs, the same ones every time."""
    inputs, run = TRIALS[name]

    @settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(inputs())
    def keeps_the_rule(content: str) -> None:
        assert run(content, folder).broken == ""

    keeps_the_rule()


# pyulog and nptdms leave a damaged file open, which Python says when it collects it
OPEN = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
QUICK = [pytest.param(name, marks=OPEN) if name == "foreign logs" else name
         for name in TRIALS if name not in SLOW]  # fmt: skip


@pytest.mark.parametrize("name", QUICK)
def test_broken_inputs_are_answered(name: str, tmp_path: Path) -> None:
    tried(name, EXAMPLES.get(name, 10), tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize("name", SLOW)
def test_broken_logs_are_answered(name: str, tmp_path: Path) -> None:
    tried(name, SLOW[name], tmp_path)


@pytest.mark.parametrize("file", CORPUS, ids=lambda path: path.name)
def test_past_findings_stay_mended(file: Path, tmp_path: Path) -> None:
    copied = Path(shutil.copy(file, tmp_path / f"input{file.suffix}"))
    found = outcome("check", copied)
    assert found.broken == "" and found.exit_code == 2, found.said


LOST = [  # verb, log, column, rows and what was read there
    pytest.param(
        *("discover", sound.bench, "valve/extend [1]", slice(101, 201), "0.0"),
        marks=pytest.mark.slow,
    ),
    ("check", sound.robot, "rear/hip/tau [N.m]", slice(244, 245), "1e12"),
]


@pytest.mark.parametrize(("verb", "log", "column", "rows", "value"), LOST, ids=["lost", "absurd"])
def test_logs_that_were_found_once_are_answered(
    verb: str, log: Callable[[], Trajectory], column: str, rows: slice, value: str, tmp_path: Path
) -> None:
    """Commands that were lost asked for a negative rise time; a torque of 1e12 N.m made NaN."""
    table = [list(row) for row in cells(log())]
    for row in table[rows]:
        row[table[0].index(column)] = value
    file = tmp_path / "input.csv"
    file.write_text(text(table), encoding="utf-8")
    out = ["--out", str(tmp_path / "answer"), "--no-figure"] if verb == "discover" else []
    found = outcome(verb, file, *out)
    assert found.broken == "" and found.exit_code == 0, found.said


def test_the_rule_sees_what_breaks_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the tests above could not fail."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))  # where a crash leaves its log
    file = tmp_path / "input.yaml"
    file.write_text("rig: 1\n")

    def crash(*_: object) -> None:
        raise ZeroDivisionError

    def hang(*_: object) -> None:
        while True:
            pass

    def silent(*_: object) -> None:
        from kemba.errors import KembaError

        raise KembaError("elsewhere", "is wrong")

    words = {crash: "crash: ", hang: "hang: more than 0.2 CPU s", silent: "no place: elsewhere"}
    monkeypatch.setitem(__import__("fuzz.rule", fromlist=["x"]).LONGEST, "check", 0.2)
    for broken, said in words.items():
        monkeypatch.setattr("kemba.config.find_config", broken)
        assert outcome("check", file).broken.startswith(said)


@pytest.mark.parametrize("name", ["cylinders", "other formats"])
def test_values_reach_the_inner_checks(name: str, tmp_path: Path) -> None:
    """Of files with small damage some must still be good, or only the outermost check is tried."""
    seen: set[int | None] = set()
    inputs, run = TRIALS[name]

    @settings(max_examples=40, deadline=None, derandomize=True, database=None)
    @given(inputs(), st.none())
    def look(content: str, _: None) -> None:
        seen.add(run(content, tmp_path).exit_code)

    look()
    assert {0, 2} <= seen
