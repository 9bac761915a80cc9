"""compare on bench logs: locked, slow and random rigs, with and without chamber pressures."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("numba")

from twin import bench, cases, catalogue, figures, measure, rigs

from kemba.identify.bench.problem import bench_problem
from kemba.identify.compare.compare import Comparison, compare
from kemba.identify.problem.missing_force import missing_along
from kemba.model.spec import load_model
from kemba.plotting.comparison import plot_comparison
from kemba.trajectory import Trajectory
from kemba_cli.main import app

TESTS = ("random", "slow", "locked")


def bench_logs(
    *effects: dict,
    tests: Sequence[str] = TESTS,
    pressures: bool = False,
    figures_off: float = 0.0,
    push: float = 0.0,
    seed: int = 0,
) -> tuple[list[Trajectory], list[np.ndarray]]:
    """Logs of the blind twin's rig, and per log the force [N] that pushed besides."""
    rng = np.random.default_rng(seed)
    robot = figures.Robot().jittered(rng, figures_off)
    sensors = measure.Sensors(pressures=pressures)
    found, pushes = [], []
    for name in tests:
        rig = rigs.standard(name, 3.0, 1000.0, 2e-5, rng)
        force = cases.coloured(rig.ticks, [push], rng, 0.025)[:, 0]
        truth = bench.simulate(rig, list(effects), robot, push=force)
        columns = bench.bench_log(truth, sensors, (), rng)
        time = columns.pop("time [s]")
        found.append(Trajectory(time, columns, {"kind": "bench", "name": name}))
        pushes.append(force)
    return found, pushes


def compared(*effects: dict, **setting: object) -> Comparison:
    logs, _ = bench_logs(*effects, **setting)  # type: ignore[arg-type]
    return compare(bench_problem(logs, load_model("planning", rig=True)), "planning")


@pytest.mark.parametrize("pressures", [False, True])
def test_a_right_model_explains_every_rig(pressures: bool) -> None:
    found = compared(pressures=pressures)
    assert found.good, found.sentence
    assert {c.phase for c in found.bins} == {"rest", "moving"}
    assert {c.region for c in found.bins} == {"in", "mid", "out"}
    assert {c.mode for c in found.bins} == {"00", "10", "01", "11"}
    names = {c.name for c in found.channels}
    assert ("chamber/extend/P [Pa]" in names) == pressures


@pytest.mark.parametrize(
    ("test", "effect", "quantity"),
    [
        ("locked", "supply_scale", "model force [N]"),
        ("slow", "seal_friction", "speed [m/s]"),
        ("random", "piston_damping", "speed [m/s]"),
    ],
)
def test_each_rig_shows_what_it_can(test: str, effect: str, quantity: str) -> None:
    found = compared(catalogue.hidden(effect, 1.0), tests=(test,))
    assert not found.good
    assert found.noise_ratio > 2.0
    telling = max(found.force_profiles, key=lambda profile: profile.gain)
    assert telling.quantity == quantity
    assert f"goes with {quantity.split(' [')[0]}" in found.sentence


@pytest.mark.slow
def test_pressures_tell_air_from_friction() -> None:
    """Friction does not touch the chambers, a weak supply does."""
    friction = compared(catalogue.hidden("seal_friction", 1.0), pressures=True)
    supply = compared(catalogue.hidden("supply_scale", -1.0), pressures=True)
    worst = [max(found.bins, key=lambda c: c.ratio).channel for found in (friction, supply)]
    assert worst[0] == "piston/F" and worst[1].endswith("/P")
    ratios = {c.name: c.ratio for c in friction.channels}
    assert max(r for name, r in ratios.items() if "/P" in name) < 1.2


def test_figures_within_their_tolerance_are_no_missing_physics() -> None:
    found = compared(figures_off=0.01)
    assert found.noise_ratio > 1.5 and found.tolerable and not found.good
    assert "may be off by as much as is usual" in found.sentence


def test_rigs_in_conflict_are_told() -> None:
    """A supply that was lower in one of three runs is no figure of the model."""
    logs, _ = bench_logs(tests=("random", "random"))
    weak, _ = bench_logs(catalogue.hidden("supply_scale", -1.0), tests=("random",), seed=5)
    for number, log in enumerate([*logs, *weak]):
        log.meta["name"] = f"run{number}"
    found = compare(bench_problem([*logs, *weak], load_model("planning", rig=True)), "planning")
    told = [h.text for h in found.hints if h.kind == "conflict"]
    assert any("no one value of supply_scale.k fits all runs" in text for text in told)


def test_the_band_of_the_missing_force_covers_the_truth() -> None:
    logs, pushes = bench_logs(push=4.0)
    problem = bench_problem(logs, load_model("planning", rig=True))
    inside = []
    for found, log, push in zip(problem.missing_force(), logs, pushes, strict=True):
        low, high = found.band()
        truth = np.interp(found.time, log.time, push)
        inside.append((low[:, 0] < truth) & (truth < high[:, 0]))
        assert np.corrcoef(found.force[:, 0], truth)[0, 1] > 0.9
    assert 0.92 < np.concatenate(inside).mean() < 0.985


def test_a_lag_in_white_noise_is_found_as_the_full_matrices_say() -> None:
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.5e-3, 2e-3, 60))
    gap = 4.0 * np.sin(40 * time) + rng.normal(0.0, 1.0, 60)

    def lag(gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = missing_along("run", time, gap, np.ones(60), ("piston/F", "N"))
        return found.force[:, 0], found.sigma[:, 0]

    (mean, sigma), (_, ends) = lag(gap), lag(0.0 * gap)
    assert np.all(sigma < 1.0) and sigma[30] < sigma[0]
    assert np.sqrt(np.mean((mean - 4.0 * np.sin(40 * time)) ** 2)) < 0.6
    assert np.all(ends < sigma)  # nothing there: less freedom, narrower bands


def test_the_command_answers_and_draws(tmp_path: Path) -> None:
    logs, _ = bench_logs(catalogue.hidden("seal_friction", 1.0), tests=("slow", "random"))
    paths = [tmp_path / f"{log.meta['name']}.csv" for log in logs]
    for log, path in zip(logs, paths, strict=True):
        log.write(path)
    figure = tmp_path / "where.png"
    arguments = ["compare", *map(str, paths), "--figure", str(figure), "--json"]
    shown = CliRunner().invoke(app, arguments)
    assert shown.exit_code == 0, shown.output
    answer = json.loads(shown.stdout)
    assert answer["missing_force"][0]["channel"] == "piston/F"
    assert any(hint["kind"] == "law" for hint in answer["hints"])
    assert figure.stat().st_size > 10_000


def test_a_log_whose_valves_never_switch_is_compared(tmp_path: Path) -> None:
    """Of a rod that is driven against an open valve nothing else is known: states before the log
    are fitted that lead elsewhere, and a step from there may give no number."""
    rng, t = np.random.default_rng(0), np.arange(2000) * 1e-3
    columns = {
        "piston/x [m]": 0.035 + 0.03 * np.sin(3 * np.pi * t) + 2e-5 * rng.standard_normal(2000),
        "piston/F [N]": 200 + 0.3 * rng.standard_normal(2000),
        "valve/extend [1]": np.ones(2000),
        "valve/retract [1]": np.ones(2000),
    }
    Trajectory(t, columns, {"kind": "bench"}).write(tmp_path / "log.csv")
    for model in ("planning", "plant"):
        shown = CliRunner().invoke(app, ["compare", str(tmp_path / "log.csv"), "--model", model])
        assert shown.exit_code == 0, shown.output


def test_its_figure_fits_one_channel() -> None:
    figure = plot_comparison(compared(tests=("locked",)))
    assert figure.get_size_inches()[1] < 6.0
