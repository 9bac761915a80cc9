"""A model: the same whatever the order of its list, every row labelled, every mistake explained."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from kemba.effects import BY_KIND, Effect
from kemba.effects.base import At, Contribution
from kemba.effects.mechanics.load import Payload
from kemba.effects.mechanics.piston import EndStop
from kemba.effects.pneumatics.chamber import Chamber, ModeDamping
from kemba.effects.pneumatics.supply import SupplyScale
from kemba.effects.pneumatics.valve import Valve
from kemba.errors import KembaError
from kemba.mechanism import load_cylinder, rig_mechanism
from kemba.model import Model, load_model, load_spec

Values = dict[str, np.ndarray]
CYLINDER = load_cylinder("dsnu-25-70")


@pytest.fixture(scope="module")
def planning() -> Model:
    return load_model()


def residual(model: Model, seed: int = 0) -> Values:
    """The residual at a random point, the same point for equal variables in equal order."""
    rng, node = np.random.default_rng(seed), model.node
    point = {name: rng.uniform(0.1, 1.0, getattr(node, name).numel()) for name in node.NAMES}
    point["q"] += [model.mechanism.standing.get(c.name, 0.0) for c in model.mechanism.coordinates]
    return {name: np.array(value).ravel() for name, value in node.residual(**point).items()}


def test_order_does_not_matter(planning: Model) -> None:
    expected = residual(planning)
    orders = itertools.islice(itertools.permutations(planning.effects), 0, None, 997)
    for effects in orders:
        other = Model(planning.mechanism, effects, planning.supply)
        assert list(other.inputs.values()) == list(planning.inputs.values())
        for name, values in residual(other).items():
            assert np.array_equal(values, expected[name]), name
        assert other.node.pair_rows == planning.node.pair_rows


def test_rows_know_where_they_come_from(planning: Model) -> None:
    node = planning.node
    assert [r.label for r in node.dynamics_rows][:4] == [
        "dynamics:body/x",
        "dynamics:body/z",
        "dynamics:body/pitch",
        "dynamics:front/hip/q",
    ]
    assert [r.unit for r in node.dynamics_rows][:3] == ["N", "N", "N.m"]
    assert [r.label for r in node.rate_rows][:2] == [
        "rate:front/chamber/extend/F",
        "rate:front/chamber/retract/F",
    ]
    pairs = [a.label for a, _ in node.pair_rows]
    assert pairs[:4] == [
        f"front/contact:{n}" for n in ("gap", "cone", "slip forward", "slip backward")
    ]
    assert "rear/end_stop:extended" in pairs and len(pairs) == 12
    assert node.limit_rows[0].label == "front/motor:speed_forward"
    sizes = {"dynamics": "dynamics", "rate": "rate", "pair_a": "pair", "limits": "limit"}
    for part, rows in sizes.items():
        assert getattr(node, part).numel() == len(getattr(node, f"{rows}_rows"))


def test_an_effect_twice_is_refused(planning: Model) -> None:
    with pytest.raises(KembaError) as error:
        Model(planning.mechanism, [Valve(), Valve()])
    assert str(error.value) == "effects.valve: listed twice; each effect once per leg"


def test_two_effects_of_one_variable_are_refused(planning: Model) -> None:
    with pytest.raises(KembaError) as error:
        Model(planning.mechanism, [Valve(), Valve(on="front")])
    assert str(error.value) == "effects.valve:front: 'front/valve/extend' is declared twice"


def test_a_missing_port_is_explained() -> None:
    with pytest.raises(KembaError) as error:
        motor = BY_KIND["motor"].model_validate({"kind": "motor"})
        Model(rig_mechanism(CYLINDER), [motor])
    assert str(error.value) == (
        "effects.motor: needs the port 'hip/q', which rig does not have; ports: piston/x"
    )


def test_a_leg_that_is_not_there() -> None:
    with pytest.raises(KembaError) as error:
        Model(rig_mechanism(CYLINDER), [Valve(on="front")])
    assert str(error.value) == "effects.valve:front: rig has no leg 'front'"


def test_a_value_that_nobody_provides() -> None:
    with pytest.raises(KembaError) as error:
        _ = Model(rig_mechanism(CYLINDER), [Chamber()]).node
    assert str(error.value) == (
        "effects.chamber: needs 'u_e' at rig, which no effect of this model gives; add valve"
    )


def test_a_signal_that_nobody_reads() -> None:
    with pytest.raises(KembaError) as error:
        _ = Model(rig_mechanism(CYLINDER), [Valve(), SupplyScale(k=1.1)]).node
    assert "changes the signal 'supply_gain', which no effect of this model reads" in str(
        error.value
    )


class Loose(Effect):
    """Declares a state and never moves it."""

    kind: str = "loose"

    def states(self):  # type: ignore[no-untyped-def]
        return {"w": Chamber().states()["F_e"]}

    def evaluate(self, at: At) -> Contribution:
        return Contribution()


def test_a_state_that_nobody_moves() -> None:
    with pytest.raises(KembaError, match="has no rate: its effect declares but never moves it"):
        _ = Model(rig_mechanism(CYLINDER), [Loose()]).node


def test_unknown_names_are_answered_with_the_nearest(planning: Model) -> None:
    with pytest.raises(KembaError, match="no effect 'motr'; did you mean 'motor'"):
        planning.effect("motr")
    with pytest.raises(KembaError, match=r"no parameter 'boom\.mas'; did you mean 'boom\.mass'"):
        planning.build(["boom.mas"])


@pytest.mark.parametrize(
    ("supply", "forces", "damping"),
    [
        (0.6e6, (287.0, 239.0), (91.0, 78.0, 52.0, 25.0)),
        (0.7e6, (324.0, 260.0), (97.0, 84.0, 59.0, 25.0)),
        (0.8e6, (349.0, 291.0), (103.0, 89.0, 64.0, 25.0)),
        (0.65e6, (305.5, 249.5), (94.0, 81.0, 55.5, 25.0)),
    ],
)
def test_tables_are_read_at_the_supply(
    supply: float, forces: tuple[float, ...], damping: tuple[float, ...]
) -> None:
    """Table II, and halfway between its rows; the steady force is where the rate vanishes."""
    model = Model(rig_mechanism(CYLINDER), [Valve(), Chamber()], supply)
    s = np.array(forces)
    rest = model.node.residual([0.03], [0.0], [0.0], s, [0, 0], [], [1, 1], [])[1]
    assert np.array(rest).ravel() == pytest.approx(0.0, abs=1e-9)
    modes = [(1, 0), (0, 1), (1, 1), (0, 0)]
    found = ModeDamping().of_cylinder(CYLINDER)
    assert [found.c_d(*u, supply) for u in modes] == pytest.approx(list(damping))


@pytest.mark.parametrize(
    ("u", "x", "ms"), [(1, 0.0, 8), (1, 0.07, 25), (0, 0.0, 13), (0, 0.07, 37)]
)
def test_rise_times_of_table_i(u: int, x: float, ms: float) -> None:
    chamber = Chamber().of_cylinder(CYLINDER)
    assert chamber.rise_time(u, x, CYLINDER.stroke) == pytest.approx(ms / 1000)


def test_payload_is_mass_at_the_body(planning: Model) -> None:
    loaded = planning.with_effects([Payload(m=0.5)])
    n = planning.mechanism.n
    a = np.array([1.0, 2.0] + [0.0] * (n - 2))
    zeros = {name: np.zeros(getattr(planning.node, name).numel()) for name in planning.node.NAMES}
    zeros["q"] = np.array(
        [planning.mechanism.standing[c.name] for c in planning.mechanism.coordinates]
    )
    more = loaded.node.residual(**{**zeros, "a": a})["dynamics"]
    less = planning.node.residual(**{**zeros, "a": a})["dynamics"]
    expected = [0.5 * 1.0, 0.5 * (2.0 + 9.81)] + [0.0] * (n - 2)
    assert np.array(more - less).ravel() == pytest.approx(expected)


def test_end_stops_are_not_felt_by_the_rod_sensor() -> None:
    model = Model(rig_mechanism(CYLINDER), [Valve(), Chamber(), EndStop()])
    assert "piston/F" in model.node.outputs
    stop = [str(model.node.lam[i]) for i in range(model.node.lam.numel())]
    assert not any(name in str(model.node.outputs["piston/F"]) for name in stop)


def test_a_plus_b_is_the_model_a_with_what_the_file_of_b_adds(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("base: planning\nrobot: hound\nsupply: 0.65 MPa\n")
    for name in ("hound", str(tmp_path / "own.yaml")):
        alone, both, air = (load_spec(each) for each in (name, f"{name}+orifice", "orifice"))
        assert (both.robot, both.supply, both.chambers) == (alone.robot, alone.supply, "orifice")
        assert both.name == f"{alone.name}+orifice"
        assert {e.name for e in both.effects} == {e.name for e in (*alone.effects, *air.effects)}
    with pytest.raises(KembaError, match="no such file"):
        load_spec("hound+nothing")
