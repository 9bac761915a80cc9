"""Lengths that differ from the drawing: the model with them is the model of the other robot."""

from pathlib import Path

import numpy as np
import pytest

from kemba.effects.mechanics.geometry import SIZES, Geometry
from kemba.errors import KembaError
from kemba.mechanism import load_robot
from kemba.mechanism.robot_file import find_file
from kemba.model import Model, load_model

PARTS = sorted(SIZES)


def other_robot(folder: Path, part: str, d: float) -> Path:
    """A model of kemba whose robot file has one length more by `d` [m]."""
    leg = load_robot("kemba").leg
    row, name = part.split("/")
    old = getattr(getattr(leg, row), name)
    text = find_file("kemba", "robots").read_text(encoding="utf-8")
    assert text.count(f"{name}: {old:.3f} m") == 1
    new = text.replace(f"{name}: {old:.3f} m", f"{name}: {old + d:.9f} m")
    (folder / "other_robot.yaml").write_text(new, encoding="utf-8")
    (folder / "other.yaml").write_text("base: planning\nrobot: other_robot.yaml\n")
    return folder / "other.yaml"


def values(model: Model, free: tuple[str, ...] = (), p: tuple[float, ...] = ()) -> list[np.ndarray]:
    """Dynamics and outputs at a bent and moving pose."""
    node, rng = model.build(free), np.random.default_rng(5)
    q = np.array([0.1, 0.4, 0.05, -0.4, 0.5, 1.4, -1.3])
    v, a = rng.standard_normal(7), rng.standard_normal(7)
    s, lam, u = (np.ones(k.numel()) for k in (node.s, node.lam, node.u))
    given = (q, v, a, s, 0 * s, lam, u, p)
    return [x.full().ravel() for x in (*node.residual(*given)[:2], node.measure(*given))]


@pytest.mark.parametrize("part", PARTS)
def test_it_is_the_robot_with_that_length(part: str, tmp_path: Path) -> None:
    d = 0.4 * SIZES[part]
    wanted = values(load_model(other_robot(tmp_path, part, d)))
    key = f"geometry:{part}.d"
    listed = load_model("planning", extra=[Geometry(part=part, d=d)])
    absent = load_model("planning", extra=[Geometry(part=part)])
    for found in (values(listed), values(absent, (key,), (d,))):
        for have, want in zip(found, wanted, strict=True):
            np.testing.assert_allclose(have, want, rtol=1e-9, atol=1e-9)
    changed = values(load_model("planning"))
    assert max(np.abs(a - b).max() for a, b in zip(changed, wanted, strict=True)) > 1e-5


def test_lengths_do_not_add_up_when_a_model_is_built_again() -> None:
    once = load_model("planning", extra=[Geometry(part="femur/length", d=0.003)])
    twice = once.with_effects(once.effects)
    assert twice.mechanism.need_robot().leg.femur.length == pytest.approx(0.245)
    none = Model(once.mechanism, [e for e in once.effects if e.kind != "geometry"])
    assert none.mechanism.need_robot().leg.femur.length == 0.242


def test_a_rig_has_no_such_lengths() -> None:
    rig = load_model("planning", extra=[Geometry(part="femur/length", d=0.003)], rig=True)
    assert rig.mechanism.n == 1


def test_impossible_lengths_say_which(tmp_path: Path) -> None:
    for d, text in (("-300 mm", "leaves nothing"), ("30 mm", "cannot reach")):
        file = tmp_path / "wrong.yaml"
        listed = f"  - {{kind: geometry, part: femur/length, d: {d}}}\n"
        file.write_text(f"base: planning\neffects:\n{listed}", encoding="utf-8")
        with pytest.raises(KembaError, match=text) as caught:
            load_model(file)
        assert "geometry:femur/length" in str(caught.value) and ":3:" in str(caught.value)


def test_an_unknown_part_names_the_nearest() -> None:
    with pytest.raises(ValueError, match="femur/length"):
        Geometry(part="femur/lenght")
