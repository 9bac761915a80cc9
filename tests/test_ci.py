"""What continuous integration runs: its parts, its closing line, the list of bugs on purpose."""

import ast
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from kemba.config import load_yaml

ROOT = Path(__file__).parent.parent
REPORT = """\
<testsuites><testsuite time="{seconds}"><testcase name="a"/><testcase name="b"/>
<testcase name="c"><skipped type="pytest.skip"/></testcase>
<testcase name="d"><skipped type="pytest.xfail"/></testcase>{more}</testsuite></testsuites>
"""


def test_the_closing_line_counts_all_parts(tmp_path: Path) -> None:
    quick, slow = tmp_path / "quick.xml", tmp_path / "slow.xml"
    quick.write_text(REPORT.format(seconds=70.5, more=""))
    slow.write_text(REPORT.format(seconds=30.0, more="<testcase><failure/></testcase>"))
    command = [sys.executable, str(ROOT / ".ci" / "total.py"), str(quick), str(slow)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    told = "1 failed, 4 passed, 2 skipped, 2 xfailed in 100.50s (0:01:40)"
    assert done.stdout.strip().strip("=").strip() == told


def test_an_unknown_part_is_refused_before_anything_is_installed() -> None:
    command = ["bash", str(ROOT / ".ci" / "run"), "lint", "slwo"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "no part 'slwo'; one of: lint types smoke quick slow nightly docs\n"


@pytest.mark.parametrize(
    ("name", "runs"),
    [("ci", {".ci/run"}), ("nightly", {".ci/run smoke slow nightly", ".ci/run docs"})],
)
def test_workflows_run_what_stands_here(name: str, runs: set[str]) -> None:
    jobs = load_yaml(ROOT / ".github" / "workflows" / f"{name}.yml").data["jobs"]
    steps = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    assert runs <= set(steps)
    assert all(job["timeout-minutes"] <= 90 for job in jobs.values())


def mutants() -> dict[str, object]:
    return runpy.run_path(str(ROOT / "benchmarks" / "mutants.py"))


def test_bugs_on_purpose_fit_the_code() -> None:
    """Enough of them still stand where the list says; with each, the file is still Python. Those
    that do not fit are told by `python benchmarks/mutants.py --list`."""
    listed = mutants()["listed"]()  # type: ignore[operator]
    fitting = [(m, m.mutated(ROOT)) for m in listed]
    fitting = [(m, text) for m, text in fitting if text is not None]
    assert len(fitting) >= 60
    assert len({(m.file, m.was, m.now) for m in listed}) == len(listed)
    for mutant, text in fitting:
        assert ast.dump(ast.parse(text)) != ast.dump(ast.parse((ROOT / mutant.file).read_text()))
        assert all((ROOT / name.partition("::")[0]).exists() for name in mutant.tests), mutant


def test_a_part_is_a_share_of_the_list() -> None:
    chosen, listed = mutants()["chosen"], mutants()["listed"]
    whole = listed()  # type: ignore[operator]
    parts = [m for number in (1, 2, 3) for m in chosen(f"{number}/3", "")]  # type: ignore[operator]
    assert [str(m) for m in parts] == [str(m) for m in whole]
    assert {m.file for m in chosen("1/1", "gate.py")} == {"kemba/identify/logs/gate.py"}  # type: ignore[operator]
