"""Scenarios of robust planning: what is drawn, and the share that succeeds."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.plant.simulate import run
from kemba.scenarios.draw import load_uncertainties, scenarios, standing
from kemba.scenarios.share import outcomes, share_of
from kemba.trajectory import Trajectory


@cache
def planning() -> Model:
    return load_model()


def written(folder: Path, text: str) -> Path:
    path = folder / "own.yaml"
    path.write_text(f"name: own\nvary:\n{text}", encoding="utf-8")
    return path


def test_the_shipped_file_is_what_it_says() -> None:
    asked, _ = load_uncertainties("usual")
    assert set(asked.vary) == {
        "payload",
        "supply",
        "effects.seal_friction.F_c",
        "effects.contact.mu",
        "effects.valve_delay.dt",
        "start.body/pitch",
        "start.*/hip/q",
    }


def test_scenarios_of_the_shipped_file() -> None:
    cases = scenarios("usual", planning(), 40)
    again = scenarios("usual", planning(), 40)
    assert [c.values for c in cases] == [c.values for c in again]
    hips = np.array([[c.start["front/hip/q"], c.start["rear/hip/q"]] for c in cases])
    assert hips.std(axis=0) == pytest.approx([np.radians(0.5)] * 2, rel=0.1)
    assert abs(np.corrcoef(hips.T)[0, 1]) < 0.5, "each hip by itself"
    supplies = {round(c.model.supply / planning().supply, 4) for c in cases}
    assert supplies == {0.95, 0.975, 1.0, 1.025, 1.05}
    loads = [c.model.effect("payload").value("m") for c in cases]
    assert 0.0 <= min(loads) < 0.05 and 0.45 < max(loads) <= 0.5
    assert all(c.model.mechanism is planning().mechanism for c in cases), "one machine code"


def test_payload_comes_on_top_of_the_tasks(tmp_path: Path) -> None:
    from kemba.effects.mechanics.load import Payload

    loaded = planning().with_effects([Payload(m=1.0)])
    name = written(tmp_path, "  payload: {low: 0.2 kg, high: 0.3 kg}\n")
    found = [c.model.effect("payload").value("m") for c in scenarios(name, loaded, 5)]
    assert min(found) >= 1.2 and max(found) <= 1.3


def test_unknown_keys_are_named(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match=r"start\.tail"):
        scenarios(written(tmp_path, "  start.tail: {low: 0, high: 1}\n"), planning(), 2)
    with pytest.raises(KembaError, match=r"effects\.frictoin"):
        scenarios(written(tmp_path, "  effects.frictoin.F_c: {low: 0, high: 1}\n"), planning(), 2)


def standing_plan(pitch: float) -> tuple[Trajectory, Trajectory]:
    """A plan that stands still for 50 ms on its stops, and its table."""
    model = planning()
    motion = run(model, {}, None, 0.05, sample=5e-3).trajectory
    time = np.arange(-300, 50) * 1e-3
    pose, columns = model.mechanism.standing, {}
    for leg in model.mechanism.legs:
        columns[f"{leg}/hip/q [rad]"] = np.full(len(time), pose[f"{leg}/hip/q"] + pitch)
        columns[f"{leg}/hip/w [rad.s-1]"] = 0.0 * time
        columns[f"{leg}/hip/tau [N.m]"] = 0.0 * time
        for chamber in ("extend", "retract"):
            columns[f"{leg}/valve/{chamber} [1]"] = 0.0 * time
    return motion, Trajectory(time, columns, {"lead": 0.3})


def test_a_standing_robot_keeps_standing(tmp_path: Path) -> None:
    name = written(tmp_path, "  start.body/pitch: {mean: 0 deg, sigma: 1 deg}\n")
    plan, table = standing_plan(0.0)
    found = share_of(outcomes(planning(), plan, table, scenarios(name, planning(), 6)))
    assert (found.n, found.landed) == (6, 6)
    assert found.summary()["wilson"] == pytest.approx([0.61, 1.0], abs=0.01)


def test_a_robot_that_is_laid_down_does_not(tmp_path: Path) -> None:
    """Hips at a right angle to where they stood put the body on the ground."""
    name = written(tmp_path, "  start.body/pitch: {low: 60 deg, high: 80 deg}\n")
    plan, table = standing_plan(0.0)
    found = share_of(outcomes(planning(), plan, table, scenarios(name, planning(), 4)))
    assert found.landed == 0
    assert "start.body/pitch" in found.worst


def in_the_air(height: float) -> Trajectory:
    """The table of a robot that hangs still at a height of its body."""
    _, table = standing_plan(0.0)
    return table.with_columns({"body/z [m]": np.full(len(table), height)})


@pytest.mark.parametrize("lifted", [0.0, 0.2])
def test_a_robot_that_is_dropped_stays_in_the_air(lifted: float) -> None:
    """Askew, a foot that stood is put on the ground again; one in the air stays there."""
    from kemba.plant.simulate import lowest_foot

    model = planning()
    table = in_the_air(model.mechanism.standing["body/z"] + lifted)
    moved = standing(model, table, {"body/pitch": 0.05})
    start = {"front/hip/q": table["front/hip/q"][0], "rear/hip/q": table["rear/hip/q"][0]}
    low = lowest_foot(model, {"body/z": table["body/z"][0], **start, **moved})
    if lifted:
        assert "body/z" not in moved and low > 0.15
    else:
        assert low == pytest.approx(0.0, abs=1e-9)
