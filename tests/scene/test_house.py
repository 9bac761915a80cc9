"""The whole house raised or moved: the same model, the same program, the same motion."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from robot_logs import hops

from kemba.effects.mechanics.ground import GroundCompliance
from kemba.identify.workflow import make_problem, model_of
from kemba.mechanism import Mechanism
from kemba.model import Model, load_model
from kemba.ocp.controller import controller_table
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.reading import asked_of, load_task
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.transcription.symmetry import find_symmetry, whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.plant.controller import execute
from kemba.plant.replay import replay
from kemba.scene import FLAT, scene_in
from kemba.solve.judged import plant_of
from kemba.trajectory import Trajectory

UP = 0.37
RAISED = [
    "terrain=[{height: 0.37 m}]",
    "height=0.72 m",
    "start.*/foot/z=0.37 m",
    "end.*/foot/z=0.37 m",
    "bounds.*/knee/z={at_least: 0.4 m}",
    "bounds.*/hip/z={at_least: 0.4 m}",
]
SEALS = {"kind": "seal_friction", "parameters": {"F_c": 12.0}}
MOVED = ["start.body/x=2 m", "end.body/x=2 m"]


def program(half: bool, *options: str) -> tuple[Transcription, np.ndarray]:
    """The program of a hop on 10 nodes, and its start guess."""
    task, document = load_task("hop.yaml", ["nodes=10", *options])
    model, requirements = asked_of(task, document)
    reduction = find_symmetry(model) if half else whole(model.node)
    assert reduction is not None
    t = Transcription(model, task, requirements, reduction, 10)
    return t, automatic_guess(model, task, requirements, t.layout, t.nodes)


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("house", [RAISED, MOVED])
def test_a_house_raised_or_moved_poses_the_same_program(half: bool, house: list[str]) -> None:
    (flat, guess), (other, there) = program(half), program(half, *house)
    assert there == pytest.approx(guess, abs=1e-9)
    for name in ("lower", "upper"):
        assert getattr(other, name) == pytest.approx(getattr(flat, name), abs=1e-9), name
    x = np.random.default_rng(0).uniform(0.1, 1.0, flat.shape).ravel()
    rows = [np.array(t.problem.g(x, np.full(5, 0.1))).ravel() for t in (flat, other)]
    for end in ("g_lower", "g_upper"):
        left, there = (g - getattr(t, end) for g, t in zip(rows, (flat, other), strict=True))
        assert there == pytest.approx(left, abs=1e-8), end
    assert [m.label.partition(":")[0] for m in other.meanings] == [
        m.label.partition(":")[0] for m in flat.meanings
    ]


def test_gaps_are_heights_on_level_ground_at_0() -> None:
    """`*/foot/gap` asks there for what `*/foot/z` asks for: no symbols, rows or columns more."""
    names = ["start.*/foot/gap=0 m", "end.*/foot/gap=0 m", "bounds.*/knee/gap={at_least: 3 cm}"]
    task, document = load_task("hop.yaml", ["nodes=10", *names])
    model, asked = asked_of(task, document)
    plain_model, plain = asked_of(*load_task("hop.yaml", ["nodes=10"]))
    known = {(r.quantity.name, r.at, r.lower, r.upper) for r in plain}
    assert {(r.quantity.name, r.at, r.lower, r.upper) for r in asked} == known
    assert model.mechanism.ports.keys() == plain_model.mechanism.ports.keys()
    assert not any(o.name.endswith("/gap") for o in model.node.output_quantities)
    assert model.mechanism.on(FLAT) is model.mechanism


def standing(mechanism: Mechanism) -> np.ndarray:
    return np.array([mechanism.standing[c.name] for c in mechanism.coordinates])


@pytest.mark.parametrize("effect", ["contact", "ground_compliance"])
def test_a_ramp_turns_the_forces_of_a_foot(effect: str) -> None:
    """Normal force and friction on a ramp are those of level ground, turned by its slope."""
    slope = np.deg2rad(10.0)
    scene = scene_in({"terrain": [{"slope": "10 deg"}]})
    flat, ramp = load_model(), load_model(scene=scene)
    if effect != "contact":
        flat, ramp = (m.with_effects([GroundCompliance()]) for m in (flat, ramp))
    q = standing(flat.mechanism)

    def at_foot(model: Model) -> np.ndarray:
        """Force (x, z) at the front foot of normal force 50 N and 20 N forward."""
        node, mechanism = model.node, model.mechanism
        lam = np.zeros(node.lam.numel())
        names = [f.name for f in model.forces.values()]
        for name, force in (("Fz", 50.0), ("Fx_forward", 20.0)):
            lam[names.index(f"front/foot/{name}")] = force
        ports = [mechanism.ports[f"front/foot/{axis}"].phi for axis in "xz"]
        J = ca.Function("J", [node.q], [ca.jacobian(ca.vertcat(*ports), node.q)])
        zero = [np.zeros(node.q.numel())] * 2
        rest = [np.zeros(x.numel()) for x in (node.s, node.sd)]
        ends = [np.zeros(node.u.numel()), np.zeros(node.p.numel())]
        given, without = (
            np.array(node.residual(q, *zero, *rest, force, *ends)[0]).ravel()
            for force in (lam, 0.0 * lam)
        )
        return np.linalg.lstsq(np.array(J(q)).T, without - given, rcond=None)[0]

    level, turned = at_foot(flat), at_foot(ramp)
    c, s = np.cos(slope), np.sin(slope)
    assert level == pytest.approx([20.0, 50.0], rel=1e-6)
    assert turned == pytest.approx([c * 20.0 - s * 50.0, s * 20.0 + c * 50.0], rel=1e-6)
    assert ramp.mechanism.mirror == {} != flat.mechanism.mirror


def raised_log(log: Trajectory) -> Trajectory:
    """The log as it would be on ground of 0.37 m, whose sidecar says so."""
    meta = {**log.meta, **scene_in({"terrain": [{"height": UP}]}).dump()}
    return Trajectory(log.time, log.with_columns({"body/z [m]": log["body/z"] + UP}).columns, meta)


@pytest.mark.slow
def test_logs_from_raised_ground_are_explained_as_well_as_flat_ones() -> None:
    logs = hops(SEALS, runs=1)[0]
    there = [raised_log(log) for log in logs]
    both = [make_problem(x, model_of(x, "planning")) for x in (logs, there)]
    flat, raised = (p.residual({"seal_friction.F_c": 12.0}) for p in both)
    assert raised == pytest.approx(flat, abs=1e-4 * np.abs(flat).max())
    lost = make_problem(logs, model_of(there, "planning"))
    assert np.abs(lost.residual({"seal_friction.F_c": 12.0})).max() > 2 * np.abs(flat).max()


def planned(*options: str) -> Plan:
    task, document = load_task("hop.yaml", ["nodes=50", "hold=0 s", "refine=none", *options])
    return plan(task, document)


@pytest.mark.slow
def test_the_same_hop_is_planned_replayed_and_lands_on_the_plant(tmp_path: Path) -> None:
    flat = planned()
    for house, place in ((RAISED, (0.0, UP)), (MOVED, (2.0, 0.0))):
        found = planned(*house)
        assert found.status == flat.status and found.status.plan
        assert found.trajectory["body/x"] - place[0] == pytest.approx(
            flat.trajectory["body/x"], abs=1e-5
        )
        assert found.trajectory["body/z"] - place[1] == pytest.approx(
            flat.trajectory["body/z"], abs=1e-5
        )
        found.trajectory.write(tmp_path / "plan.csv")
        assert scene_in(Trajectory.read(tmp_path / "plan.csv").meta) == found.task.scene
        ends = [replay(p.model, p.trajectory) for p in (flat, found)]
        assert ends[1].apex_error_m == pytest.approx(ends[0].apex_error_m, abs=1e-5)
        assert ends[1].fault == ends[0].fault
        landed = [
            execute(
                controller_table(p.model, p.trajectory, 0.0), plant_of(p.task), extra=0.3
            ).against(p.model, p.trajectory)
            for p in (flat, found)
        ]
        assert landed[1].fault == landed[0].fault
        assert landed[1].final_error_m == pytest.approx(landed[0].final_error_m, abs=1e-3)
