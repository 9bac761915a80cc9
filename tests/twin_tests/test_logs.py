"""What the blind twin's sensors write."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from twin import (
    cases,
    figures,
    logs,
    measure,
    motions,
    repertoire,
    run,
    scripts,
)
from twin.scripts import short_hop


def test_same_seed_same_log(tmp_path):
    texts = []
    for name in "ab":
        paths, _ = cases.robot_case(
            tmp_path / name, "boom_force", seed=4, runs=1, scripts=[short_hop(0.1)]
        )
        texts.append(paths[0].read_bytes())
    assert texts[0] == texts[1]
    other, _ = cases.robot_case(tmp_path / "c", "boom_force", seed=5, runs=1,
                                scripts=[short_hop(0.1)])  # fmt: skip
    assert other[0].read_bytes() != texts[0]


def test_sensor_faults_touch_only_their_channel(hop):
    quiet = cases.quiet()
    plain = measure.robot_log(hop, quiet)
    for name, change in {
        "sensor_bias:body/pitch": lambda c: c + 1.5e-3,
        "sensor_scale:rear/piston/x": lambda c: 1.02 * c,
    }.items():
        faulty = measure.robot_log(hop, quiet, [measure.sensor_fault(name)])
        column = measure.header(name.split(":")[1])
        assert np.allclose(faulty.pop(column), change(plain[column]))
        assert all(np.array_equal(faulty[k], plain[k]) for k in faulty)
    late = measure.robot_log(hop, quiet, [measure.sensor_fault("sensor_delay:body/z")])
    assert np.allclose(late["body/z [m]"][3:], plain["body/z [m]"][:-3], atol=1e-6)


def test_accelerometer_is_the_mean_over_its_sample(hop):
    log = measure.robot_log(hop, cases.quiet(measure.Sensors(accelerometer=True)))
    gained = np.cumsum(log["body/az [m.s-2]"][1:]) * 1e-3
    assert np.allclose(gained, hop.w[2::2, 1] - hop.w[0, 1], atol=1e-9)


def test_logs_have_the_format(tmp_path):
    sensors = measure.Sensors(velocities=True, accelerometer=True, force=True, pressures=True,
                              feet=True, gaps=0.02)  # fmt: skip
    paths, truth = cases.robot_case(
        tmp_path, ["seal_friction", "sensor_scale:front/hip/q"], seed=1, runs=1, sensors=sensors,
        scripts=[short_hop(0.2)], floor=0.1,
    )  # fmt: skip
    log = logs.read(paths[0])
    needed = ["time [s]", "body/x [m]", "body/z [m]", "body/pitch [rad]"]
    for side in ("front", "rear"):
        needed += [f"{side}/hip/q [rad]", f"{side}/hip/tau [N.m]", f"{side}/piston/x [m]",
                   f"{side}/valve/extend [1]", f"{side}/valve/retract [1]"]  # fmt: skip
    assert set(needed) <= set(log)
    assert next(iter(log)) == "time [s]"
    assert (np.diff(log["time [s]"]) > 0).all()
    assert np.isnan(log["body/z [m]"]).any()
    assert set(np.unique(log["rear/valve/extend [1]"])) <= {0.0, 1.0}
    sidecar = paths[0].with_suffix(".meta.yaml").read_text()
    assert sidecar.startswith("kind: robot\nrun: 0\n")
    kinds = [e["kind"] for e in truth["effects"]]
    assert kinds == ["seal_friction", "sensor_scale:front/hip/q"]
    assert json.loads((tmp_path / ".truth" / "truth.json").read_text())["effects"]


def test_bench_case_from_the_terminal(tmp_path):
    command = [sys.executable, "-m", "twin", "bench", "--effect", "hose_lag", "--seed", "3",
               "--runs", "2", "--out", str(tmp_path), "--with", "pressures"]  # fmt: skip
    done = subprocess.run(
        command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True
    )
    paths = [Path(p) for p in done.stdout.split()]
    log = logs.read(paths[0])
    assert list(log)[:3] == ["time [s]", "piston/x [m]", "piston/F [N]"]
    assert {"valve/extend [1]", "valve/retract [1]", "supply/P [Pa]"} <= set(log)


def test_controller_table_is_executed(tmp_path):
    table = tmp_path / "controller.csv"
    header = ("time [s],front/hip/q [rad],front/hip/w [rad.s-1],front/hip/tau [N.m],"
              "rear/hip/q [rad],rear/hip/w [rad.s-1],rear/hip/tau [N.m],front/valve/extend [1],"
              "front/valve/retract [1],rear/valve/extend [1],rear/valve/retract [1]")  # fmt: skip
    q = figures.STANCE_HIP
    rows = [f"{k / 1000:.3f},{-q},0,0,{q},0,0,{int(k < 60)},0,{int(k < 60)},0" for k in range(100)]
    table.write_text("\n".join([header, *rows]) + "\n")
    truth = run.simulate(scripts.from_table(table))
    assert truth.finite
    assert truth.y[:, 1].max() > truth.y[0, 1] + 1e-3


def test_a_fall_ends_the_log_early(hop):
    falling = replace(hop, y=hop.y.copy())
    falling.y[400:, 2] = 1.0
    kept = motions.upright(falling)
    assert kept.ticks.size == 400 // hop.split - 20 + 1
    assert kept.finite
    assert motions.sane(kept)
    assert motions.upright(hop) is hop


@pytest.mark.slow
def test_every_motion_can_be_drawn():
    for name in motions.MOTIONS:
        assert motions.sane(run.simulate(repertoire.motion(name, 1)))
