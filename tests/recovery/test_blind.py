"""A few blind cases, fixed: logs from the twin, which shares no code with the fit."""

from pathlib import Path

import pytest

pytest.importorskip("numba")

from twin.cases import bench_case

from kemba.identify.adopt import adopted
from kemba.identify.answer import Answer
from kemba.identify.bench.problem import bench_problem
from kemba.identify.discover import discover
from kemba.identify.logs.reading import read_logs
from kemba.identify.workflow import compare_logs, discover_logs
from kemba.model import load_model, load_spec

ORIFICES = Path(__file__).parents[2] / "benchmarks" / "blind" / "orifice_rig.yaml"
FAST = {"seal_friction": 3, "valve_delay": 1, "sensor_delay:piston/F": 4}
SLOW = {
    "supply_droop": 2,
    "hose_lag": 1,
    "end_cushion": 2,
    "gas_spring": 3,
}


def answer(folder: Path, effect: str | None, seed: int) -> tuple[Answer, dict]:
    """What is answered about four logs, the last one held out, and the truth."""
    paths, truth = bench_case(folder, effect, seed=seed, runs=4, duration=2.5)
    return discover_logs(paths[:3], paths[3:], out=folder / "answer")[0], truth


def check(found: Answer, truth: dict) -> None:
    (hidden,) = truth["effects"]
    assert found.verdict == "missing" and found.added == (hidden["kind"],), found.sentence
    name, value = next(iter(hidden["parameters"].items()))
    estimate = found.ranking[0].parameters[name]
    assert estimate.value == pytest.approx(value, rel=0.15)
    assert found.error_after < max(1.3, found.error_before / 3)


@pytest.mark.parametrize("effect", FAST)
def test_the_hidden_effect_is_named(effect: str, tmp_path: Path) -> None:
    check(*answer(tmp_path, effect, FAST[effect]))


def test_figures_that_nobody_would_believe_do_not_hide_an_effect(tmp_path: Path) -> None:
    """Areas of orifices far off imitate a rise time that is off, and a fit of nothing ends there:
    slopes about it say that nothing is missing."""
    short = {"runs": 3, "duration": 1.5, "chambers": "orifice"}
    paths, truth = bench_case(tmp_path, "rise_time_scale", seed=1, **short)
    found = discover(bench_problem(read_logs(paths), load_model(ORIFICES, rig=True)))
    assert found.search.is_strained
    check(found.answer, truth)


@pytest.mark.slow
@pytest.mark.parametrize("effect", SLOW)
def test_more_hidden_effects_are_named(effect: str, tmp_path: Path) -> None:
    check(*answer(tmp_path, effect, SLOW[effect]))


def test_nothing_is_found_where_nothing_is_hidden(tmp_path: Path) -> None:
    """Its figures are off within their tolerance: fitted, they leave the noise on a log that was
    kept, and what is written has no effect more."""
    found, _ = answer(tmp_path, None, 5)
    assert found.verdict == "nothing" and not found.added, found.sentence
    assert found.p_value_nothing > 0.05
    assert found.error_after < 1.1 < 1.8 < found.error_before
    assert "with figures fitted within their tolerance (2.03 as they were)" in found.sentence
    assert found.model is not None and not adopted(tmp_path / "answer", only_sure=False)
    assert [e.name for e in load_spec(found.model).effects if e.support] == []
    kept = [tmp_path / "run_03.csv"]
    assert compare_logs(kept, found.model)[0].noise_ratio == pytest.approx(found.error_after, 0.01)
    assert compare_logs(kept)[0].noise_ratio == pytest.approx(found.error_before, 0.01)


@pytest.mark.slow
def test_what_the_catalogue_lacks_is_not_given_a_name(tmp_path: Path) -> None:
    found, _ = answer(tmp_path, "magnet", 6)
    assert found.verdict == "unknown" and not found.added, found.sentence
    assert found.formula is not None and "exp(-(x/0.00" in found.formula
