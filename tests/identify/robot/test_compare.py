"""compare: nothing to say about a right model, the right place for a wrong one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin import catalogue

from kemba.identify.compare import Comparison, compare, excess
from kemba.identify.robot import robot_problem
from kemba.identify.smoother import missing_force
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
    worst = min(wrong.cells, key=lambda c: c.q_value)
    assert worst.q_value < 1e-6
    assert "does not explain" in wrong.sentence or "nearly" in wrong.sentence


def test_its_json_is_the_contract(wrong: Comparison) -> None:
    data = json.loads(json.dumps(wrong.json()))
    assert list(data) == ["logs", "model", "noise_ratio", "channels", "cells", "sentence"]
    assert list(data["channels"][0]) == ["name", "rmse", "max", "noise_sigma", "ratio"]
    assert list(data["cells"][0]) == ["channel", "phase", "mode", "ratio", "q_value"]
    assert "body/z [m]" in {c["name"] for c in data["channels"]}
    assert {c["phase"] for c in data["cells"]} <= {"flight", "stance2", "stance1", "impact", "rest"}
    assert {c["mode"] for c in data["cells"]} <= {"00", "10", "01", "11"}


def test_its_figure_has_every_channel(wrong: Comparison, tmp_path: Path) -> None:
    figure = plot_comparison(wrong)
    labels = {text.get_text() for axes in figure.axes for text in axes.get_yticklabels()}
    assert {c.channel for c in wrong.cells} <= labels


def test_noise_alone_is_no_excess() -> None:
    rng = np.random.default_rng(0)
    assert excess(rng.standard_normal(400)) > 0.05
    assert excess(2.0 * rng.standard_normal(400)) < 1e-6


def test_the_band_of_the_missing_force_covers_the_truth() -> None:
    sigma = np.array([3.0, 3.0, 0.2, 0.3, 0.3, 5.0, 5.0])
    logs, forces = hops(runs=4, pushes=sigma)
    problem = robot_problem(logs, load_model("planning"))
    inside, strength = [], []
    for found, force, log in zip(missing_force(problem), forces, logs, strict=True):
        truth = np.stack([np.interp(found.time, log.time, f) for f in force.T], axis=1)
        low, high = found.band()
        inside.append((low < truth) & (truth < high))
        strength.append(found.force)
    assert 0.92 < np.concatenate(inside).mean() < 0.985
    assert np.std(np.concatenate(strength)[:, 5]) > 1.0


def test_where_nothing_is_missing_the_force_is_small() -> None:
    logs, _ = hops(runs=2)
    for found in missing_force(robot_problem(logs, load_model("planning"))):
        assert np.abs(found.force[:, 5:]).mean() < 2.0
