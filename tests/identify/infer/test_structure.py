"""Orifice chambers as a candidate: what their share means, and the model that is written."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from robot_logs import hop, hops
from twin import figures, measure, run

from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.identify.adopt import write_model
from kemba.identify.answer import Answer, Ranked, Value
from kemba.identify.discover import discover
from kemba.identify.infer.structure import _verdict, is_mixture, joined
from kemba.identify.infer.windows import excess
from kemba.identify.problem.candidates import ORIFICE, by_default, structure_candidates
from kemba.identify.robot.problem import robot_problem
from kemba.model import Model, load_model
from kemba.model.spec import load_spec
from kemba.trajectory import Trajectory

PLANNING = load_model("planning")
FIGURES = {"a_fill": 4.2e-6, "a_vent": 3.5e-6, "V_e": 1.2e-5, "V_r": 1.6e-5, "n": 1.35}


def forces(model: Model, free: tuple[str, ...] = (), p: tuple[float, ...] = ()) -> np.ndarray:
    """Dynamics and the rates of the chambers at a moving pose, by the states' names."""
    node, rng = model.build(free), np.random.default_rng(2)
    q = np.array([0.1, 0.4, 0.05, -0.4, 0.5, 1.4, -1.3])
    pressure = {"extend": 4e5, "retract": 2e5}
    names = [quantity.name for quantity in model.states.values()]
    s = np.array([pressure[n.split("/")[2]] if "/P" in n else 90.0 for n in names])
    u = np.array([1.0, 0.0] * 2 + [0.0] * (node.u.numel() - 4))
    given = (q, rng.standard_normal(7), np.zeros(7), s, 0 * s, np.zeros(node.lam.numel()), u, p)
    dynamics, rate, *_ = node.residual(*given)
    rates = dict(zip(names, np.ravel(rate.full()), strict=True))
    own = [rates[n] for n in sorted(names) if "/P" in n]
    return np.append(np.ravel(dynamics.full()), own)


def test_a_share_of_one_is_the_other_structure() -> None:
    mixed = PLANNING.with_effects([by_default(ORIFICE)])
    free = tuple(f"{ORIFICE}.{name}" for name in ("a", *FIGURES))
    whole = forces(mixed, free, (1.0, *FIGURES.values()))
    orifice = PLANNING.with_effects([OrificeChamber(**FIGURES)])
    np.testing.assert_allclose(whole, forces(orifice), rtol=1e-9)
    none = forces(mixed, free, (0.0, *FIGURES.values()))
    np.testing.assert_allclose(none[:7], forces(PLANNING)[:7], rtol=1e-9)
    assert np.abs(whole[:7] - none[:7]).max() > 1.0


def test_only_first_order_chambers_can_be_replaced() -> None:
    assert ORIFICE in structure_candidates(PLANNING)
    assert structure_candidates(load_model("plant")) == {}


def test_the_model_that_is_written_has_the_figures(tmp_path: Path) -> None:
    values = {**FIGURES, "a": 0.98, "level": 1.02}
    row = {"effect": ORIFICE, "parameters": {k: {"value": v} for k, v in values.items()}}
    path = write_model(tmp_path / "model.yaml", "planning", {"ranking": [row]}, [ORIFICE])
    assert load_spec(path).chambers == "orifice"
    model = load_model(path)
    chamber = model.effect("orifice_chamber")
    assert chamber.value("a_fill") == pytest.approx(FIGURES["a_fill"])
    usual = OrificeChamber().gauge
    assert chamber.value("gauge") == pytest.approx([1.02 * g for g in usual], rel=1e-5)
    assert "chamber" not in [i.effect.kind for i in model.instances]


@pytest.mark.slow
def test_the_problem_is_built_anew_with_its_figures_free() -> None:
    logs, _ = hops(runs=1)
    problem = robot_problem(logs, PLANNING)
    assert problem.structures == {ORIFICE}
    anew = problem.rebuilt({f"{ORIFICE}.a": 0.9})
    usual = {p.name: p.typical for p in problem.candidates[ORIFICE].shapes}
    assert set(anew.own_figures.values()) == {*FIGURES, "level"}
    assert anew.structures == frozenset() and "supply_scale" not in anew.candidates
    for name, own in anew.own_figures.items():
        assert anew.nuisance[name][0] == pytest.approx(usual[own])
        assert np.linalg.norm(anew.jacobian({}, [name])) > 1.0
    # where a linear estimate points to a negative area, there is still a prediction
    assert np.isfinite(anew.residual({"orifice_chamber.a_fill": -1e-6})).all()


def second(verdict: str, after: float) -> Answer:
    """An answer of the second search, which found friction."""
    value = {"F_c": Value(5.0, 4.0, 6.0, "N")}
    friction = Ranked("seal_friction", 1.0, value, (), 2.0, after)
    ladder = [("model as it is", 2.0), ("seal_friction", after)]
    named = () if verdict == "unknown" else ("seal_friction",)
    return Answer(
        verdict, 0.1, "", [friction], named, 2.0, after, sure=named, ladder=ladder, rest="rods"
    )


@pytest.mark.parametrize(
    ("verdict", "after", "said"),
    [
        ("missing", 1.1, "missing"),
        ("partly", 1.8, "partly"),
        ("unknown", 1.8, "partly"),
        ("unknown", 4.5, "unknown"),
        ("partly", 5.2, "unknown"),  # a search that the time ended may leave more than it found
        ("missing", 4.9, "unknown"),
    ],
)
def test_two_stages_are_one_answer(verdict: str, after: float, said: str) -> None:
    row = Ranked(ORIFICE, 1.0, {"n": Value(1.3, 1.2, 1.4, "1")}, (), 5.0, 2.0)
    whole = joined(row, 0.002, second(verdict, after), None, ("seal_friction",))  # type: ignore[arg-type]
    assert whole.verdict == said
    assert [error for _, error in whole.ladder] == [5.0, 2.0, after]
    assert whole.error_before == 5.0 and whole.p_value_nothing == 0.002
    if said == "unknown":
        assert whole.added == () == whole.sure and "built anew" not in whole.sentence
    else:
        assert whole.added == (ORIFICE, "seal_friction")
        assert ORIFICE in whole.sentence


@pytest.mark.nightly
def test_orifice_chambers_are_named_on_robot_logs() -> None:
    """The twin with physical chambers against the planning model; its rods have some damping."""
    rng = np.random.default_rng(3)
    robot, logs = figures.Robot().jittered(rng, 0.01), []
    for i in range(3):
        truth = run.simulate(hop(3 + i), [], robot, "orifice")
        columns = measure.robot_log(truth, measure.Sensors(), (), rng)
        time = columns.pop("time [s]")
        logs.append(Trajectory(time, columns, {"kind": "robot", "name": f"hop{i}"}))
    fitted, held = (robot_problem(some, PLANNING) for some in (logs[:2], logs[2:]))
    answer = discover(fitted, held).answer
    assert ORIFICE in answer.added, answer.sentence
    assert answer.error_after < 1.3 < 5.0 < answer.error_before


@pytest.mark.parametrize(("low", "high", "mixed"), [(0.69, 0.87, True), (0.9, 1.1, False)])
def test_a_share_of_another_structure_is_no_whole_answer(
    low: float, high: float, mixed: bool
) -> None:
    """The model that is written has the structure whole: 0.78 of it land elsewhere."""
    assert is_mixture(Value((low + high) / 2, low, high, "1")) == mixed


def test_half_of_an_unexplained_error_is_a_part_of_an_answer() -> None:
    """Where the second search does not know, half of the error beyond the noise; else a tenth."""
    before = 5.0
    for second, share, verdict in (
        ("unknown", 0.49, "partly"), ("unknown", 0.52, "unknown"),
        ("partly", 0.89, "partly"), ("partly", 0.92, "unknown"),
        ("missing", 0.19, "missing"), ("missing", 0.49, "partly"),
    ):  # fmt: skip
        after = float(np.hypot(1.0, share * excess(before)))
        assert _verdict(second, before, after) == verdict, (second, share)
