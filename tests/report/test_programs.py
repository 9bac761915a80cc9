"""Exported programs: a CasADi without kemba reads them and finds the same numbers."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.ocp import load_task
from kemba.report.programs import Named, export_nlp, programs
from kemba.runs import load_run
from kemba_cli.main import app

READ = """
import json, sys
sys.path.insert(0, sys.argv[1])
from load_program import load
import casadi as ca
for path in sys.argv[2:]:
    nlp, derivatives, at = load(path)
    x, p = at["x0"], at["p"]
    f, g = ca.Function("nlp", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]])(x, p)
    slope, jacobian = derivatives["grad_f"](x, p)[1], derivatives["jac_g"](x, p)[1]
    hessian = derivatives["hess_lag"](x, p, 1.0, ca.DM.ones(g.numel()))
    sums = [float(ca.sumsqr(v)) for v in (slope, jacobian, hessian)]
    print(json.dumps([float(f), g.full().ravel().tolist(), sums, len(at["lbx"])]))
assert "kemba" not in sys.modules
"""
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A quick refined jump."""
    folder = tmp_path_factory.mktemp("runs") / "jump"
    words = ["solve", "jump.yaml", "--set", "nodes=24", "--no-figure", "--no-replay", "-q"]
    done = CliRunner().invoke(app, [*words, "--out", str(folder)])
    assert done.exit_code == 0, done.stderr
    return folder


def test_a_casadi_without_kemba_finds_the_same_numbers(run: Path, tmp_path: Path) -> None:
    paths = export_nlp(run, tmp_path)
    files = [str(path) for path in paths if path.suffix == ".casadi"]
    code = [sys.executable, "-c", READ, str(BENCHMARKS), *files]
    done = subprocess.run(code, capture_output=True, text=True, check=True, cwd=tmp_path)
    told = [json.loads(line) for line in done.stdout.splitlines()]
    task, document = load_task(run / "task.yaml")
    own = list(programs(task, document, load_run(run).trajectory))
    assert [named.name for named in own] == ["relaxed", "refined"]
    for named, (f, g, sums, size) in zip(own, told, strict=True):
        assert size == named.start.size
        expected = values(named)
        assert f == expected[0]
        assert g == expected[1].tolist()
        assert sums == pytest.approx(expected[2], rel=1e-12)


def values(named: Named) -> tuple[float, np.ndarray, list[float]]:
    """Cost, rows, and sums of squares of gradient, Jacobian and Hessian, by kemba."""
    problem, x, p = named.program.problem, named.start, list(named.parameters)
    f, slope = problem.grad_f(x, p)
    jacobian = problem.jac_g(x, p)[1]
    hessian = problem.hess_lag(x, p, 1.0, np.ones(problem.rows))
    squares = [float(np.sum(np.square(v.nonzeros()))) for v in (slope, jacobian, hessian)]
    return float(f), np.array(problem.g(x, p)).ravel(), squares


def test_the_verb_keeps_what_is_there(run: Path, tmp_path: Path) -> None:
    task = tmp_path / "task.yaml"
    task.write_text((run / "task.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    out = tmp_path / "nlp"
    words = ["export", str(task), "--nlp", "--out", str(out)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0
    assert done.stdout.split() == [str(out / f"relaxed.{e}") for e in ("casadi", "json")]
    again = CliRunner().invoke(app, words)
    assert again.exit_code == 2
    assert "exists already" in again.stderr


def test_a_plan_needs_a_file_name() -> None:
    done = CliRunner().invoke(app, ["export", "somewhere"])
    assert done.exit_code == 2
    assert "jump.mat" in done.stderr
