"""Bench rigs and what characterise reads off their logs."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.mechanism import load_cylinder
from kemba.model import Model, load_model
from kemba.plant.characterise import Characteristics, characterise, linear
from kemba.plant.published import PAPER_FORCE, PAPER_RISE
from kemba.plant.rigs import (
    DynamometerRig,
    LockedRig,
    RandomRig,
    Rig,
    bench_model,
    load_rig,
    run_rig,
    stroke,
    write_rig,
)
from kemba.trajectory import Trajectory

CYLINDER = load_cylinder("dsnu-25-70")
STROKE = CYLINDER.stroke
SPEEDS = dict.fromkeys(("extend", "retract", "both", "none"), (0.2, 0.5, 0.8))


@cache
def piston(model: str, supply: float) -> Model:
    return bench_model(model, supply)


def logs_of(rig: Rig, model: str, noise: bool = False) -> dict[str, Trajectory]:
    return dict(run_rig(rig, lambda supply: piston(model, supply), noise=noise))


@cache
def first_order() -> Characteristics:
    """The tables from noisy tests of the first-order model."""
    rigs = (
        LockedRig(name="locked", repeats=2),
        LockedRig(name="other", chamber="retract", positions=(0.02,)),
        DynamometerRig(name="dynamometer", speeds=SPEEDS),
        RandomRig(name="random", duration=2.0),
    )
    logs = {}
    for rig in rigs:
        logs |= {f"{rig.name}/{k}": v for k, v in logs_of(rig, "planning", noise=True).items()}
    return characterise(logs, CYLINDER)


def test_a_line_explains_what_its_distances_from_the_mean_are_not_left() -> None:
    """R2 of points about y = 100 + x, by hand: 1 - 0.1 / 5.1; a shift of y does not change it."""
    x = np.array([-1.5, -0.5, 0.5, 1.5])
    off = 0.158113883 * np.array([1.0, -1.0, -1.0, 1.0])  # sum of squares 0.1, without a slope
    found, r2 = linear(np.column_stack([np.ones(4), x]), 100.0 + x + off)
    assert [e.value for e in found] == pytest.approx([100.0, 1.0])
    assert r2 == pytest.approx(1.0 - 0.1 / 5.1)


def test_rise_times_and_dead_time_of_the_truth_come_back() -> None:
    found = first_order().rises
    assert found is not None
    assert [e.value for e in found.fill] == pytest.approx([0.008, 0.025], abs=2e-4)
    assert [e.value for e in found.vent] == pytest.approx([0.013, 0.037], abs=2e-4)
    assert [e.value for e in found.dead.values()] == pytest.approx([0.006, 0.006], abs=2e-4)
    assert found.r2 > 0.999
    assert found.r2_linear > 0.999
    for estimate in (*found.fill, *found.vent):
        assert estimate.low < estimate.value < estimate.high < 1.05 * estimate.value


def test_forces_and_damping_of_the_truth_come_back() -> None:
    truth = {
        "extend": (324.0, 97.0),
        "retract": (-260.0, 84.0),
        "both": (64.0, 59.0),
        "none": (0.0, 25.0),
    }
    lines = first_order().lines
    assert [line.mode for line in lines] == list(truth)
    for line in lines:
        force, damping = truth[line.mode]
        assert line.F_static.value == pytest.approx(force, abs=0.5)
        assert line.c_d.value == pytest.approx(damping, abs=0.5)
        assert line.r2 > 0.99


def test_the_fitted_model_predicts_the_random_test() -> None:
    ((r2, rms),) = first_order().check.values()
    assert r2 > 0.9999
    assert rms < 1.0


def test_the_written_model_is_the_truth(tmp_path: Path) -> None:
    first_order().write_model(tmp_path / "mine.yaml", "mine")
    model = load_model(tmp_path / "mine.yaml")
    chamber, damping = model.effect("chamber"), model.effect("mode_damping")
    assert model.name == "mine"
    assert chamber.F_extend == pytest.approx((324.0,), abs=0.5)
    assert chamber.fill == pytest.approx((0.008, 0.025), abs=2e-4)
    assert damping.c_d(1, 1, 0.7e6) == pytest.approx(59.0, abs=0.5)
    assert model.timing("front") == pytest.approx((0.006, 0.006), abs=2e-4)


def test_locked_tests_alone_still_give_the_plateaus() -> None:
    found = characterise(logs_of(LockedRig(name="locked"), "planning"), CYLINDER)
    assert found.lines == []
    assert found.effects()[0].F_extend == pytest.approx((324.0,), abs=0.5)


def test_logs_that_tell_nothing_are_refused() -> None:
    still = Trajectory(
        np.arange(100) * 1e-3,
        {
            "piston/x [m]": np.zeros(100),
            "piston/F [N]": np.zeros(100),
            "valve/extend [1]": np.zeros(100),
            "valve/retract [1]": np.zeros(100),
        },
    )
    with pytest.raises(KembaError, match="no log holds a locked rod"):
        characterise({"still.csv": still}, CYLINDER)
    with pytest.raises(KembaError, match="no column 'piston/F'"):
        characterise({"bad.csv": still.select(["piston/x"])}, CYLINDER)


def test_the_shipped_rigs_have_the_papers_numbers() -> None:
    count = {
        name: len(list(load_rig(name).tests(np.random.default_rng(0), STROKE)))
        for name in ("locked", "volumes", "dynamometer", "random")
    }
    assert count["locked"] == 60
    assert count["volumes"] == 10
    assert count["random"] == 1
    assert len({t.facts["mode"] for t in load_rig("dynamometer").tests(None, STROKE)}) == 4  # type: ignore[arg-type]


def test_random_motion_stays_within_the_stroke() -> None:
    (test,) = RandomRig(name="random").tests(np.random.default_rng(7), STROKE)
    x, v = test.motion(test.times)
    assert x.min() >= -1e-9
    assert x.max() <= STROKE + 1e-9
    assert np.abs(np.gradient(x, test.times) - v)[1:-1].max() < 0.05
    assert len(test.valves["valve/extend"].times) > 20


def test_a_stroke_reaches_its_speed_and_its_end() -> None:
    x, v = stroke(0.0, 0.5, 0.05, 0.005, STROKE)(np.array([0.0, 0.06, 0.1, 0.3]))
    assert v.tolist() == [0.0, 0.5, 0.5, 0.0]
    assert x[-1] == STROKE
    with pytest.raises(KembaError, match="too short"):
        stroke(0.0, 30.0, 0.05, 0.005, STROKE)


def test_rigs_are_the_same_again_by_seed(tmp_path: Path) -> None:
    rig = RandomRig(name="random", duration=0.5)
    paths = [
        write_rig(rig, lambda p: piston("planning", p), tmp_path / name, seed, noise=True)[0]
        for name, seed in (("a", 1), ("b", 1), ("c", 2))
    ]
    first, again, other = (path.read_bytes() for path in paths)
    assert first == again != other
    assert Trajectory.read(paths[0]).meta["kind"] == "bench"


def test_the_shipped_plant_shows_the_papers_tables_at_07_mpa() -> None:
    speeds = {"extend": (0.5, 1.0, 1.5, 2.0), "retract": (0.5, 1.0, 1.5, 2.0)}
    speeds |= {"both": (0.2, 0.4, 0.6, 0.8), "none": (0.25, 0.5, 0.75, 1.0)}
    logs = logs_of(LockedRig(name="locked"), "plant")
    logs |= logs_of(DynamometerRig(name="dynamometer", speeds=speeds), "plant")
    found = characterise(logs, CYLINDER)
    assert found.rises is not None
    for name, paper in PAPER_RISE.items():
        measured = [e.value for e in getattr(found.rises, name)]
        assert measured == pytest.approx(paper, abs=2e-3)
    assert [e.value for e in found.rises.dead.values()] == pytest.approx([6e-3, 6e-3], abs=2e-4)
    for line in found.lines:
        force, damping = PAPER_FORCE[line.mode, line.supply]
        assert line.F_static.value == pytest.approx(force, rel=0.05, abs=4.0)
        assert line.c_d.value == pytest.approx(damping, rel=0.1)
        assert line.r2 > 0.97
