"""`kemba-opt discover`, `adopt` and `experiment`, as scripts see them."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from kemba.model import load_spec, read_covariance
from kemba_cli.main import app

FIELDS = {
    *("verdict", "p_value_nothing", "sentence", "ranking", "added", "error_before", "error_after"),
    *("noise_floor", "smallest_detectable", "alike", "formula", "split_by", "model", "runtime_s"),
}
RANKED = {
    *("effect", "probability", "parameters", "equivalent_to", "error_before", "error_after"),
    "holdout_gain_nats",
}


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two bench logs of a rig whose force sensor reads 8 N too much."""
    home = tmp_path_factory.mktemp("bench")
    for number in range(2):
        write_log(home / f"run_{number}.csv", seed=number, bias=8.0)
    return home


def write_log(path: Path, seed: int, bias: float) -> None:
    """A locked rod at 30 mm whose valves are switched, by the closed form of eq. 4."""
    rng = np.random.default_rng(seed)
    time = np.arange(1500) / 1e3
    sent = (rng.random((2, 16)) < 0.5).repeat(100, axis=1)[:, : len(time)].astype(float)
    force = np.zeros((2, len(time)))
    for i, (static, x) in enumerate(((324.0, 0.03), (260.0, 0.04))):
        for k in range(1, len(time)):
            u = sent[i, k - 7] if k >= 7 else 0.0
            tau = 0.013 - 0.005 * u + x / 0.07 * (0.024 - 0.007 * u)
            target = static * u
            force[i, k] = target + (force[i, k - 1] - target) * np.exp(-1e-3 / tau)
    measured = force[0] - force[1] + bias + rng.standard_normal(len(time))
    x = 0.03 + 2e-5 * rng.standard_normal(len(time))
    table = np.column_stack([time, x, *sent, measured])
    header = "time [s],piston/x [m],valve/extend [1],valve/retract [1],piston/F [N]"
    lines = [",".join(f"{value:.7g}" for value in row) for row in table]
    path.write_text("\n".join([header, *lines]) + "\n")


def test_what_logs_could_show_is_told_without_a_search(folder: Path) -> None:
    """A locked rod shows neither friction nor damping; whether the valve or the force sensor is
    late only a rod that moves tells."""
    done = run(
        "compare", folder / "run_0.csv", folder / "run_1.csv", "--what-could-be-seen", "--json"
    )
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert "valve_delay" in found["shown"] and "seal_friction" not in found["shown"]
    assert found["sizes"]["end_cushion"]["c"] is None
    assert ["valve_delay", "sensor_delay:piston/F"] in found["classes"]
    late = found["tests"][found["classes"].index(["valve_delay", "sensor_delay:piston/F"])]
    assert "rig test" in late["test"] and "locked" not in late["test"] and late["nats"] > 5.0
    refused = run("compare", folder / "run_0.csv", "--what-could-be-seen", "--figure")
    assert refused.exit_code == 2 and "compares nothing" in refused.stderr


def test_check_names_the_next_command(folder: Path) -> None:
    logs = [str(folder / f"run_{number}.csv") for number in range(2)]
    done = run("check", *logs)
    assert done.exit_code == 0
    assert done.stderr == f"next: kemba-opt discover {' '.join(logs)}\n"
    assert run("check", *logs, "-q").stderr == ""


def test_json_has_every_field_and_files_are_written(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "answer"
    shown = run("discover", folder / "run_0.csv", folder / "run_1.csv", "--out", out, "--json")
    assert shown.exit_code == 0, shown.output
    answer = json.loads(shown.stdout)
    assert set(answer) >= FIELDS
    assert all(set(row) == RANKED for row in answer["ranking"])
    assert answer["verdict"] == "missing" and answer["added"] == ["sensor_bias:piston/F"]
    value = answer["ranking"][0]["parameters"]["b"]
    assert value["low"] < 8.0 < value["high"] and value["unit"] == "N"
    assert json.loads((out / "answer.json").read_text())["verdict"] == "missing"
    for name in ("model.yaml", "heat_map.png", "residual.png", "ladder.png"):
        assert (out / name).stat().st_size > 50

    compared = run("compare", *folder.glob("*.csv"), "--model", out / "model.yaml", "--json")
    quoted = json.loads(compared.stdout)["noise_ratio"]
    assert quoted == pytest.approx(answer["error_after"], rel=0.01), "what is said is written"
    evidence = load_spec(out / "model.yaml").evidence
    assert evidence is not None and evidence.error_held_out == answer["error_after"]
    assert {log.use for log in evidence.logs} == {"learnt"}, "two logs: none is kept aside"
    assert not evidence.faults(out)
    assert "sensor_bias:piston/F.b" in read_covariance(out / "model.yaml")[0]

    whole = run("adopt", out, "--out", tmp_path / "whole.yaml")
    assert whole.exit_code == 0 and load_spec(tmp_path / "whole.yaml").evidence is not None
    sure = run("adopt", out, "--only-sure", "--out", tmp_path / "sure.yaml")
    assert sure.exit_code == 0 and "support: sure" in (tmp_path / "sure.yaml").read_text()
    assert run("adopt", out, "payload", "--only-sure").exit_code == 2

    adopted = run("adopt", out, "sensor_bias:piston/F", "--out", tmp_path / "mine.yaml")
    assert adopted.exit_code == 0 and "channel: piston/F" in (tmp_path / "mine.yaml").read_text()
    wrong = run("adopt", out, "seal_frictio")
    assert wrong.exit_code == 2 and "is not in the ranking" in wrong.stderr


def test_bad_data_is_a_verdict(folder: Path, tmp_path: Path) -> None:
    log = tmp_path / "bad.csv"
    lines = (folder / "run_0.csv").read_text().splitlines()
    log.write_text("\n".join([*lines[:900], *lines[700:]]) + "\n")
    shown = run("discover", log, "--out", tmp_path / "answer", "--json")
    assert shown.exit_code == 1
    answer = json.loads(shown.stdout)
    assert answer["verdict"] == "bad-data" and "bad.csv:901:1" in answer["sentence"]


def test_wrong_usage_is_told_apart(folder: Path, tmp_path: Path) -> None:
    missing = run("discover", tmp_path / "none.csv", "--out", tmp_path)
    assert missing.exit_code == 2 and "none.csv" in missing.stderr
    log = folder / "run_0.csv"
    both = run("discover", log, "--holdout", log, "--out", tmp_path)
    assert both.exit_code == 2 and "also among the logs" in both.stderr
    model = run("discover", log, "--model", "planing", "--out", tmp_path)
    assert model.exit_code == 2 and "planning" in model.stderr


def test_no_answer_is_replaced_without_force(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.csv").write_text(  # valves that are neither open nor shut
        "time [s],piston/x [m],valve/extend [1],valve/retract [1],piston/F [N]\n"
        + "".join(f"{i / 1000},0.03,0.5,0,{i % 7}\n" for i in range(400))
    )
    for name in ("answer", "answer-2"):
        assert run("discover", "bad.csv").exit_code == 1
        assert (tmp_path / name / "answer.json").is_file()
    Path("answer/fit.png").write_text("old")
    before = Path("answer/answer.json").read_text()
    done = run("discover", "bad.csv", "--out", "answer")
    assert done.exit_code == 2 and "holds results already (answer.json)" in done.stderr
    assert Path("answer/answer.json").read_text() == before and Path("answer/fit.png").exists()
    assert run("discover", "bad.csv", "--out", "answer", "--force").exit_code == 1
    assert sorted(p.name for p in Path("answer").iterdir()) == ["answer.json"]
