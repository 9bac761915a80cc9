"""compare: nothing to say about a right model, the right place for a wrong one."""

import json

import numpy as np
import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin import catalogue

from kemba.identify.compare.bins import excess
from kemba.identify.compare.compare import Comparison, compare
from kemba.identify.compare.force_profiles import ForceProfile
from kemba.identify.robot.problem import robot_problem
from kemba.model.spec import load_model
from kemba.plotting.comparison import plot_comparison


def compared(*effects: dict) -> Comparison:
    logs, _ = hops(*effects, figures_off=0.01)
    return compare(robot_problem(logs, load_model("planning")), "planning")


@pytest.fixture(scope="module")
def wrong() -> Comparison:
    return compared(catalogue.hidden("supply_scale", -1.5))


def test_a_right_model_explains_the_logs() -> None:
    found = compared()
    assert found.good, found.sentence
    assert 0.7 < found.noise_ratio < 1.15
    assert "within the noise" in found.sentence


def test_a_wrong_model_is_told_where_it_fails(wrong: Comparison) -> None:
    assert not wrong.good
    assert wrong.noise_ratio > 1.3
    worst = min(wrong.bins, key=lambda c: c.q_value)
    assert worst.q_value < 1e-6
    assert "does not explain" in wrong.sentence or "nearly" in wrong.sentence


def test_its_json_is_the_contract(wrong: Comparison) -> None:
    data = json.loads(json.dumps(wrong.json()))
    assert {"logs", "model", "noise_ratio", "channels", "cells", "sentence"} <= set(data)
    assert list(data["channels"][0]) == ["name", "rmse", "max", "noise_sigma", "ratio"]
    assert {"channel", "phase", "mode", "ratio", "q_value"} <= set(data["cells"][0])
    assert "body/z [m]" in {c["name"] for c in data["channels"]}
    assert {c["phase"] for c in data["cells"]} <= {"flight", "stance2", "stance1", "impact", "rest"}
    assert {c["mode"] for c in data["cells"]} <= {"00", "10", "01", "11"}
    assert {"in", "mid"} <= {c["region"] for c in data["cells"]} <= {"in", "mid", "out"}
    assert {p["channel"] for p in data["missing_force"]} >= {"body/z", "front/piston/x"}


def test_its_figure_has_every_channel_and_region(wrong: Comparison) -> None:
    figure = plot_comparison(wrong)
    texts = [t for axes in figure.axes for t in (*axes.get_yticklabels(), *axes.get_xticklabels())]
    shown = {text.get_text() for text in texts}
    assert {c.channel for c in wrong.bins} <= shown
    assert {"in", "mid", "in the\nair", "two feet\nstand"} <= shown | {
        text.get_text() for axes in figure.axes for text in axes.texts
    }
    labels = {axes.get_xlabel() for axes in figure.axes}
    assert {"time [s]", "speed [m/s]", "position [mm]", "air force [N]"} <= labels


def test_friction_shows_as_a_force_against_speed() -> None:
    found = compared(catalogue.hidden("seal_friction", 1.0))
    profile = profile_of(found, "rods", "speed [m/s]")
    fast = np.abs(profile.centre) > 0.05
    assert np.all(profile.force[fast] * profile.centre[fast] < 0)
    usual = np.average(np.abs(profile.force[fast]), weights=1.0 / profile.sigma[fast] ** 2)
    assert usual == pytest.approx(10.0, abs=2.0)
    assert next(h for h in found.hints if h.kind == "law").text.startswith("a force on the rods")
    assert "goes with speed" in found.sentence


@pytest.mark.slow
def test_a_weak_motor_shows_against_its_torque() -> None:
    found = compared(catalogue.hidden("torque_scale", 1.0))
    profile = profile_of(found, "hips", "torque [N.m]")
    assert profile.gain == max(p.gain for p in found.force_profiles)
    sent = {hint.text.partition(" ms after ")[2] for hint in found.hints if hint.kind == "command"}
    assert {"the front hip torque changes", "the rear hip torque changes"} & sent


@pytest.mark.slow
def test_a_late_valve_shows_after_it_switches() -> None:
    found = compared(catalogue.hidden("valve_delay", 1.0))
    after = profile_of(found, "rods", "after retract [ms]")
    usual = profile_of(compared(), "rods", "after retract [ms]")
    assert after.gain > 100 > 20 > usual.gain


def profile_of(found: Comparison, channel: str, quantity: str) -> ForceProfile:
    listed = found.force_profiles
    return next(p for p in listed if (p.channel, p.quantity) == (channel, quantity))


@pytest.mark.slow
def test_runs_that_contradict_each_other_are_told() -> None:
    """Two runs with a payload and two without: no payload explains them all."""
    light, _ = hops(runs=2)
    heavy, _ = hops(catalogue.hidden("payload", 1.5), runs=2, seed=2)
    for number, log in enumerate([*light, *heavy]):
        log.meta["name"] = f"hop{number}"
    found = compare(robot_problem([*light, *heavy], load_model("planning")), "planning")
    alike = compare(robot_problem(heavy, load_model("planning")), "planning")
    split = "no one value of payload.m fits all runs"
    assert any(split in h.text for h in found.hints)
    assert not any("payload.m" in h.text for h in alike.hints)


def test_noise_alone_is_no_excess() -> None:
    rng = np.random.default_rng(0)
    assert excess(rng.standard_normal(400)) > 0.05
    assert excess(np.array([0.5, -0.4, 9.0, 0.3, 0.1])) > 0.05  # one moment convicts nobody
    assert excess(2.0 * rng.standard_normal(400)) < 1e-6


def test_the_band_of_the_missing_force_covers_the_truth() -> None:
    sigma = np.array([3.0, 3.0, 0.2, 0.3, 0.3, 5.0, 5.0])
    logs, forces = hops(runs=4, pushes=sigma)
    problem = robot_problem(logs, load_model("planning"))
    inside, strength = [], []
    for found, force, log in zip(problem.missing_force(), forces, logs, strict=True):
        truth = np.stack([np.interp(found.time, log.time, f) for f in force.T], axis=1)
        low, high = found.band()
        inside.append((low < truth) & (truth < high))
        strength.append(found.force)
    assert 0.92 < np.concatenate(inside).mean() < 0.985
    assert np.std(np.concatenate(strength)[:, 5]) > 1.0


def test_where_nothing_is_missing_the_force_is_small() -> None:
    logs, _ = hops(runs=2)
    for found in robot_problem(logs, load_model("planning")).missing_force():
        assert np.abs(found.force[:, 5:]).mean() < 2.0
