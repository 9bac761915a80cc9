"""Robot files: how they are found, what they may hold, and who reads them."""

import re
from pathlib import Path

import pytest

from kemba.config import shipped_configs
from kemba.errors import KembaError
from kemba.mechanism import load_cylinder, load_robot
from kemba.mechanism.robot_file import find_file, robot_files
from kemba.model import load_model, load_spec
from kemba.model.spec import model_files, own_robot

ROOT = Path(__file__).parents[2]
KEMBA = shipped_configs("robots")["kemba.yaml"]
READS = re.compile(r"load_robot|robot_files|find_file|\"robots\"|'robots'")
# The loader, the room's list of names, what turns a model's YAML into a model, and what names
# another robot than the task's, checks a robot's file that the user gives, or notes and
# compares its checksum.
ALLOWED = {
    "kemba/mechanism/robot_file.py",
    "kemba/mechanism/__init__.py",
    "kemba/model/spec.py",
    "kemba/plant/repeat.py",
    "kemba/identify/workflow.py",
    "kemba/solve/truth.py",
    "cli/verbs/check.py",
    "cli/schemas.py",
}


def test_no_module_but_the_loader_reads_a_robot_file() -> None:
    sources = [*ROOT.glob("kemba/**/*.py"), *ROOT.glob("cli/**/*.py")]
    found = {
        str(path.relative_to(ROOT))
        for path in sources
        if READS.search(path.read_text(encoding="utf-8"))
    }
    assert found == ALLOWED


def test_no_module_knows_the_shipped_legs_or_cylinder() -> None:
    """Names of legs and figures of the cylinder stand in files, not in code."""
    legs = re.compile(r"[\"'](front|rear)[\"'/]|STROKE\b|AREA_[ER]\b")
    guessing = ROOT / "kemba/logs/draft/words.py"  # words that foreign columns may use for legs
    for path in {*ROOT.glob("kemba/**/*.py")} - {guessing}:
        assert not legs.search(path.read_text(encoding="utf-8")), path


def write(folder: Path, name: str, **changed: str) -> Path:
    """A copy of the shipped robot with texts replaced."""
    text = KEMBA.read_text(encoding="utf-8").replace("name: kemba", f"name: {name}")
    for old, new in changed.items():
        assert old in text
        text = text.replace(old, new)
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_robot_is_found_beside_its_model_then_here_then_among_the_shipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    here, there = write(tmp_path, "mine"), write(tmp_path / "models", "mine")
    (tmp_path / "models" / "model.yaml").write_text("base: planning\nrobot: mine\n")
    assert load_spec("models/model.yaml").robot == str(there)
    there.unlink()
    assert load_spec("models/model.yaml").robot == str(here)
    (tmp_path / "models" / "model.yaml").write_text("base: planning\nrobot: hound\n")
    assert load_spec("models/model.yaml").robot == str(shipped_configs("robots")["hound.yaml"])
    assert find_file("mine.yaml", "robots") == find_file("mine", "robots") == here


def test_a_file_here_does_not_change_a_shipped_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    own = write(tmp_path, "kemba", **{"mass: 2.886 kg": "mass: 9 kg"})
    assert load_spec("planning").robot == str(KEMBA)
    (tmp_path / "model.yaml").write_text("base: planning\nrobot: kemba\n")
    assert load_spec("model.yaml").robot == str(own)
    assert own_robot("model.yaml") == str(own) and own_robot("plant") is None


def test_a_base_names_its_robot_relative_to_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = write(tmp_path / "low", "mine")
    (tmp_path / "low" / "base.yaml").write_text("base: planning\nrobot: mine.yaml\n")
    (tmp_path / "top.yaml").write_text("base: low/base.yaml\n")
    monkeypatch.chdir(tmp_path / "low")
    spec = load_spec(tmp_path / "top.yaml")
    assert spec.robot == str(own)
    files = [path.name for path in model_files(tmp_path / "top.yaml")]
    assert files == ["top.yaml", "base.yaml", "planning.yaml", "mine.yaml", "dsnu-25-70.yaml"]


def test_a_wrong_name_is_told_at_its_line(tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    path.write_text("name: mine\nbase: planning\nrobot: houndd\n")
    with pytest.raises(KembaError) as caught:
        load_spec(path)
    told = str(caught.value)
    assert told.startswith(f"{path}:3:1: robot: no such file: 'houndd'; ")
    assert "did you mean 'hound.yaml'?" in told


def test_a_model_without_a_robot_is_told(tmp_path: Path) -> None:
    (tmp_path / "model.yaml").write_text("name: mine\neffects: [{kind: valve}]\n")
    with pytest.raises(KembaError, match="robot: missing; robot: a robot's file, or base:"):
        load_model(tmp_path / "model.yaml")


def test_bases_that_form_a_circle_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("base: b\n")
    (tmp_path / "b.yaml").write_text("base: a\n")
    with pytest.raises(KembaError, match=r"b.yaml:1:1: base: leads back to this file|a.yaml:1:1"):
        load_spec(tmp_path / "a.yaml")


def test_the_shipped_cylinder_is_that_of_the_paper() -> None:
    cylinder = load_robot("kemba").cylinder
    assert cylinder == load_cylinder("dsnu-25-70")
    assert cylinder.F_extend == (287.0, 324.0, 349.0) and cylinder.fill == (0.008, 0.025)
    assert 1e6 * cylinder.area_extend == pytest.approx(490.87, abs=0.01)
    assert 1e6 * cylinder.area_retract == pytest.approx(412.33, abs=0.01)


def test_figures_scale_with_the_cylinder(tmp_path: Path) -> None:
    """Forces and damping with the area of the chamber, times with the volume of the chamber."""
    known = load_cylinder("dsnu-25-70")
    (tmp_path / "wide.yaml").write_text("like: dsnu-25-70\nbore: 32 mm\nrod: 12 mm\n")
    wide = load_cylinder(tmp_path / "wide.yaml")
    extend = (32.0**2) / 25.0**2
    retract = (32.0**2 - 12.0**2) / (25.0**2 - 10.0**2)
    assert wide.F_extend == pytest.approx([extend * F for F in known.F_extend])
    assert wide.F_retract == pytest.approx([retract * F for F in known.F_retract])
    assert wide.c_extend == pytest.approx([extend * c for c in known.c_extend])
    tube, full = known.tube, known.area_extend * known.stroke
    ratio = (tube + extend * full) / (tube + full)
    assert wide.fill == pytest.approx((0.008, 0.025 * ratio))
    assert wide.vent == pytest.approx((0.013, 0.037 * ratio))
    assert wide.stroke == known.stroke


def test_figures_that_are_given_are_not_scaled(tmp_path: Path) -> None:
    text = "like: dsnu-25-70\nbore: 32 mm\nfill: [10 ms, 30 ms]\nc_none: 40 N.s.m-1\n"
    (tmp_path / "wide.yaml").write_text(text)
    wide = load_cylinder(tmp_path / "wide.yaml")
    assert (wide.fill, wide.c_none) == ((0.01, 0.03), 40.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("like: dsnu-25-70\nrod: 25 mm\n", "the rod (0.025 m) is as thick as the bore (0.025 m)"),
        ("bore: 25 mm\n", "rod: missing"),
        ("like: dsnu-25-70\npressures: [0.5 MPa]\n", "F_extend, F_retract"),
        ("like: dsnu-25-70\nF_extend: [300 N]\n", "`F_extend` has 1 entries, `pressures` 3"),
        ("like: own.yaml\n", "leads back to this file"),
        ("like: dsnu-25-71\n", "did you mean 'dsnu-25-70.yaml'?"),
    ],
)
def test_a_wrong_cylinder_is_told(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "own.yaml").write_text(text)
    with pytest.raises(KembaError) as caught:
        load_cylinder(tmp_path / "own.yaml")
    assert told in str(caught.value)
    assert "own.yaml" in caught.value.where


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"front:": "body:"}, "'body' cannot be the name of a leg"),
        ({"retracted: 0.2057 m": "retracted: 0.4 m"}, "leg.piston: the knee cannot reach"),
        ({"like: dsnu-25-70": "like: dsnu-25-70\n  bore: 8 mm"}, "cylinder: the rod (0.01 m)"),
        ({"length: 0.234 m": "lenght: 0.234 m"}, "leg.tibia.lenght: unknown key"),
    ],
)
def test_a_wrong_robot_is_told(tmp_path: Path, change: dict[str, str], told: str) -> None:
    path = write(tmp_path, "mine", **change)
    with pytest.raises(KembaError) as caught:
        load_robot(path)
    assert told in str(caught.value) and str(path) in str(caught.value)


def test_files_of_a_robot() -> None:
    assert [path.name for path in robot_files("hound")] == ["hound.yaml", "dsnu-25-70.yaml"]


def test_an_effect_on_a_leg_that_is_not_there_is_told_at_its_line(tmp_path: Path) -> None:
    model = tmp_path / "m.yaml"
    model.write_text("base: planning\neffects:\n  - {kind: seal_friction, F_c: 5 N, on: fron}\n")
    with pytest.raises(KembaError) as caught:
        load_model(model)
    assert caught.value.where == f"{model}:3:5"
    assert "has no leg 'fron'" in caught.value.what and "'front'" in caught.value.hint
