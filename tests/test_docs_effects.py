"""The pages about effects: their code runs, their tables are those of the code."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from kemba.config import parse
from kemba.config.document import load_text
from kemba.effects.describe import page
from kemba.effects.mechanics.piston import PistonDamping, SealFriction
from kemba.effects.pneumatics.hose import HoseLag
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import SupplyLine
from kemba.effects.pneumatics.valve import Valve
from kemba.errors import KembaError
from kemba.mechanism import load_cylinder, rig_mechanism
from kemba.model import Model, load_model
from kemba.model.spec import ModelSpec

DOCS = Path(__file__).parent.parent / "docs"


def blocks(name: str, language: str) -> list[str]:
    """The code blocks of a page in one language."""
    text = (DOCS / name).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_the_catalogue_is_that_of_the_code() -> None:
    written = (DOCS / "effects.md").read_text(encoding="utf-8")
    assert written == page(), "run: kemba-opt effects --markdown > docs/effects.md"


def test_the_class_of_extending_runs_and_dissipates(tmp_path: Path) -> None:
    effect, use = blocks("extending.md", "python")
    assert len(effect.splitlines()) <= 40
    script = tmp_path / "extending.py"
    script.write_text(effect + use, encoding="utf-8")
    found = runpy.run_path(str(script), run_name="extending")
    model = found["model"]
    assert [q.name for q in model.states.values()].count("front/seal/z") == 1
    rig = load_model("planning", extra=[found["SealHysteresis"](F_h=10.0)], rig=True)
    names = [q.name for q in rig.states.values()]
    s = np.zeros(len(names))
    s[names.index("seal/z")] = 1.0
    node = rig.node
    measured = node.measure(q=0.03, v=0.0, a=0, s=s, sd=s, lam=[], u=[0, 0], p=[])["y"]
    assert float(measured[[o.name for o in node.output_quantities].index("piston/F")]) == -10.0


def test_the_formula_of_extending_runs(tmp_path: Path) -> None:
    text, _ = blocks("extending.md", "yaml")
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    labels = [i.label for i in load_model(tmp_path / "mine.yaml").instances]
    assert "front/magnet" in labels and "front/contact" in labels


def test_the_message_of_extending_is_the_real_one() -> None:
    text = (
        "effects:\n  - kind: motor\n  - kind: end_stop\n"
        "  - {kind: expression, name: drag, on: piston, force: 'F*tanh(v/0.1)', "
        "parameters: {F: 1 N}}\n"
    )
    with pytest.raises(KembaError) as caught:
        parse(load_text(text, "mine.yaml"), ModelSpec)
    message = blocks("extending.md", "text")[0].strip()
    assert message.split("]: ")[1] in str(caught.value)


def test_fitted_chambers_meet_tables_1_and_2_as_documented() -> None:
    """Every entry within what docs/physics.md admits."""
    losses = [SupplyLine(), HoseLag(T=1e-3), SealFriction(F_c=5.9), PistonDamping(c=20.0)]
    chamber = OrificeChamber(V_r=15.0e-6)
    rig = Model(rig_mechanism(load_cylinder("dsnu-25-70")), [Valve(), chamber, *losses])
    allowed = {"[ms]": lambda paper: 0.07 * paper + 0.1, "[N]": lambda _: 13.5}
    script = runpy.run_path(str(DOCS.parent / "benchmarks" / "fit_chambers.py"))
    for entry, paper, found, _ in script["table"](rig):
        width = allowed.get(entry.split()[-1], lambda _: 10.0)(paper)
        assert found == pytest.approx(paper, abs=width), entry
