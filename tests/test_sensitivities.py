"""What small changes do: to plans made anew, and to the same commands."""

import csv
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.ocp import load_task, task_model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import execute
from kemba.runs import Run, load_run
from kemba.sensitivity import Sensitivity, sensitivity, write_sensitivity
from kemba.sensitivity.table import sensitivity_of_run
from kemba_cli.main import app

FIGURES = ("height", "supply", "payload", "chamber.vent")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A quick refined jump."""
    folder = tmp_path_factory.mktemp("runs") / "jump"
    words = [
        "solve",
        "jump.yaml",
        "--set",
        "nodes=50",
        "--cold",
        "--no-figure",
        "-q",
        "--out",
        str(folder),
    ]
    assert CliRunner().invoke(app, words).exit_code == 0
    return load_run(folder)


@pytest.fixture(scope="module")
def found(run: Run) -> Sensitivity:
    return sensitivity_of_run(run.path, only=FIGURES)


def test_a_plan_made_anew_is_that_of_solve_from_it(
    run: Run, found: Sensitivity, tmp_path: Path
) -> None:
    """Half a step more and less of the height, as `solve --from` plans it."""
    at = [figure.name for figure in found.figures].index("height")
    new, step = found.replanned[at], found.figures[at].step
    assert new is not None and step == 0.01
    plans = []
    for height in (0.495, 0.505):
        words = ["solve", "--from", str(run.path), "--set", f"height={height} m"]
        words += ["--no-replay", "--no-figure", "-q", "--out", str(tmp_path / str(height))]
        assert CliRunner().invoke(app, words).exit_code == 0
        plans.append(load_run(tmp_path / str(height)).trajectory)
    lasts = plans[1].time[-1] - plans[0].time[-1]
    assert new.duration == pytest.approx(lasts, abs=2e-4) and new.cost > 0.0


def test_the_apex_follows_the_height_that_is_asked(found: Sensitivity) -> None:
    new = found.replanned[0]
    assert found.figures[0].name == "height"
    assert new is not None
    assert new.apex == pytest.approx(found.figures[0].step, rel=1e-3)
    assert found.commands[0] is None  # the commands do not know what height is asked


def test_commands_on_a_changed_machine_are_executions_of_the_table(
    run: Run, found: Sensitivity
) -> None:
    task, document = load_task(run.task)
    model = task_model(task, document=document)
    plan, table = run.trajectory, run.controller
    at = [figure.name for figure in found.figures].index("supply")
    tops = []
    for change in (-5e3, 5e3):
        changed, _ = load_task(run.task, [f"supply={task.supply + change!r}"])  # type: ignore[operator]
        own = task_model(changed)
        done = execute(table, own, extra=rest_after(model, plan, table))
        tops.append(float(np.max(done.trajectory["body/z"])))
    told = found.commands[at]
    assert told is not None
    assert told.lands
    assert told.apex == pytest.approx(tops[1] - tops[0], rel=0.05, abs=2e-6)


def test_the_table_has_a_row_for_each_figure_and_empty_cells_for_what_is_unknown(
    found: Sensitivity, tmp_path: Path
) -> None:
    write_sensitivity(found, tmp_path / "sensitivity.csv")
    with open(tmp_path / "sensitivity.csv", encoding="utf-8", newline="") as stream:
        rows = {row["figure"]: row for row in csv.DictReader(stream)}
    assert list(rows) == [figure.name for figure in found.figures]
    assert rows["height"]["commands/apex [m]"] == ""
    assert rows["supply"]["unit"] == "Pa"
    assert float(rows["supply"]["step"]) == 10e3
    assert float(rows["payload"]["commands/touchdown [s]"]) != 0.0


def test_a_plan_that_was_not_refined_keeps_its_commands(run: Run, tmp_path: Path) -> None:
    task, document = load_task(run.task)
    plan = run.trajectory
    plan.meta.pop("phases")
    model = task_model(task, document=document)
    found = sensitivity(task, model, plan, run.controller, only=["supply"])
    assert "no phases" in found.unsolved
    assert set(found.replanned) == {None}
    assert all(told is None or told.lands for told in found.commands)


def test_the_verb_writes_beside_the_plan_and_overwrites_nothing(run: Run) -> None:
    words = ["sensitivity", str(run.path), "-q", "--only", "supply"]
    first = CliRunner().invoke(app, words)
    assert (first.exit_code, first.stdout) == (0, f"{run.path / 'sensitivity.csv'}\n")
    again = CliRunner().invoke(app, ["sensitivity", str(run.path), "--only", "suply"])
    assert again.exit_code == 2
    assert "did you mean 'supply'?" in again.stderr
