"""Plan runs: the nominal robot with feedback on the knees, recorded as an open-loop script.

An operator would send a planned trajectory; here a crude on/off rule on each knee plays planner.
Its valve switches and hip angles become the script that the (defective) robot then executes blind.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import catalogue, layout, loads, machine
from .bodies import NQ
from .control import R_COUNT, R_FOLLOW, R_KD, R_KP, R_Q, R_QD, R_TAU
from .figures import DEAD_TIME, Robot, leg_fold
from .run import STEP, initial_state, scalars
from .scripts import KD, KP, Script, Start

_X = np.linspace(0.0, 0.07, 71)
_L = np.array([leg_fold(x)[0] for x in _X])
_SLOPE = np.gradient(_L, _X)
_FOLD = np.array([leg_fold(x)[1] for x in _X])
_HALF_MASS, _HALF_WEIGHT, _KNEE_MASS = 2.6, 28.0, 1.2
DWELL = 0.012  # shortest time between two switches of a valve (s)


@dataclass
class Sight:
    """What the planner sees at a tick."""

    t: float
    y: np.ndarray  # x, z, pitch, hips, pistons
    w: np.ndarray
    feet: np.ndarray  # (2, 2)
    force: np.ndarray  # (2, 2) chambers of each leg

    @property
    def airborne(self) -> bool:
        return bool(self.feet[:, 1].min() > 1.5e-3)


@dataclass
class Demand:
    """What the planner wants: per leg a piston reference (or fixed valves), and hip angles."""

    x: tuple[float, float] = (0.0, 0.0)
    v: tuple[float, float] = (0.0, 0.0)
    valves: tuple[int, int, int, int] | None = None
    hips: tuple[float, float] | None = None  # None: the foot follows under the hip
    hip_rates: tuple[float, float] = (0.0, 0.0)
    hip_offset: tuple[float, float] = (0.0, 0.0)
    stiff: float = 16.0  # bandwidth of the knee rule (rad/s)
    airborne: bool = False
    both: bool = False  # hold small forces with both valves on


def fold_of(x: float) -> float:
    return float(np.interp(x, _X, _FOLD))


def slope_of(x: float) -> float:
    """Leg length per piston extension."""
    return float(np.interp(x, _X, _SLOPE))


def length_of(x: float) -> float:
    return float(np.interp(x, _X, _L))


def knee_rule(leg: int, demand: Demand, see: Sight) -> tuple[bool, bool]:
    """Extend, retract: on/off so that the force chases what the reference asks for."""
    x, v = see.y[5 + leg], see.w[5 + leg]
    ahead = x + 0.01 * v
    gear = slope_of(ahead)
    mass = _KNEE_MASS + (0.0 if demand.airborne else _HALF_MASS * gear**2)
    weight = 0.0 if demand.airborne else _HALF_WEIGHT * gear
    accel = demand.stiff**2 * (demand.x[leg] - ahead) + 1.6 * demand.stiff * (demand.v[leg] - v)
    force = mass * accel + weight + 40.0 * v
    extend = force > see.force[leg, 0] + 15.0
    if demand.both and 0.0 < force < 150.0:
        return True, True
    # retract only when clearly asked for, or with both valves on as a brake
    retract = force < -60.0 - see.force[leg, 1] or (
        force < 60.0 and v > 0.25 and not demand.airborne
    )
    return bool(extend), bool(retract)


def record(
    name: str,
    ticks: np.ndarray,
    start: Start,
    goal: Callable[[Sight], Demand],
    kp: float = KP,
    kd: float = KD,
    stop: Callable[[Sight], bool] | None = None,
) -> Script:
    """Run the nominal robot under `goal` and write down what was sent."""
    robot = Robot()
    leg_table, body_table = catalogue.neutral_tables()
    figures = scalars(robot, False, True)
    y, u = initial_state(start, False), np.zeros(4)
    anchor = np.ascontiguousarray(layout.feet(y[:NQ])[:, 0])
    n = ticks.size
    sent, commands = np.zeros((n, 4)), np.zeros((n, 2))
    hips, speeds = np.zeros((n, 2)), np.zeros((n, 2))
    changed, pending = np.full(4, -1.0), []
    no_push = np.zeros((2, 7))
    for k in range(n):
        see = _look(ticks[k], y)
        if stop is not None and stop(see):
            n = k
            break
        demand = goal(see)
        want = demand.valves or [w for leg in range(2) for w in knee_rule(leg, demand, see)]
        for i in range(4):
            before = sent[k - 1, i] if k else 0.0
            sent[k, i] = before
            if float(want[i]) != before and ticks[k] - changed[i] >= DWELL:
                sent[k, i], changed[i] = float(want[i]), ticks[k]
                pending.append((ticks[k] + DEAD_TIME, i, float(want[i])))
        hips[k], speeds[k] = see.y[3:5], see.w[3:5]
        if k == ticks.size - 1:
            break
        due = [e for e in pending if e[0] < ticks[k + 1]]
        pending = [e for e in pending if e[0] >= ticks[k + 1]]
        row = _row(demand, kp, kd)
        *_, command, _ = machine.integrate(
            y, u, anchor, ticks[k : k + 2], 1, STEP, np.stack([row, row]), no_push,
            np.array(due, dtype=float).reshape(-1, 3), robot.mass, robot.inertia, figures,
            robot.air, leg_table, body_table,
        )  # fmt: skip
        commands[k] = command[0]
    refs = np.zeros((n, R_COUNT))
    refs[:, R_Q : R_Q + 2] = _smooth(hips[:n])
    refs[:, R_QD : R_QD + 2] = _smooth(speeds[:n])
    refs[:, R_TAU : R_TAU + 2] = _smooth(commands[:n])
    refs[:, R_KP], refs[:, R_KD] = kp, kd
    return Script(name, ticks[:n].copy(), refs, sent[:n].copy(), start)


def _look(t: float, y: np.ndarray) -> Sight:
    pose, rate = layout.measured(y[:NQ], y[NQ : 2 * NQ])
    air = y[loads.AIR : loads.SUPPLY].reshape(2, -1)[:, :2]
    return Sight(float(t), pose, rate, layout.feet(y[:NQ]), air)


def _row(demand: Demand, kp: float, kd: float) -> np.ndarray:
    row = np.zeros(R_COUNT)
    row[R_KP], row[R_KD] = kp, kd
    if demand.hips is None:
        row[R_FOLLOW] = 1.0
        row[R_Q : R_Q + 2] = demand.hip_offset
    else:
        row[R_Q : R_Q + 2] = demand.hips
        row[R_QD : R_QD + 2] = demand.hip_rates
    return row


def _smooth(columns: np.ndarray, width: int = 7) -> np.ndarray:
    """Moving average: nobody would send the spikes of an impact."""
    pad = np.pad(columns, ((width // 2, width // 2), (0, 0)), mode="edge")
    kernel = np.ones(width) / width
    return np.stack([np.convolve(c, kernel, mode="valid") for c in pad.T], axis=1)
