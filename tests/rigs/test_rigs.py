"""Rigs of the user's own: what was put into a simulation is found in its log, and nothing else."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from machines import cogging_log, cylinder_log, drive_log, model_file, turning_log, vessel_log
from real_data import reader, real
from typer.testing import CliRunner

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.identify.rigs.characterise import characterise_logs
from kemba.identify.workflow import compare_logs, discover_logs
from kemba.model import load_model
from kemba_cli.main import app

DRIVE = {"kind": "drive", "motion": "linear", "inertia": "2 kg"}
CYLINDER = {"kind": "cylinder", "bore": "25 mm", "stroke": "40 mm", "chambers": ["extend"]}
VESSEL = {
    "kind": "vessel", "volume": "16 L", "orifice": "2.394 mm", "discharge": 1.0, "wall": 0.35,
    "ambient": "298 K",
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("width", [1e-1, 1e-2, 1e-3])
def test_friction_of_a_drive_is_found_however_sharply_it_turns_over(
    tmp_path: Path, width: float
) -> None:
    model = model_file(tmp_path, {"kind": "drive", "motion": "rotary", "inertia": "2 kg.m2"})
    log = drive_log(tmp_path / "a.csv", unit="rad", seed=7, width=width)
    answer, _ = discover_logs([log], (), model)
    found = {row.effect: row.parameters for row in answer.ranking if row.effect in answer.sure}
    assert set(found) == {"axis_friction", "axis_damping"}
    assert found["axis_friction"]["F_c"].value == pytest.approx(3.0, rel=0.1)
    assert found["axis_damping"]["F_v"].value == pytest.approx(8.0, rel=0.1)


def test_characterise_reads_foreign_columns_and_stays_where_a_model_can_be(tmp_path: Path) -> None:
    """A seal without friction: least squares alone would find a negative one."""
    log, out = cylinder_log(tmp_path / "a.csv", 3e5, coulomb=0.0), tmp_path / "out.yaml"
    text = log.read_text()
    log.write_text(text.replace("piston/F [N]", "load").replace("piston/x [m]", "way"))
    columns = {"time [s]": "time [s]", "piston/x [m]": "way", "piston/F [N]": "load",
               "chamber/extend/P [Pa]": "chamber/extend/P [Pa]"}  # fmt: skip
    listed = {name: {"source": source} for name, source in columns.items()}
    listed["piston/F [N]"] |= {"unit": "N"}
    listed["piston/x [m]"] |= {"unit": "m"}
    dump_yaml({"kind": "cylinder", "columns": listed}, tmp_path / "map.yaml")
    effects = {"kind": "seal_friction"}, {"kind": "pressure_friction"}
    words = ["characterise", log, "--model", model_file(tmp_path, CYLINDER, *effects)]
    told = CliRunner().invoke(app, [str(w) for w in (*words, "--map", tmp_path / "map.yaml",
                                                     "--out", out)])  # fmt: skip
    assert told.exit_code == 0, told.output
    found = {e.name: e for e in load_model(out).effects}
    assert 0.0 <= found["seal_friction"].value("F_c") < 0.5
    assert 0.0 <= found["pressure_friction"].value("mu") < 0.005


@pytest.mark.parametrize("scale", [1.0, 0.8])
def test_the_true_model_of_a_drive_explains_its_log_whatever_its_motor_does(
    tmp_path: Path, scale: float
) -> None:
    """A scale of the motor is part of the prediction, also beside figures within tolerance."""
    listed = [{"kind": "axis_friction", "F_c": 3.0}, {"kind": "axis_damping", "F_v": 8.0}]
    listed += [{"kind": "axis_scale", "k": scale}] if scale != 1.0 else []
    log = drive_log(tmp_path / "a.csv", scale=scale)
    found, problem = compare_logs([log], model_file(tmp_path, DRIVE, *listed))
    assert found.noise_ratio == pytest.approx(1.0, abs=0.3)
    nominal = {name: value for name, (value, _) in problem.nuisance.items()}
    assert np.allclose(problem.residual(nominal), problem.residual({}))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_missing_from_a_complete_drive(tmp_path: Path, seed: int) -> None:
    effects = {"kind": "axis_friction", "F_c": 3.0}, {"kind": "axis_damping", "F_v": 8.0}
    model = model_file(tmp_path, DRIVE, *effects)
    answer, _ = discover_logs([drive_log(tmp_path / "a.csv", seed=seed)], (), model)
    assert answer.verdict == "nothing", answer.sentence


def test_a_pendulum_is_characterised(tmp_path: Path) -> None:
    log = drive_log(tmp_path / "a.csv", 0.5, 1.0, 2.0, weight=1.5 * 9.81 * 0.2, unit="rad")
    rig = {"kind": "drive", "motion": "rotary", "inertia": "0.40 kg.m2",
           "load": {"mass": "1.5 kg", "arm": "0.2 m"}}  # fmt: skip
    found = characterise_logs([log], model_file(
        tmp_path, rig, {"kind": "axis_friction"}, {"kind": "axis_damping"}))  # fmt: skip
    figures = {f.name: f for f in found.figures}
    assert figures["drive_axis.J"].unit == "kg.m2"
    assert figures["drive_axis.J"].value == pytest.approx(0.5 - 1.5 * 0.2**2, rel=0.03)
    assert figures["axis_friction.F_c"].value == pytest.approx(1.0, rel=0.05)
    assert figures["axis_damping.F_v"].low < 2.0 < figures["axis_damping.F_v"].high
    out = tmp_path / "fitted.yaml"
    found.write_model(out, str(tmp_path / "model.yaml"))
    fitted = load_model(out)
    assert fitted.parameters["drive_axis.J"][1] == float(f"{figures['drive_axis.J'].value:.6g}")
    assert fitted.mechanism.rig == "drive"
    before, _ = compare_logs([log], str(tmp_path / "model.yaml"))
    after, _ = compare_logs([log], str(out))
    assert after.noise_ratio < 1.1 and before.noise_ratio > 1.8


@pytest.mark.parametrize("turns", [3.0, 35.0])
def test_a_pendulum_that_turns_fast_is_as_exact_as_a_slow_one(turns: float, tmp_path: Path) -> None:
    """Within the filter it turns by half a radian: sin(q) behind it is not sin of what is."""
    log = turning_log(tmp_path / "a.csv", turns)
    rig = {"kind": "drive", "motion": "rotary", "inertia": "0.02 kg.m2",
           "load": {"mass": "1.5 kg", "arm": "0.25 m"}}  # fmt: skip
    whole = {"kind": "axis_friction", "F_c": 0.4}, {"kind": "axis_damping", "F_v": 0.05}
    found, _ = compare_logs([log], model_file(tmp_path, rig, *whole))
    assert found.good and found.noise_ratio == pytest.approx(1.0, abs=0.1)
    figures = {f.name: f.value for f in characterise_logs([log], model_file(
        tmp_path, rig, {"kind": "axis_friction"}, {"kind": "axis_damping"})).figures}  # fmt: skip
    assert figures["axis_friction.F_c"] == pytest.approx(0.4, rel=0.02)
    assert figures["axis_damping.F_v"] == pytest.approx(0.05, rel=0.04)
    assert figures["drive_axis.J"] == pytest.approx(0.02, rel=0.06)


def logs_of_a_cylinder(folder: Path, **friction: float) -> list[Path]:
    return [
        cylinder_log(folder / f"{bar}bar.csv", 1e5 * bar, seed=bar, **friction) for bar in (1, 3, 6)
    ]


@pytest.mark.nightly
def test_constant_and_growing_friction_of_a_cylinder_are_told_apart(tmp_path: Path) -> None:
    logs = logs_of_a_cylinder(tmp_path, coulomb=4.0, mu=0.02)
    effects = {"kind": "seal_friction"}, {"kind": "pressure_friction"}
    found = characterise_logs(logs, model_file(tmp_path, CYLINDER, *effects))
    figures = {f.name: f.value for f in found.figures}
    assert figures["seal_friction.F_c"] == pytest.approx(4.0, rel=0.05)
    assert figures["pressure_friction.mu"] == pytest.approx(0.02, rel=0.05)
    assert figures["measured_chambers.gain"] == pytest.approx(1.0, abs=0.002)


@pytest.mark.nightly
def test_friction_of_a_cylinder_is_found_in_logs_with_gaps(tmp_path: Path) -> None:
    answer, _ = discover_logs(logs_of_a_cylinder(tmp_path), (), model_file(tmp_path, CYLINDER))
    assert answer.ranking[0].effect == "seal_friction", answer.sentence
    assert answer.ranking[0].parameters["F_c"].value == pytest.approx(4.0, rel=0.1)
    assert any("gap" in remark for remark in answer.remarks) or answer.verdict == "missing"


@pytest.mark.nightly
def test_nothing_is_missing_from_a_complete_cylinder(tmp_path: Path) -> None:
    model = model_file(tmp_path, CYLINDER, {"kind": "seal_friction", "F_c": 4.0})
    answer, _ = discover_logs(logs_of_a_cylinder(tmp_path), (), model)
    assert answer.verdict == "nothing", answer.sentence


@pytest.mark.nightly
def test_heat_of_the_wall_is_found(tmp_path: Path) -> None:
    answer, _ = discover_logs([vessel_log(tmp_path / "a.csv")], (), model_file(tmp_path, VESSEL))
    assert answer.ranking[0].effect == "wall_heat", answer.sentence
    assert answer.ranking[0].parameters["h"].value == pytest.approx(4.0, rel=0.15)


def test_nothing_is_missing_from_a_complete_vessel(tmp_path: Path) -> None:
    model = model_file(tmp_path, VESSEL, {"kind": "wall_heat", "h": 4.0})
    answer, _ = discover_logs([vessel_log(tmp_path / "a.csv")], (), model)
    assert answer.verdict == "nothing", answer.sentence


def test_a_rigs_log_needs_its_model(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match="log of a drive rig"):
        compare_logs([drive_log(tmp_path / "a.csv", seconds=1.0)])


@pytest.mark.parametrize(
    "unit, words", [("bar", "SI units"), ("gauge", "pascals, absolute")], ids=["unit", "gauge"]
)
def test_pressures_that_cannot_be_are_refused(tmp_path: Path, unit: str, words: str) -> None:
    path = cylinder_log(tmp_path / "a.csv", 1e5)
    head, *rows = path.read_text().splitlines()
    if unit == "bar":
        head = head.replace("chamber/extend/P [Pa]", "chamber/extend/P [bar]")
    else:
        rows = [f"{row.rsplit(',', 1)[0]},1.02" for row in rows]
    path.write_text("\n".join([head, *rows]))
    with pytest.raises(KembaError, match=words):
        compare_logs([path], model_file(tmp_path, CYLINDER))


@pytest.mark.parametrize(
    "rig, words",
    [
        ({**CYLINDER, "rod": "25 mm"}, "thinner"),
        ({"kind": "drive", "inertia": "2 kg", "load": {"mass": 1.0, "arm": 0.1}}, "arm"),
        ({"kind": "drive", "inertia": "2 N"}, "inertia"),
        ({"kind": "piston"}, "rig"),
    ],
    ids=["rod", "arm", "unit", "kind"],
)
def test_rigs_that_cannot_be_are_refused(tmp_path: Path, rig: dict, words: str) -> None:
    with pytest.raises(KembaError, match=words):
        load_model(model_file(tmp_path, rig))


@pytest.mark.nightly
def test_published_figures_of_emps_are_within_the_intervals(tmp_path: Path) -> None:
    real("emps/DATA_EMPS.mat")
    reader().emps().write(tmp_path / "emps.csv")
    kinds = ("axis_friction", "axis_damping", "axis_offset")
    rig = {"kind": "drive", "inertia": "95 kg"}
    model = model_file(tmp_path, rig, *({"kind": kind} for kind in kinds))
    figures = {f.name: f for f in characterise_logs([tmp_path / "emps.csv"], model).figures}
    for name, published in {"axis_friction.F_c": 20.39, "axis_damping.F_v": 203.5}.items():
        assert figures[name].low < published < figures[name].high
    assert figures["drive_axis.J"].value == pytest.approx(95.11, rel=0.01)


@pytest.mark.nightly
@pytest.mark.parametrize("seal, constant, growing", [("O-ring", 3.4, 0.0133), ("KDN", 5.3, 0.004)])
def test_real_seals_are_told_apart(
    tmp_path: Path, seal: str, constant: float, growing: float
) -> None:
    logs = []
    for bar in (1, 3, 5, 7):
        real(f"cylinder/{seal}_{bar}bar.csv")
        logs.append(tmp_path / f"{bar}.csv")
        reader().cylinder(seal, bar).write(logs[-1])
    effects = {"kind": "seal_friction"}, {"kind": "pressure_friction"}
    found = characterise_logs(logs, model_file(tmp_path, CYLINDER, *effects))
    figures = {f.name: f.value for f in found.figures}
    # by hand, from half the difference of the two directions; mountings differ by 12 %
    assert figures["seal_friction.F_c"] == pytest.approx(constant, rel=0.12)
    assert figures["pressure_friction.mu"] == pytest.approx(growing, abs=0.002)


def test_intervals_know_of_errors_that_every_repeat_repeats(tmp_path: Path) -> None:
    """A drive with cogging that its model lacks, in a motion that repeats twelve times: blocks of
    time as long as a repeat show no scatter at all."""
    truth = {"drive_axis.J": 2.0, "axis_friction.F_c": 3.0, "axis_damping.F_v": 8.0}
    effects = {"kind": "axis_friction"}, {"kind": "axis_damping"}
    model, inside = model_file(tmp_path, DRIVE, *effects), 0
    for seed in range(4):
        found = characterise_logs([cogging_log(tmp_path / "a.csv", seed)], model)
        inside += sum(f.low < truth[f.name] < f.high for f in found.figures if f.name in truth)
    assert inside >= 11
