"""The shipped robot and a stranger, with their opened trees and random states."""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
import pinocchio as pin

from kemba.mechanism import Mechanism, Robot, load_robot, robot_mechanism
from kemba.mechanism.robot import build_pin_model, tree_angles

NAMES = ("kemba", "stranger")


def stranger() -> Robot:
    """Another link table: three legs, other lengths and masses, weak gravity, no symmetry."""
    data = load_robot("kemba").model_dump()
    leg = data["leg"]
    leg["femur"] |= {"length": 0.3, "com": 0.12, "mass": 0.5}
    leg["tibia"] |= {"length": 0.27, "com": 0.14, "inertia": 0.003}
    leg["rod"] |= {"com": 0.05, "mass": 0.2}
    leg["piston"] |= {"mount": 0.04, "pin": 0.06, "retracted": 0.26}
    data["cylinder"] |= {"stroke": 0.08}
    leg["rotor_inertia"] = 0.02
    data["legs"] = {
        "front": {"hip": 0.2, "fold": 1},
        "middle": {"hip": -0.05, "fold": 1},
        "rear": {"hip": -0.31, "fold": -1},
    }
    return Robot.model_validate({**data, "name": "stranger", "gravity": 3.7})


@dataclass(frozen=True)
class Case:
    """A robot seen by both: our mechanism, pinocchio's tree, and the map between their angles."""

    robot: Robot
    mechanism: Mechanism
    tree: pin.Model
    opened: ca.Function  # q, v, a -> the tree's q, its Jacobian by ours, the tree's v and a
    inverse_dynamics: ca.Function

    def state(self, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A random pose within the coordinates' bounds, with rates and accelerations."""
        rng, m = np.random.default_rng(seed), self.mechanism
        low, high = (
            np.array([max(min(getattr(c, end), 2.0), -2.0) for c in m.coordinates])
            for end in ("lower", "upper")
        )
        return rng.uniform(low, high), 3.0 * rng.normal(size=m.n), 20.0 * rng.normal(size=m.n)

    def open(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> list[np.ndarray]:
        """The tree's q, Phi, v and a."""
        q_tree, phi, v_tree, a_tree = (np.array(part) for part in self.opened(q, v, a))
        return [q_tree.ravel(), phi, v_tree.ravel(), a_tree.ravel()]


@lru_cache(maxsize=2)
def case(name: str) -> Case:
    """A robot by name."""
    robot = load_robot("kemba") if name == "kemba" else stranger()
    mechanism = robot_mechanism(robot)
    q, v, a = mechanism.q, mechanism.v, mechanism.a
    tree = tree_angles(robot, q)
    phi = ca.jacobian(tree, q)
    v_tree = ca.mtimes(phi, v)
    a_tree = ca.mtimes(phi, a) + ca.mtimes(ca.jacobian(v_tree, q), v)
    return Case(
        robot,
        mechanism,
        build_pin_model(robot),
        ca.Function("opened", [q, v, a], [tree, phi, v_tree, a_tree]),
        ca.Function("inverse_dynamics", [q, v, a], [mechanism.inverse_dynamics]),
    )
