"""Plans for changed figures from an earlier plan: refined, replaying, and honest when it fails."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.model import load_model
from kemba.ocp.continuation.continue_plan import with_impacts
from kemba.ocp.continuation.origin import completed
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.modes import Phase, noted_phases, phase_notes
from kemba.ocp.phases.radau import RADAU3
from kemba.ocp.planning import Planning, plan
from kemba.ocp.reading import asked_of, load_task
from kemba.ocp.refinement.refine import Refiner, reduction_of, valve_columns
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.runs import load_run
from kemba.solve.earlier import origin_of
from kemba.trajectory import Trajectory
from kemba_cli.main import app

SIZE = ("--no-figure", "--json")


def solve(*words: str | Path) -> tuple[int, dict[str, object]]:
    done = CliRunner().invoke(app, ["solve", *map(str, words)])
    assert done.stdout, done.output
    return done.exit_code, json.loads(done.stdout)


@pytest.fixture(scope="module")
def hop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("earlier") / "run"
    air = "plant=planning"  # what the simulated robot does to other air is not the subject here
    code, answer = solve("hop.yaml", "--set", air, *SIZE, "--out", folder)
    assert code == 0, answer["sentence"]
    assert answer["continued"] is None
    return folder


def modes(run: Path) -> list[str]:
    """The phases of a plan without their nodes, which are shared anew by how long phases last."""
    return [text.split(" ", 1)[1] for text in load_run(run).trajectory.meta["phases"]]


@pytest.mark.parametrize("change", ["height=0.37 m", "supply=0.67 MPa", "payload=0.3 kg"])
def test_a_near_task_is_continued(hop: Path, tmp_path: Path, change: str) -> None:
    _, answer = solve("--from", hop, "--set", change, *SIZE, "--out", tmp_path / "run")
    assert answer["continued"] is True
    assert "from the earlier plan" in str(answer["sentence"])
    replay = answer["replay"]
    assert isinstance(replay, dict) and replay["landed"]
    assert abs(replay["apex_error_m"]) < 1e-4
    assert answer["apex_m"] == pytest.approx(0.37 if "height" in change else 0.35, abs=1e-5)
    assert modes(tmp_path / "run") == modes(hop)


@pytest.mark.slow
def test_a_learnt_model_is_continued(hop: Path, tmp_path: Path) -> None:
    model = tmp_path / "learnt.yaml"
    model.write_text(
        "name: learnt\nbase: planning\neffects:\n  - {kind: seal_friction, F_c: 8 N}\n"
        "  - {kind: hose_lag, T: 4 ms}\n"  # with states that the earlier plan lacks
    )
    _, answer = solve("--from", hop, "--model", model, "--no-figure", "--json",
                      "--out", tmp_path / "run")  # fmt: skip
    assert answer["continued"] is True
    replay = answer["replay"]
    assert isinstance(replay, dict) and abs(replay["apex_error_m"]) < 1e-3  # steep friction


def test_what_cannot_be_continued_is_made_from_scratch(hop: Path, tmp_path: Path) -> None:
    _, answer = solve("--from", hop, "--set", "refine=none", "--no-figure", "--json",
                      "--no-replay", "--out", tmp_path / "run")  # fmt: skip
    assert answer["continued"] is False
    assert "made from scratch, because the earlier plan could not be continued" in str(
        answer["sentence"]
    )


def test_from_and_resume_exclude_each_other(hop: Path) -> None:
    done = CliRunner().invoke(app, ["solve", "--from", str(hop), "--resume", str(hop)])
    assert done.exit_code == 2 and "exclude" in done.stderr


def test_phases_survive_their_notes() -> None:
    model = load_model("planning")
    constraints = read_constraints(model, whole(model.node))
    phases = [
        Phase(0, 5, (1, 0, 2, 0, 0, 1), (1.0, 0.0, 0.0, 1.0)),
        Phase(5, 9, (0, 0, 3, 0, 0, 1), (1.0, 1.0, 0.0, 1.0)),
    ]
    notes = phase_notes(phases, constraints)
    assert noted_phases(notes, constraints, 4, 9) == phases
    assert noted_phases(notes, constraints, 4, 10) is None, "another number of nodes"
    assert noted_phases(notes, constraints[1:], 4, 9) is None, "another robot"
    assert noted_phases(notes, constraints, 2, 9) is None, "other valves"
    assert noted_phases({}, constraints, 4, 9) is None
    torn = {**notes, "phases": [notes["phases"][1]]}
    assert noted_phases(torn, constraints, 4, 9) is None, "a phase is missing"


def test_columns_of_new_effects_are_filled(hop: Path) -> None:
    origin = origin_of(hop)
    short = Trajectory(
        origin.plan.time,
        {
            h: origin.plan[n]
            for h, n in zip(origin.plan.headers, origin.plan.names, strict=True)
            if "foot/Fz" not in n
        },
    )
    found = completed(short, origin.model)
    assert np.all(found["front/foot/Fz"] == 0.0)


def test_a_plan_whose_valves_are_ruled_out_begins_no_task(hop: Path) -> None:
    """Phases keep their valves: no row of the program would say that they must stay closed."""
    task, document = load_task("hop.yaml", ["bounds.*/valve/*=0"])
    assert Planning.of(task, document).continued(origin_of(hop))[0] is None


def test_impacts_of_a_start_are_met() -> None:
    """A trajectory has no velocities after impacts; the start of a continuation has."""
    task, document = load_task("jump.yaml")
    model, asked = asked_of(task, document)
    motion = plan(task, document).trajectory
    half = reduction_of(model, task, asked, motion)
    constraints = read_constraints(model, half)
    valves = len(valve_columns(model, half))
    phases = noted_phases(motion.meta, constraints, valves, len(motion) - 1)
    assert phases is not None
    program, x = Refiner(model, task, asked, motion, half, Control()).build(phases, motion, RADAU3)
    impacts = [row.label.startswith("impact") for row in program.rows]
    worst = [
        float(np.abs(np.array(program.problem.g(y, [])).ravel()[impacts]).max())
        for y in (x, with_impacts(program, x, 1e3))
    ]
    assert worst[0] > 1.0
    assert worst[1] < 1e-9
