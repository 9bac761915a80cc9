"""Tolerances of links: declared with the link table, exact in their force, read by discover."""

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from kemba.config import shipped_configs
from kemba.errors import KembaError
from kemba.identify.problem.candidates import link_figures
from kemba.mechanism.recursion import link_forces, read_joints
from kemba.mechanism.robot import build_pin_model, link_regressors, robot_mechanism
from kemba.mechanism.robot_file import load_robot
from kemba.model import load_model


def own(tmp_path: Path, lines: str) -> Path:
    """A robot file: the shipped one and some lines more."""
    text = shipped_configs("robots")["kemba.yaml"].read_text(encoding="utf-8")
    (tmp_path / "own.yaml").write_text(f"{text}{lines}\n", encoding="utf-8")
    return tmp_path / "own.yaml"


@pytest.mark.parametrize(("name", "links"), [("kemba", 9), ("monoped", 5), ("hound", 9)])
def test_every_link_has_tolerances_that_matter(name: str, links: int) -> None:
    mechanism = robot_mechanism(load_robot(name))
    assert len(mechanism.tolerances) == 2 * links
    assert set(mechanism.tolerances.values()) == {0.02}
    rng = np.random.default_rng(0)
    q = [mechanism.standing[c.name] for c in mechanism.coordinates]
    columns = np.array(link_regressors(mechanism)(q, *rng.normal(size=(2, mechanism.n))))
    assert columns.shape == (mechanism.n, 2 * links)
    assert np.all(np.abs(columns).max(axis=0) > 1e-6)


def test_the_shares_add_up_to_the_whole_robot() -> None:
    """All links off by one share each: the rigid-body force of pinocchio, without the rotors."""
    robot = load_robot("kemba")
    still = robot.model_copy(update={"leg": robot.leg.model_copy(update={"rotor_inertia": 0.0})})
    model = build_pin_model(still)
    tree, rate, acc = np.random.default_rng(1).normal(size=(3, model.nv)) * 0.3
    figures = list(robot_mechanism(robot).tolerances)
    joints = read_joints(build_pin_model(robot))
    motion = (ca.SX(tree), ca.SX(rate), ca.SX(acc))
    forces = link_forces(joints, figures, motion, robot.gravity)
    total = np.array(ca.evalf(ca.sum2(forces))).ravel()
    assert total == pytest.approx(pin.rnea(model, model.createData(), tree, rate, acc), abs=1e-9)


def test_a_robot_file_says_how_well_its_links_are_known(tmp_path: Path) -> None:
    path = own(tmp_path, "tolerances: {mass: 0.5 %, inertia: 0}")
    found = robot_mechanism(load_robot(path)).tolerances
    assert len(found) == 9 and set(found.values()) == {0.005}
    assert all(name.endswith(".mass") for name in found)
    (tmp_path / "m.yaml").write_text("name: m\nbase: planning\nrobot: own\n", encoding="utf-8")
    figures = link_figures(load_model(tmp_path / "m.yaml"))
    assert figures["tolerance.front/hip.mass"] == (0.0, 0.005)


def test_a_tolerance_that_is_no_tolerance_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match=r"tolerances.mass: '30 %' is out of range; 0 to 0.1"):
        load_robot(own(tmp_path, "tolerances: {mass: 30 %}"))


def test_a_rig_has_no_links() -> None:
    assert link_figures(load_model("planning", rig=True)) == {}
