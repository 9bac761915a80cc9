"""Logs of a bound, and of jumps on a slope and across a step: contacts come from their scene."""

from pathlib import Path

import pytest

import kemba
from kemba.config import shipped_configs

pytestmark = pytest.mark.nightly

HIDDEN = {"hip_friction": ("T_c", 0.6), "hose_lag": ("T", 0.008)}


def bound() -> str:
    return shipped_configs("tasks")["bound.yaml"].read_text(encoding="utf-8")


def slope() -> str:
    return jump("8 deg") + "terrain: [{slope: 8 deg}]\n"


def step() -> str:
    """The front feet stand on a platform, whose edge is a wall between the legs."""
    return jump("5.5 deg") + "terrain: [{from: 0 m, height: 5 cm}]\n"


def jump(pitch: str) -> str:
    text = shipped_configs("tasks")["jump.yaml"].read_text(encoding="utf-8")
    changes = {"body/pitch: 0 deg": f"body/pitch: {pitch}", "at_least: 5 cm": "at_least: 2 cm"}
    changes |= {f"{point}/z": f"{point}/gap" for point in ("foot", "knee", "hip")}
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


@pytest.fixture(scope="module", params=(bound, slope, step))
def planned(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan as the grid has it: what is learnt from is the executions."""
    folder = tmp_path_factory.mktemp(request.param.__name__)
    task = folder / "task.yaml"
    task.write_text(request.param(), encoding="utf-8")
    made = kemba.plan(task, folder / "run", replay=False, memory=False, refine="none", nodes=60)
    assert made.certificate["status"] == "solved", made.sentence
    return folder / "run"


@pytest.mark.parametrize("kind", HIDDEN)
def test_a_hidden_effect_is_named(kind: str, planned: Path, tmp_path: Path) -> None:
    name, true = HIDDEN[kind]
    machine = tmp_path / "machine.yaml"
    effect = f"{{kind: {kind}, {name}: {true}}}"
    machine.write_text(f"name: machine\nbase: planning\neffects:\n  - {effect}\n")
    logs = kemba.simulate(planned, tmp_path / "logs", plant=str(machine), repeat=3, noise=True).logs
    compared = kemba.compare(logs)
    assert not compared.good
    answer = kemba.discover(logs).answer
    assert answer.added == (kind,), answer.sentence
    found = answer.ranking[0].parameters[name]
    assert found.low < true < found.high
    assert found.value == pytest.approx(true, rel=0.1)
