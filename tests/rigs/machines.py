"""Rigs simulated by SciPy, which share no code with the fit."""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from kemba.config import dump_yaml
from kemba.trajectory import Trajectory


def model_file(folder: Path, rig: dict, *effects: dict) -> str:
    """A model YAML with a rig and effects; its path."""
    path = folder / "model.yaml"
    dump_yaml({"rig": rig, "effects": list(effects)}, path)
    return str(path)


def drive_log(
    path: Path,
    inertia: float = 2.0,
    coulomb: float = 3.0,
    viscous: float = 8.0,
    weight: float = 0.0,
    unit: str = "m",
    seed: int = 0,
    seconds: float = 8.0,
    scale: float = 1.0,
    width: float = 1e-4,
) -> Path:
    """An axis that follows sines under a PD controller; `weight` hangs: torque -weight sin q. The
    motor does `scale` times what the log says; friction turns over within a rate of `width`."""
    rng = np.random.default_rng(seed)
    rates, sizes = 2 * np.pi * np.array([0.4, 0.9, 1.7]), np.array([0.10, 0.05, 0.02])
    phases = rng.uniform(0, 2 * np.pi, 3)

    def motor(t: float, q: float, v: float) -> float:
        wanted = sizes @ np.sin(rates * t + phases)
        fast = (sizes * rates) @ np.cos(rates * t + phases)
        return 4000.0 * (wanted - q) + 120.0 * (fast - v)

    def motion(t: float, y: np.ndarray) -> list[float]:
        q, v = y
        force = motor(t, q, v) - coulomb * np.sign(v) * min(1.0, abs(v) / width)
        return [v, (force - viscous * v - weight * np.sin(q)) / inertia]

    time = np.arange(0.0, seconds, 2e-3)
    start = [float(sizes @ np.sin(phases)), float((sizes * rates) @ np.cos(phases))]
    found = solve_ivp(motion, (0.0, seconds), start, "LSODA", time, rtol=1e-7, atol=1e-9,
                      max_step=2e-3)  # fmt: skip
    q, v = found.y
    force = np.array([motor(*at) for at in zip(time, q, v, strict=True)])
    columns = {
        f"axis/q [{unit}]": q + 1e-7 * rng.standard_normal(len(q)),
        f"axis/tau [{'N' if unit == 'm' else 'N.m'}]": force / scale
        + 0.1 * rng.standard_normal(len(q)),
    }
    Trajectory(time, columns, {"kind": "drive"}).write(path)
    return path


def turning_log(path: Path, turns: float, seconds: float = 6.0) -> Path:
    """A pendulum (1.5 kg at 0.25 m, rotor 0.02 kg.m2, friction 0.4 N.m, damping 0.05 N.m.s) that a
    motor turns over at about so many rad/s."""
    rng = np.random.default_rng(0)
    inertia, weight = 0.02 + 1.5 * 0.25**2, 1.5 * 9.81 * 0.25

    def motor(t: float, v: float) -> float:
        return 3.0 * (turns * (1 + 0.3 * np.sin(np.pi * t)) - v)

    def motion(t: float, y: np.ndarray) -> list[float]:
        q, v = y
        force = motor(t, v) - 0.4 * np.tanh(v / 1e-3) - 0.05 * v - weight * np.sin(q)
        return [v, force / inertia]

    t = np.arange(0.0, seconds, 1e-3)
    q, v = solve_ivp(motion, (0.0, seconds), [0.0, turns], "LSODA", t, rtol=1e-8, atol=1e-9,
                     max_step=2e-3).y  # fmt: skip
    columns = {
        "axis/q [rad]": q + 1e-4 * rng.standard_normal(len(t)),
        "axis/tau [N.m]": np.array([motor(*at) for at in zip(t, v, strict=True)])
        + 0.02 * rng.standard_normal(len(t)),
    }
    Trajectory(t, columns, {"kind": "drive"}).write(path)
    return path


def cylinder_log(
    path: Path, pressure: float, coulomb: float = 4.0, mu: float = 0.0, seed: int = 0
) -> Path:
    """A piston of 25 mm driven to and fro at 10 mm/s under nearly constant gauge pressure [Pa]; 100
    rows a second with a gap of 2.7 s. The seal shears by 0.2 mm before it slides."""
    rng = np.random.default_rng(seed)
    time = np.concatenate([np.arange(0.0, 20.0, 0.01), np.arange(22.7, 50.0, 0.01)])
    time = time + 0.001 * rng.integers(0, 2, len(time)) * (np.arange(len(time)) > 0)
    phase = (time / 8.0 + 0.13) % 1.0
    x = 0.002 + 0.036 * np.abs(2.0 * phase - 1.0)
    side, since = np.where(phase > 0.5, 1.0, -1.0), 0.036 * 2.0 * np.minimum(phase % 0.5, 1.0)
    slid = side * (1.0 - 2.0 * np.exp(-since / 2e-4))
    p = pressure - 4e3 * slid + 200.0 * rng.standard_normal(len(time))
    push = np.pi / 4 * 0.025**2 * (pressure - 4e3 * slid)
    force = push - (coulomb + mu * push) * slid + 0.05 * rng.standard_normal(len(time))
    columns = {
        "piston/x [m]": x + 2e-5 * rng.standard_normal(len(time)),
        "piston/F [N]": force,
        "chamber/extend/P [Pa]": p + 101325.0,
    }
    Trajectory(time, columns, {"kind": "cylinder"}).write(path)
    return path


def vessel_log(path: Path, h: float = 4.0, seed: int = 0) -> Path:
    """Air of 16 L blows down through 4.5 mm2 (choked flow of Saint-Venant), the wall warms it."""
    rng = np.random.default_rng(seed)
    R, kappa, V, a, wall, warm, out = 287.0, 1.4, 0.016, 4.5e-6, 0.35, 298.0, 101325.0

    def air(t: float, y: np.ndarray) -> list[float]:
        m, U = y
        T = U / (m * R / (kappa - 1))
        P = m * R * T / V
        ratio = max(out / P, (2 / (kappa + 1)) ** (kappa / (kappa - 1)))
        flow = 0.0
        if out < P:
            inside = ratio ** (2 / kappa) - ratio ** ((kappa + 1) / kappa)
            flow = a * P * np.sqrt(2 * kappa / ((kappa - 1) * R * T) * max(inside, 0.0))
        density = P / 101325.0 * 293.0 / T
        heat = h * wall * density ** (2 / 3) * (abs(warm - T) / 10) ** (1 / 3) * (warm - T)
        return [-flow, -flow * kappa / (kappa - 1) * R * T + heat]

    m0 = 7.9e5 * V / (R * warm)
    time = np.arange(0.0, 50.0, 1.0)
    y = solve_ivp(air, (0.0, 49.0), [m0, m0 * R / 0.4 * warm], "LSODA", time, rtol=1e-8).y
    T = y[1] / (y[0] * R / 0.4)
    P = y[0] * R * T / V
    even = np.arange(len(time)) % 2 == 0
    columns = {
        "vessel/P [Pa]": np.where(even, P + 3e3 * rng.standard_normal(len(P)), np.nan),
        "vessel/T [K]": np.where(even, np.nan, T + 0.5 * rng.standard_normal(len(P))),
    }
    Trajectory(time, columns, {"kind": "vessel"}).write(path)
    return path


def cogging_log(path: Path, seed: int) -> Path:
    """An axis of 2 kg with friction 3 N, 8 N.s/m and cogging of 0.6 N every 11 mm, driven through
    the same motion twelve times."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 10.0, 2e-3)
    size, rate = np.array([0.08, 0.03, 0.012]), 2 * np.pi * 1.2 * np.arange(1, 4)
    angle = rate[:, None] * t + rng.uniform(0, 2 * np.pi, (3, 1))
    q, v, a = size @ np.sin(angle), (size * rate) @ np.cos(angle), -(size * rate**2) @ np.sin(angle)
    cogging = 0.6 * np.sin(2 * np.pi * q / 0.011 + rng.uniform(0, 2 * np.pi))
    force = 2.0 * a + 3.0 * np.tanh(v / 1e-3) + 8.0 * v + cogging
    columns = {
        "axis/q [m]": q + 1e-7 * rng.standard_normal(len(t)),
        "axis/tau [N]": force + 0.1 * rng.standard_normal(len(t)),
    }
    Trajectory(t, columns, {"kind": "drive"}).write(path)
    return path
