"""The reliability card, from a made-up sweep's folder."""

import runpy
from pathlib import Path

import pytest

from kemba.sweep import expand, load_sweep, open_folder, write_results

GENERATOR = Path(__file__).parents[2] / "benchmarks" / "reliability.py"
SWEEP = """\
name: made-up
blocks:
  low:
    kind: solve
    task: jump.yaml
    set: {nodes: 30}
    cases: 2
    vary: {height: {low: 0.4 m, high: 0.5 m}, supply: [0.7 MPa]}
"""


def test_card(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "s.yaml").write_text(SWEEP)
    sweep, document = load_sweep(tmp_path / "s.yaml")
    folder = open_folder(tmp_path / "out", sweep, document)
    cases = expand(sweep, document, folder)
    own = {"refined": True, "replays": True, "start": "guess"}
    figures = {"solve_s": 1.5, "solve_cpu_s": 1.0, "wall_s": 2.0, "iterations": 100}
    records = {
        cases[0].key: {"status": "solved", "good": True, "sentence": "solved", **figures, **own},
        cases[1].key: {"status": "stalled", "good": False, "sentence": "a | b\nc", **figures},
    }
    write_results(folder, sweep, cases, records, "finished")
    out = tmp_path / "card.md"
    monkeypatch.setattr("sys.argv", ["reliability.py", str(folder), "--out", str(out)])
    runpy.run_path(str(GENERATOR), run_name="__main__")
    text = out.read_text()
    assert "| low | 1 | 1 | 1 | 1 of 2 (50.0%) | 9.5% to 90.5% | 100% |" in text
    assert "- `height`: 0.4 m to 0.5 m" in text and "- `supply`: one of 0.7 MPa" in text
    assert "with nodes = 30" in text and "cores" in text
    assert f"| 1 | height {cases[1].values['height']}, supply 0.7 MPa | a \\| b c |" in text
