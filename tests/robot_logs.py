"""Short hops of the blind twin as logs: quick to make, with every phase in them."""

import numpy as np
from twin import cases, figures, measure, run, scripts

from kemba.trajectory import Trajectory

FRONT_E, FRONT_R, REAR_E, REAR_R = range(4)


def hop(seed: int, duration: float = 0.8) -> scripts.Script:
    """Push off, draw the legs in, land: pulses and hip references drawn anew per seed."""
    rng = np.random.default_rng(seed)
    ticks = scripts.clock(duration, 1000.0, 2e-5, rng)
    on, width, skew = 0.04 + 0.02 * rng.random(), 0.1 + 0.06 * rng.random(), 0.003 * rng.normal()
    pulses = [(FRONT_E, on, on + width), (REAR_E, on, on + width + skew)]
    if seed % 2:
        pulses += [(FRONT_R, 0.30, 0.34), (REAR_R, 0.31, 0.36)]
        pulses += [(FRONT_E, 0.38, 0.40), (REAR_E, 0.40, 0.42), (FRONT_E, 0.55, 0.7)]
    else:
        pulses += [(FRONT_R, 0.25, 0.30), (REAR_R, 0.25, 0.30)]
        pulses += [(FRONT_E, 0.52, 0.56), (REAR_E, 0.50, 0.54), (FRONT_R, 0.54, 0.58)]
    knots = [
        (0.0, 0.0, 0.0),
        (0.25, 0.0, 0.0),
        (0.35, *(0.2 * rng.normal(size=2))),
        (0.5, *(0.1 * rng.normal(size=2))),
        (duration, 0.0, 0.0),
    ]
    return scripts.script(f"hop{seed}", ticks, pulses, offsets=knots)


def hops(
    *effects: dict,
    runs: int = 3,
    seed: int = 0,
    figures_off: float = 0.0,
    pushes: np.ndarray | None = None,
    faults: tuple[dict, ...] = (),
    sensors: measure.Sensors | None = None,
) -> tuple[list[Trajectory], list[np.ndarray]]:
    """Logs with hidden `effects`, and per run the forces (n, 7) of `pushes` (1 sigma) in them."""
    rng = np.random.default_rng(seed)
    robot = figures.Robot().jittered(rng, figures_off)
    logs, forces = [], []
    for i in range(runs):
        script = hop(seed + i)
        push = cases.coloured(script.ticks, np.zeros(7) if pushes is None else pushes, rng)
        truth = run.simulate(script, list(effects), robot, pushes=push)
        columns = measure.robot_log(truth, sensors or measure.Sensors(), faults, rng)
        time = columns.pop("time [s]")
        logs.append(Trajectory(time, columns, {"kind": "robot", "name": f"hop{i}"}))
        forces.append(push)
    return logs, forces
