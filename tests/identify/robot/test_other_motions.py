"""Logs of a bound and of a jump onto a platform: contacts come from their scene."""

from pathlib import Path

import pytest

import kemba

pytestmark = pytest.mark.nightly

HIDDEN = {"hip_friction": ("T_c", 0.6), "hose_lag": ("T", 0.008)}


CHANGES = {"bound": {}, "platform": {"terrain.0.height": "0.1 m"}}


@pytest.fixture(scope="module", params=CHANGES)
def planned(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan as the grid has it: what is learnt from is the executions."""
    folder = tmp_path_factory.mktemp(request.param) / "run"
    grid = {"refine": "none", "nodes": 60, **CHANGES[request.param]}
    made = kemba.plan(f"{request.param}.yaml", folder, replay=False, memory=False, **grid)
    assert made.certificate["status"] == "solved", made.sentence
    return folder


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
