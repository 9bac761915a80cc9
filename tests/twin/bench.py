"""The one-piston rig: x(t) is imposed, the force on the transducer is the answer."""

from dataclasses import dataclass

import numpy as np

from . import catalogue, measure, valves
from .air import N_AIR, air_rates, rod_force
from .catalogue import B_DROOP, B_DROOP_T
from .figures import ATMOSPHERE, N_PS, Robot
from .jit import njit
from .rigs import Rig


@dataclass(frozen=True)
class BenchTruth:
    rig: Rig
    times: np.ndarray
    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    air: np.ndarray
    supply: np.ndarray  # absolute pressure
    physical: bool


@njit
def _integrate(y, ticks, x, v, push, events, split, h_max, air, leg, body, physical):
    n = ticks.size - 1
    size = n * split + 1
    times, states = np.empty(size), np.empty((size, N_AIR + 1))
    forces, path = np.empty(size), np.empty((size, 2))
    dy, total, stage, u = np.zeros(N_AIR + 1), np.zeros(N_AIR + 1), np.zeros(N_AIR + 1), np.zeros(2)
    event, t, row = 0, ticks[0], 0
    for k in range(n + 1):
        for part in range(split if k < n else 1):
            while event < events.shape[0] and events[event, 0] <= t + 1e-12:
                u[int(events[event, 1])] = events[event, 2]
                event += 1
            now, speed = _path(t, ticks, x, v, k)
            times[row], states[row] = t, y
            forces[row] = rod_force(now, speed, u[0], u[1], y, air, leg, physical) + push[k]
            path[row, 0], path[row, 1] = now, speed
            row += 1
            if k == n:
                break
            stop = ticks[k] + (ticks[k + 1] - ticks[k]) * (part + 1) / split
            while t < stop - 1e-12:
                until = stop
                if event < events.shape[0] and events[event, 0] < stop:
                    until = events[event, 0]
                steps = max(1, int(np.ceil((until - t) / h_max - 1e-9)))
                h = (until - t) / steps
                for _ in range(steps):
                    for i in range(y.size):
                        stage[i], total[i] = y[i], 0.0
                    for c in range(4):
                        at = t + (0.0 if c == 0 else h if c == 3 else 0.5 * h)
                        now, speed = _path(at, ticks, x, v, k)
                        need = air_rates(now, speed, u[0], u[1], stage, stage[N_AIR], air, leg,
                                         physical, dy)  # fmt: skip
                        dy[N_AIR] = 0.0
                        if body[B_DROOP] != 0.0:
                            dy[N_AIR] = (1.0 - stage[N_AIR]) / body[B_DROOP_T] - body[
                                B_DROOP
                            ] * need
                        weight = 1.0 if c == 0 or c == 3 else 2.0
                        reach = h if c == 2 else 0.5 * h
                        for i in range(y.size):
                            total[i] += weight * dy[i]
                            stage[i] = y[i] + reach * dy[i]
                    for i in range(y.size):
                        y[i] += h / 6.0 * total[i]
                    t += h
                t = until
                while event < events.shape[0] and events[event, 0] <= t + 1e-12:
                    u[int(events[event, 1])] = events[event, 2]
                    event += 1
            t = stop
    return times, states, forces, path


@njit
def _path(t, ticks, x, v, k):
    """Cubic Hermite through the imposed positions and speeds."""
    if k >= ticks.size - 1:
        return x[k], v[k]
    h = ticks[k + 1] - ticks[k]
    s = (t - ticks[k]) / h
    d = x[k + 1] - x[k]
    a, b = h * v[k] - d, d - h * v[k + 1]
    now = x[k] + s * d + s * (1.0 - s) * ((1.0 - s) * a + s * b)
    speed = (d + (1.0 - 2.0 * s) * ((1.0 - s) * a + s * b) + s * (1.0 - s) * (b - a)) / h
    return now, speed


def simulate(
    rig: Rig,
    effects: list[dict] = (),
    robot: Robot | None = None,
    chambers: str = "first_order",
    step: float = 50e-6,
    split: int = 2,
    push: np.ndarray | None = None,
) -> BenchTruth:
    """What the transducer truly sees."""
    robot = robot or Robot()
    physical = {"first_order": False, "orifice": True}[chambers]
    leg, body, late = catalogue.tables(list(effects))
    y = np.zeros(N_AIR + 1)
    y[N_AIR] = 1.0
    if physical:
        y[0] = y[1] = ATMOSPHERE
    push = np.zeros(rig.ticks.size) if push is None else push
    times, states, forces, path = _integrate(
        y, rig.ticks, rig.x, rig.v, push, valves.events(rig.ticks, rig.sent, late), split, step,
        robot.air[0], leg[0], body, physical,
    )  # fmt: skip
    gauge = leg[0, catalogue.L_SUPPLY] * (robot.air[0, N_PS] - ATMOSPHERE)
    supply = ATMOSPHERE + states[:, N_AIR] * gauge
    return BenchTruth(
        rig, times, path[:, 0], path[:, 1], forces, states[:, :N_AIR], supply, physical
    )


def bench_log(truth: BenchTruth, sensors, faults=(), rng=None) -> dict[str, np.ndarray]:
    """Columns of a bench log, one row per tick."""
    rng = rng or np.random.default_rng(0)
    rig = truth.rig
    signals = {"piston/x": truth.x, "piston/F": truth.force}
    if sensors.velocities:
        signals["piston/v"] = truth.v
    if sensors.pressures:
        extend, retract = measure.pressures(truth.air, truth.physical)
        signals["chamber/extend/P"], signals["chamber/retract/P"] = extend, retract
        signals["supply/P"] = truth.supply
    columns = {"time [s]": measure.time_stamps(rig.ticks, sensors, rng)}
    for channel, value in signals.items():
        columns[measure.header(channel)] = measure.read(
            channel, rig.ticks, truth.times, value, sensors, faults, rng
        )
    columns["valve/extend [1]"], columns["valve/retract [1]"] = rig.sent[:, 0], rig.sent[:, 1]
    return columns
