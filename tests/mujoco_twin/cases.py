"""Cases for testing discovery on the second twin: logs with hidden effects, and the truth.

paths, truth = robot_case(folder, ["seal_friction", "payload"], seed=3, runs=5)
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from twin import logs
from twin.cases import DISTURBANCE, SHOWING, coloured
from twin.catalogue import CATALOGUE, SENSOR_KINDS, SENSOR_SIZES, hidden
from twin.repertoire import motion

from kemba.mechanism import load_robot

from .hidden import Machine, applied, machine, off_by
from .machine import Run, run
from .sensors import SIGMA, Sensors, kind_of

# effects that `twin` does not have: leading parameter, its size (of a length 2 %), whether signed
OWN = {
    "geometry:femur/length": ("d", 0.0048, True),
    "geometry:tibia/length": ("d", 0.0047, True),
    "geometry:piston/mount": ("d", 0.0006, True),
    "geometry:piston/pin": ("d", 0.0010, True),
    "boom_lever": ("k", 0.02, True),
    "mass_split": ("m", 0.2, True),
    "flexible_boom": ("k", 2500.0, False),
}
MOTION_SEEDS = 6  # planning a motion takes seconds
SHORTEST = 0.25  # s


def draw(name: str, size: float, seed: int) -> dict[str, Any]:
    """A hidden effect of about `size` times what matters, its sign drawn where it has one."""
    rng = np.random.default_rng([seed, 7])
    amount = size * float(np.exp(rng.uniform(-0.3, 0.3) * (0.3 if name in OWN else 1.0)))
    sign = float(rng.choice([-1.0, 1.0]))
    kind = name.split(":")[0]
    if kind in SENSOR_KINDS:
        channel = name.split(":", 1)[1]
        unit = SIGMA[kind_of(channel)] if kind == "sensor_bias" else 1.0
        value = (1.0 if kind == "sensor_delay" else sign) * amount * SENSOR_SIZES[kind] * unit
        return {"kind": name, "on": "both", "parameters": {SENSOR_KINDS[kind]: value}}
    if name in OWN:
        lead, usual, signed = OWN[name]
        value = (sign if signed else 1.0) * amount * usual
        return {"kind": name, "on": "both", "parameters": {lead: value}}
    # MuJoCo's own damping cannot be negative
    signed = CATALOGUE[name].signed and not name.endswith("damping")
    return hidden(name, (sign if signed else 1.0) * amount)


def robot_case(
    folder: Path,
    effects: Sequence[str] = (),
    size: float = 1.0,
    seed: int = 0,
    runs: int = 5,
    *,
    sensors: Sensors | None = None,
    figures_off: float = 0.01,
    air: str = "first_order",
    disturbance: float = 1.0,
) -> tuple[list[Path], dict[str, Any]]:
    """Logs in `folder`. Raises RuntimeError where every motion topples this machine."""
    sensors = sensors or Sensors()
    drawn = [draw(name, size, seed + 17 * i) for i, name in enumerate(effects)]
    faults = [e for e in drawn if e["kind"].split(":")[0] in SENSOR_KINDS]
    rng = np.random.default_rng([seed, 4])
    nominal = off_by(machine(load_robot("kemba"), air=air), figures_off, rng)
    inside = [e for e in drawn if e not in faults]
    made = applied(nominal, inside)
    filters = sensors.filters(np.random.default_rng([seed, 6]))
    paths = []
    for i in range(runs):
        name = SHOWING[0 if i < 2 else i - 1]
        number = int(seed % MOTION_SEEDS if i < 2 else rng.integers(MOTION_SEEDS))
        done, group = _survivor(made, name, number, [seed, 2, i], disturbance, filters)
        columns = sensors.columns(done, made.read, faults, [seed, 3, i])
        path = logs.write(folder / f"run_{i:02d}.csv", columns)
        noise = {h: sensors.sigma(h.split(" [")[0]) for h in columns if _measured(h)}
        logs.sidecar(path, "robot", i, group, noise)
        paths.append(path)
    return paths, {"effects": drawn, "air": air}


def _survivor(
    made: Machine, name: str, number: int, seed: list[int], disturbance: float, filters: np.ndarray
) -> tuple[Run, str]:
    """A motion that this machine survives, or the longest beginning of one."""
    best: tuple[Run, str] | None = None
    for attempt in range(3):
        chosen = (number + attempt) % MOTION_SEEDS
        script = motion(name, chosen, 1000.0, 2e-5)
        push = disturbance * coloured(script.ticks, DISTURBANCE, np.random.default_rng(seed))
        done = run(made, script, push, filters)
        good = done.sane
        rows = len(good) if good.all() else max(int(np.argmin(good)) - 20, 1)
        if rows == script.ticks.size:
            return done, f"{name}_{chosen}"
        if best is None or rows > best[0].ticks.size:
            best = done.until(rows), f"{name}_{chosen}"
    if best is None or best[0].ticks[-1] < SHORTEST:
        raise RuntimeError(f"{name}: the effects topple the robot at once")
    return best


def _measured(header: str) -> bool:
    return not header.startswith("time") and "tau" not in header and "valve" not in header
