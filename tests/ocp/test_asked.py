"""Requirements are measured on the motion itself, not on the rows of a program."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ocp.runs import Solved, solved
from typer.testing import CliRunner

from kemba.config import Document
from kemba.ocp import load_task
from kemba.ocp.certificate.asked import MeasuredRequirement, measured, on_execution
from kemba.ocp.task.requirement import quantities
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.trajectory import Trajectory
from kemba_cli.main import app

NAMES = ("body/z", "body/x", "body/pitch", "front/piston/x", "rear/foot/z", "front/hip/tau",
         "rear/valve/extend", "body/vz", "front/knee/z", "rear/hip/q")  # fmt: skip


def asked(run: Solved, section: str, name: str, **bound: object) -> list[MeasuredRequirement]:
    """One requirement, alone, on the plan of a run."""
    data = {"duration": run.task.duration, "nodes": run.task.nodes, section: {name: bound}}
    if section == "goals":
        data[section] = {"drawn": {"quantity": name, **bound}}
    task = Task.model_validate(data)
    found = resolve(task, run.model, Document(data))
    return [m for m in measured(run.model, task, found, run.plan) if m.text.startswith(section)]


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(NAMES),
    begin=st.floats(0.0, 1.0),
    lasts=st.floats(0.0, 1.0),
    off=st.floats(-0.3, 0.3).filter(lambda x: abs(x) > 1e-3),
    way=st.sampled_from(["at", "during"]),
    lower=st.booleans(),
)
def test_any_requirement_is_measured_as_the_columns_have_it(
    name: str, begin: float, lasts: float, off: float, way: str, lower: bool
) -> None:
    run = solved("jump")
    last, acts = len(run.plan) - 1, "tau" in name or "valve" in name
    if way == "at":
        nodes = [max(int(acts), round(begin * last))]
        when: dict[str, object] = {"at": begin}
    else:
        end = min(1.0, begin + lasts)
        inside = [k for k in range(int(acts), last + 1) if begin * last <= k <= end * last]
        nodes = inside or [max(int(acts), round((begin + end) * last / 2))]
        when = {"during": [begin, end]}
    values = run.plan[name][nodes]
    unit = quantities(run.model)[name]
    edge = values.min() if lower else values.max()
    limit = float(edge + off * (1.0 if unit.unit == "m" else 5.0))
    key = "at_least" if lower else "at_most"
    (found,) = asked(run, "goals", name, **when, **{key: limit})
    miss = max(limit - edge if lower else edge - limit, 0.0)
    assert not (found.met and miss)
    if miss:
        assert found.miss == pytest.approx(miss, abs=1e-9) or found.miss > miss  # between nodes
        assert f"drawn:{name}" in found.sentence and "off" in found.sentence


@pytest.mark.parametrize("name", ["body/z", "front/foot/z", "rear/piston/x", "front/hip/q"])
def test_a_plan_that_is_broken_on_purpose_is_told(name: str) -> None:
    """Every requirement of the shipped jump, on a plan with one column moved by a millimetre."""
    run = solved("jump")
    task, document = load_task("jump.yaml", ["nodes=40", "refine=none"])
    requirements = resolve(task, run.model, document)
    assert all(m.met for m in measured(run.model, task, requirements, run.plan))
    header = next(h for h, n in zip(run.plan.headers, run.plan.names, strict=True) if n == name)
    moved = run.plan[name] + 1e-3 * np.arange(len(run.plan)) / len(run.plan)
    missed = [
        m
        for m in measured(run.model, task, requirements, run.plan.with_columns({header: moved}))
        if not m.met
    ]
    asked_of = [r for r in requirements if r.quantity.name == name and np.isfinite(r.lower)]
    assert bool(missed) == bool(asked_of)
    assert all(name in m.text and m.line.startswith(str(document.source)) for m in missed)


def test_bounds_are_looked_at_between_nodes() -> None:
    """A leg that swings out and back between two nodes: its angle there follows from its rate."""
    run, node = solved("jump"), 20
    rate = run.plan["front/hip/w"].copy()
    rate[node] -= 40.0
    plan = run.plan.with_columns({"front/hip/w [rad.s-1]": rate})
    most = float(run.plan["front/hip/q"].max())
    data = {"duration": 0.7, "nodes": 40, "refine": "none"}
    data |= {"bounds": {"front/hip/q": {"at_most": most}}}
    task = Task.model_validate(data)
    asked = resolve(task, run.model, Document(data))
    assert measured(run.model, task, asked, run.plan)[0].met
    swung = measured(run.model, task, asked, plan)[0]
    assert not swung.met and swung.node == node - 1
    assert plan.time[node - 1] < swung.time_s < plan.time[node]
    refined = task.model_copy(update={"refine": "radau"})  # what is not refined yet: at its nodes
    assert measured(run.model, refined, asked, plan)[0].met


def test_an_execution_may_be_late_where_a_bound_begins() -> None:
    run = solved("jump")
    data = {
        "nodes": 40,
        "duration": 0.7,
        "goals": {"up": {"quantity": "body/z", "during": [0.5, 0.6], "at_least": 0.3}},
    }
    task = Task.model_validate(data)
    requirements = resolve(task, run.model, Document(data))
    real = Trajectory(run.plan.time + 2e-3, {"body/z [m]": run.plan["body/z"]})
    edge = float(run.plan["body/z"][20:25].min())
    tight = [replace(r, lower=edge) for r in requirements]
    assert all(m.met for m in on_execution(tight, run.plan, real, 1e-4, 1e-4, 5e-3))
    low = Trajectory(run.plan.time, {"body/z [m]": run.plan["body/z"] - 0.01})
    assert not any(m.met for m in on_execution(tight, run.plan, low, 1e-4, 1e-4, 5e-3))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "value"), [("end.*/piston/x", "30 mm"), ("end.*/foot/z", "5 cm")]
)
def test_an_end_is_kept_or_told(tmp_path: Path, place: str, value: str) -> None:
    """Both were once dropped, because the order of contacts decides them."""
    words = ["solve", "jump.yaml", "--set", f"{place}={value}", "--no-figure", "--json"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "run"), "--time-limit", "60"])
    answer = json.loads(done.stdout)
    name = place.removeprefix("end.").replace("*", "front")
    entries = [r for r in answer["requirements"] if r["text"] == f"{place}:{name}"]
    assert len(entries) == 1 and entries[0]["line"].startswith("--set")
    if (tmp_path / "run" / "trajectory.csv").is_file():
        plan = Trajectory.read(tmp_path / "run" / "trajectory.csv")
        assert entries[0]["value"] == pytest.approx(float(plan[name][-1]), abs=1e-9)
    assert entries[0]["met"] or answer["status"] != "solved"
    assert (done.exit_code == 0) == answer["good"]


def test_what_keys_ask_by_themselves_has_its_line_and_figure() -> None:
    run = solved("jump")
    task, document = load_task("jump.yaml", ["nodes=40", "refine=none", "landing.impact_speed=0.2"])
    found = measured(run.model, task, resolve(task, run.model, document), run.plan)
    own = {m.text: m for m in found if ":" not in m.text}
    assert set(own) == {"duration", "min_dwell", "landing.impact_speed"}
    assert own["duration"].met and own["duration"].line.endswith("jump.yaml:8")
    assert own["min_dwell"].line == "", "the file does not say it"
    speed = own["landing.impact_speed"]
    assert not speed.met and 0.2 < speed.value <= 0.8 + 1e-6
    assert speed.line == "--set landing.impact_speed=0.2"


@pytest.mark.parametrize(
    ("early", "scuff", "between", "parts"),
    [
        (0, 0.0, [], 3),
        (1, 0.0, [], 3),
        (1, 0.0, ["rear"], 4),  # that the rear feet leave last is asked
        (0, 0.0, ["rear"], 1),
        (3, 0.0, [], 1),
        (0, 50.0, [], 1),
    ],
)
def test_feet_leave_together_to_within_what_is_an_event(
    early: int, scuff: float, between: list[str], parts: int
) -> None:
    """A front foot that leaves some nodes, of 13 to 19 ms, before the rear one; or one that touches
    in flight for as long, with a force [N]."""
    run, forces = solved("jump"), {}
    for leg, before in (("rear", 0), ("front", early)):
        force = np.where(run.plan[f"{leg}/foot/Fz"] > 1.0, run.plan[f"{leg}/foot/Fz"], 0.0)
        leaves = int(np.flatnonzero(force == 0.0)[1])  # the first is the pose, before any force
        force[leaves - before : leaves] = 0.0
        force[leaves + 4] = scuff if leg == "front" else 0.0
        forces[f"{leg}/foot/Fz [N]"] = force
    changed = run.plan.with_columns(forces)
    columns = {h: changed[n] for h, n in zip(changed.headers, changed.names, strict=True)}
    plan = Trajectory(0.9 * changed.time, columns, changed.meta)
    last = [{"on": leg} for leg in between]
    contacts = [{"on": ["rear", "front"]}, *last, {"on": "air"}, {"on": ["rear", "front"]}]
    task = Task.model_validate(
        {"duration": run.task.duration, "nodes": run.task.nodes, "contacts": contacts}
    )
    (order,) = [m for m in measured(run.model, task, [], plan) if m.text.startswith("contacts")]
    assert order.value == parts
