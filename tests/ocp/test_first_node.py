"""Physics at the first node: no plan starts below the ground, and the certificate would tell."""

from functools import lru_cache

import numpy as np
import pytest

from kemba.config import Document
from kemba.model import load_model
from kemba.ocp import Plan, Task, load_task, plan
from kemba.ocp.certificate.certify import certify
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription

LEGS = ("front", "rear")


def asks_little(**more: object) -> tuple[Task, Document]:
    """A task that says nothing of its start."""
    document = Document({"name": "little", "height": 0.5, "nodes": 16, **more})
    return Task.model_validate(document.data), document


@lru_cache
def found(refine: str) -> Plan:
    return plan(*asks_little(refine=refine))


@pytest.mark.parametrize("refine", ["none", pytest.param("radau", marks=pytest.mark.slow)])
def test_a_free_start_is_a_possible_one(refine: str) -> None:
    first = found(refine)
    assert first.status.plan, first.sentence
    stroke = first.model.mechanism.stroke
    for leg in LEGS:
        assert first.trajectory[f"{leg}/foot/z"][0] >= -1e-6
        assert -1e-6 <= first.trajectory[f"{leg}/piston/x"][0] <= stroke + 1e-6


def test_the_certificate_measures_the_first_node() -> None:
    good = found("none")
    before = good.certificate.bounds
    low = good.trajectory["body/z"].copy()
    low[0] -= 0.1
    sunk = good.trajectory.with_columns({"body/z [m]": low})
    after = certify(good.model, good.task, good.requirements, sunk, most=50)
    depth = 0.1 - good.trajectory["front/foot/z"][0]
    assert before <= 1e-6 and after.bounds == pytest.approx(depth, abs=1e-6)
    at_first = {v.what: v.violation for v in after.worst if v.node == 0}
    assert at_first["front/contact:gap"] == pytest.approx(depth, abs=1e-6)


def test_a_speed_beyond_its_bound_at_the_first_node_is_measured() -> None:
    good = found("none")
    fast = good.trajectory["body/vz"].copy()
    fast[0] = 21.0  # 20 m/s is the bound
    measured = certify(
        good.model,
        good.task,
        good.requirements,
        good.trajectory.with_columns({"body/vz [m.s-1]": fast}),
        50,
    )
    assert "bound:body/vz" in {v.what for v in measured.worst if v.node == 0}


def first_rows(name: str) -> set[str]:
    """Rows of signs and limits at the first node of a shipped task's program."""
    task, document = load_task(name, ["nodes=8"])
    model = load_model(task.model)
    t = Transcription(model, task, resolve(task, model, document), whole(model.node), 8)
    return {m.label for m in t.meanings if m.node == 0 and m.kind == "sign"}


def test_the_first_node_has_no_row_that_the_start_already_grants() -> None:
    """A jump starts with feet at 0 m and pistons at 0 m; a drop with both free."""
    assert first_rows("jump") == set()
    stops = {f"{leg}/end_stop:{end}" for leg in LEGS for end in ("retracted", "extended")}
    assert first_rows("drop") == stops | {f"{leg}/contact:gap" for leg in LEGS}


def test_a_start_below_the_ground_is_not_granted() -> None:
    """A requirement that lies below the ground does not stand for the ground."""
    task, document = load_task("jump", ["nodes=8", "start.*/foot/z=-1 cm"])
    model = load_model(task.model)
    t = Transcription(model, task, resolve(task, model, document), whole(model.node), 8)
    kept = {m.label for m in t.meanings if m.node == 0 and m.kind == "sign"}
    assert kept == {f"{leg}/contact:gap" for leg in LEGS}


def test_effect_states_are_guessed_at_their_nominal_value() -> None:
    """A rested supply stands at 1, which is not 0."""
    from kemba.effects.pneumatics.supply import SupplyDroop
    from kemba.ocp.relaxation.guess import automatic_guess

    task, document = load_task("jump", ["nodes=8"])
    model = load_model(task.model, [SupplyDroop()])
    requirements = resolve(task, model, document)
    t = Transcription(model, task, requirements, whole(model.node), 8)
    s = t.layout.full(automatic_guess(model, task, requirements, t.layout, 8), "s")
    names = [q.name for q in model.states.values()]
    assert np.all(s[:, names.index("supply/s")] == 1.0)
