"""Cases for testing discovery: logs with one (or two, or no) hidden effects, and the truth.

    paths, truth = robot_case(folder, effect="seal_friction", size=1.0, seed=3, runs=5)

The truth is returned and written to `truth.json` in the folder's `.truth` sub-folder, out of the
way of whoever globs for logs.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import bench, logs, measure, rigs
from .catalogue import CATALOGUE, hidden, is_sensor
from .figures import Robot
from .measure import Sensors, sensor_fault
from .motions import upright
from .repertoire import motion
from .run import Truth, simulate

ROBOT_MOTIONS = ("jump", "swing", "heave", "forward", "drop", "squat", "sway", "jump")
BENCH_TESTS = ("random", "slow", "locked", "opposed", "random")
# Coloured forces that no model has: sigma on x, z (N), pitch, hips (N m), rods (N); memory (s).
DISTURBANCE, MEMORY = np.array([0.3, 0.3, 0.02, 0.03, 0.03, 0.5, 0.5]), 0.03
# one motion more than jumps and squats, so that every effect of the catalogue shows in some log
SHOWING = ("jump", "slide", "swing", "heave", "forward", "drop", "squat", "sway")
REPEATS = 2  # of the first motion, with the same command
MOTION_SEEDS = 40  # so that a benchmark of many cases finds its motions already planned


def draw(effect, size: float, seed: int, sensors: Sensors, spread: float, on="both") -> dict:
    """One hidden effect: a name (sized, sign and amount drawn) or a ready-made mapping."""
    if isinstance(effect, dict):
        return {"on": "both"} | effect
    rng = np.random.default_rng([seed, 7])
    amount = float(size * np.exp(rng.uniform(-spread, spread)))
    if is_sensor(effect):
        sign = float(rng.choice([-1.0, 1.0])) if not effect.startswith("sensor_delay") else 1.0
        return sensor_fault(effect, sign * amount, sensors)
    entry = CATALOGUE[effect]
    sign = float(rng.choice([-1.0, 1.0])) if entry.signed else 1.0
    made = hidden(effect, sign * amount, on)
    for name in list(entry.parameters)[1:]:  # secondary figures move a little too
        made["parameters"][name] *= float(np.exp(rng.uniform(-spread, spread) / 2.0))
    return made


def floor_effects(fraction: float, rng, bench_only: bool, skip=()) -> list[dict]:
    """Every catalogue effect at about `fraction` of its size: what "nothing missing" means."""
    if fraction <= 0.0:
        return []
    out = []
    for name, entry in CATALOGUE.items():
        if not entry.known or name in skip or (bench_only and not entry.bench):
            continue
        if (
            name == "ground_compliance"
        ):  # small compliance = larger stiffness: the ground stays hard
            continue
        amount = fraction * rng.standard_normal()
        if name in ("hose_lag", "motor_lag") and abs(amount) < 0.025:
            continue  # shorter than 0.1 ms is none, and too stiff to integrate
        out.append(hidden(name, amount if entry.signed else abs(amount)))
    return out


def coloured(ticks: np.ndarray, sigma, rng, memory: float = MEMORY) -> np.ndarray:
    """AR(1) noise per column, standard deviation `sigma`, correlation time `memory`."""
    keep = np.exp(-np.median(np.diff(ticks)) / memory)
    white = rng.standard_normal((ticks.size, len(sigma)))
    out = np.empty_like(white)
    out[0] = white[0]
    for k in range(1, ticks.size):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * white[k]
    return out * np.asarray(sigma)


def robot_case(
    folder,
    effect=None,
    size: float = 1.0,
    seed: int = 0,
    runs: int = 5,
    *,
    on: str = "both",
    motions=ROBOT_MOTIONS,
    sensors: Sensors | None = None,
    rate: float = 1000.0,
    jitter: float = 2e-5,
    figures_off: float = 0.01,
    floor: float = 0.0,
    disturbance: float = 1.0,
    spread: float = 0.3,
    chambers: str = "first_order",
    scripts=None,
) -> tuple[list[Path], dict]:
    """Robot logs in `folder`.  `effect`: a name, a mapping, a list of them, or None (null case).

    `figures_off`: 1 sigma error of every nominal figure; `floor`: all other effects at this share
    of their size; `scripts`: own scripts (for instance `scripts.from_table`) instead of `motions`.
    """
    sensors = sensors or Sensors()
    chosen, faults, robot, others = _setting(
        effect, size, seed, on, sensors, spread, figures_off, floor, False
    )
    rng = np.random.default_rng([seed, 1])
    paths = []
    for run in range(runs):
        kick = np.random.default_rng([seed, 2, run])

        def execute(script, run=run, kick=kick):
            push = disturbance * coloured(script.ticks, DISTURBANCE, kick)
            present = _of_run(chosen, run, runs) + others
            return simulate(script, present, robot, chambers, pushes=push)

        if scripts is not None:
            script = scripts[run % len(scripts)]
            truth, group = execute(script), script.name
        else:
            name = motions[0] if run < REPEATS else motions[(run - REPEATS + 1) % len(motions)]
            draw_seed = int(seed % MOTION_SEEDS if run < REPEATS else rng.integers(MOTION_SEEDS))
            truth, group = _survivor(execute, name, draw_seed, rate, jitter)
        columns = measure.robot_log(truth, sensors, faults, np.random.default_rng([seed, 3, run]))
        paths.append(_write(Path(folder), "robot", run, group, columns, sensors))
    return paths, _truth(folder, "robot", seed, chosen, faults, others, chambers, robot, paths)


def _survivor(execute, name: str, seed: int, rate: float, jitter: float) -> tuple[Truth, str]:
    """Run a motion.  Where the hidden effect topples the robot, try another; else end early."""
    best: tuple[Truth, str] | None = None
    for attempt in range(8):
        if attempt > 2 and best[0].ticks.size >= 0.25 * rate:
            break
        number = seed + 1000 * attempt
        truth = upright(execute(motion(name, number, rate, jitter)))
        share = truth.ticks.size / motion(name, number, rate, jitter).ticks.size
        if share == 1.0:
            return truth, f"{name}_{number}"
        if best is None or truth.ticks.size > best[0].ticks.size:
            best = truth, f"{name}_{number}"
    if best[0].ticks.size < 0.25 * rate:
        raise RuntimeError(f"{name} {seed}: the effect topples the robot at once; make it smaller")
    return best


def bench_case(
    folder,
    effect=None,
    size: float = 1.0,
    seed: int = 0,
    runs: int = 5,
    *,
    tests=BENCH_TESTS,
    duration: float = 6.0,
    sensors: Sensors | None = None,
    rate: float = 1000.0,
    jitter: float = 2e-5,
    figures_off: float = 0.01,
    floor: float = 0.0,
    disturbance: float = 1.0,
    spread: float = 0.3,
    chambers: str = "first_order",
    robot: Robot | None = None,
) -> tuple[list[Path], dict]:
    """Bench logs in `folder`; arguments as in `robot_case`; `robot`: this one, none drawn."""
    sensors = sensors or Sensors()
    chosen, faults, drawn, others = _setting(
        effect, size, seed, "both", sensors, spread, figures_off, floor, True
    )
    robot = robot or drawn
    paths = []
    for run in range(runs):
        rng = np.random.default_rng([seed, 2, run])
        rig = rigs.standard(tests[run % len(tests)], duration, rate, jitter, rng)
        push = disturbance * coloured(rig.ticks, [0.5], rng)[:, 0]
        present = _of_run(chosen, run, runs) + others
        truth = bench.simulate(rig, present, robot, chambers, push=push)
        columns = bench.bench_log(truth, sensors, faults, np.random.default_rng([seed, 3, run]))
        paths.append(_write(Path(folder), "bench", run, f"{rig.name}_{run}", columns, sensors))
    return paths, _truth(folder, "bench", seed, chosen, faults, others, chambers, robot, paths)


def _setting(effect, size, seed, on, sensors, spread, figures_off, floor, bench_only):
    wanted = effect if isinstance(effect, (list, tuple)) else [] if effect is None else [effect]
    drawn = [draw(e, size, seed + 17 * i, sensors, spread, on) for i, e in enumerate(wanted)]
    faults = [e for e in drawn if is_sensor(e["kind"])]
    chosen = [e for e in drawn if not is_sensor(e["kind"])]
    robot = Robot().jittered(np.random.default_rng([seed, 4]), figures_off)
    rng = np.random.default_rng([seed, 5])
    others = floor_effects(floor, rng, bench_only, [e["kind"] for e in chosen])
    return chosen, faults, robot, others


def _of_run(effects: list[dict], run: int, runs: int) -> list[dict]:
    """Effects as they are in this run: only the drift changes from run to run."""
    out = []
    for effect in effects:
        if effect["kind"] == "temperature_drift":
            share = 1.0 - 2.0 * run / max(runs - 1, 1)
            parameters = {k: v * share for k, v in effect["parameters"].items()}
            effect = effect | {"parameters": parameters}
        out.append(effect)
    return out


def _write(folder, kind, run, group, columns, sensors) -> Path:
    path = logs.write(folder / f"run_{run:02d}.csv", columns)
    noise = {}
    for name in columns:
        channel = name.split(" [")[0]
        if measure.base(channel) in measure.CHANNELS:
            noise[name] = sensors.spread(channel)
    logs.sidecar(path, kind, run, group, noise)
    return path


def _truth(folder, kind, seed, chosen, faults, others, chambers, robot, paths) -> dict:
    nominal = Robot()
    truth = {
        "kind": kind,
        "seed": seed,
        "effects": chosen + faults,
        "in_catalogue": all(CATALOGUE[e["kind"]].known for e in chosen),
        "floor": others,
        "chambers": chambers,
        "figures": {
            "mass": (robot.mass / nominal.mass).tolist(),
            "inertia": (robot.inertia / nominal.inertia).tolist(),
            "air": (robot.air / nominal.air).tolist(),
            "boom_weight": robot.boom_weight / nominal.boom_weight,
        },
        "logs": [p.name for p in paths],
    }
    keep = Path(folder) / ".truth"
    keep.mkdir(parents=True, exist_ok=True)
    (keep / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")
    return truth


def quiet(sensors: Sensors | None = None) -> Sensors:
    """The same sensors without noise, quantisation or clock error (for tests)."""
    return replace(sensors or Sensors(), noise=0.0, quantise=False, clock_error=0.0)
