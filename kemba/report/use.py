"""How much of what the robot can do was used: torque and speed of the hips, friction, air."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kemba.effects.mechanics.ground import Contact
from kemba.effects.mechanics.hip import Motor
from kemba.effects.pneumatics.flow import ATMOSPHERE, GAS, TEMPERATURE
from kemba.events import runs
from kemba.identify.problem.noise import difference_sigma
from kemba.mechanism import Cylinder
from kemba.model import Model
from kemba.plant.controller import motor_of
from kemba.plotting.source import EXACT, Machine, Mask
from kemba.report.charts import Track
from kemba.trajectory import Array, Trajectory

NORMAL = 1.204e-3  # kg in a litre of air at 20 deg C and one atmosphere
AT_START = 20  # rows whose median is the pressure of the supply before valves open


FULL = 0.99  # share of a limit that counts as reached
LOADED = 0.1  # share of the weight on a foot below which its friction says nothing
SMOOTH = 0.011  # s; window over which a measured position is made a speed
CLEAR = 8.0  # times its noise that a ground force must be, for friction as its share


@dataclass(frozen=True)
class Use:
    """Of one motion and leg, arrays (rows,): hip torque [N.m] and speed [rad/s]; shares of the
    torque there is at that speed, and of the friction cone."""

    torque: Array
    speed: Array
    motor: Array
    cone: Array


def use_of(track: Track, model: Model, machine: Machine, leg: str) -> Use:
    """What a motion uses of a leg's limits; NaN where a column is missing."""
    t = track.t
    nothing = np.full(len(t), np.nan)
    torque = t.get(f"{leg}/hip/tau", nothing)
    speed = rate(track, f"{leg}/hip/w", f"{leg}/hip/q")
    motor = motor_of(model, leg)
    share = motor_share(motor, torque, speed) if motor else nothing
    return Use(torque, speed, share, _cone(t, model, machine, leg))


def motor_share(motor: Motor, torque: Array, speed: Array) -> Array:
    """Torque as a share of what the motor gives at this speed: its peak, less at high speed."""
    slope = (motor.w_noload - motor.w_rated) / motor.tau_rated
    driving = np.clip(speed * np.sign(torque), 0.0, None)
    left = np.clip((motor.w_noload - driving) / slope, 1e-3, motor.tau_peak)
    return np.asarray(np.abs(torque) / left)


def _cone(t: Trajectory, model: Model, machine: Machine, leg: str) -> Array:
    """Share of the friction cone while the foot stands and is loaded."""
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    names = (f"{leg}/foot/Fx", f"{leg}/foot/Fz")
    if ground is None or not all(name in t for name in names):
        return np.full(len(t), np.nan)
    along, normal = (t[name] for name in names)
    least = 0.0
    if t.meta.get("kind") not in EXACT:
        least = CLEAR * difference_sigma(normal)
    loaded = normal > max(LOADED * model.mechanism.weight, least)
    loaded &= machine.stance(t, leg)
    x = t.get(f"{leg}/foot/x", np.zeros(len(t)))
    mu = model.mechanism.scene.ground.friction(x, ground.mu)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(loaded, np.abs(along) / (mu * normal), np.nan)


def rate(track: Track, speed: str, position: str) -> Array:
    """A speed (rows,): its column, else the smoothed slope of the position; NaN without either."""
    t = track.t
    if speed in t:
        return t[speed]
    if position not in t or len(t) < 5:
        return np.full(len(t), np.nan)
    from scipy.signal import savgol_filter  # it takes half a second

    step = float(np.median(np.diff(t.time)))
    width = max(5, 2 * round(0.5 * SMOOTH / step) + 1)
    if width > len(t):
        return np.gradient(t[position], t.time)
    return np.asarray(savgol_filter(t[position], width, 2, deriv=1, delta=step))


def full_for(track: Track, share: Array) -> float:
    """For how long [s] a share is at its limit."""
    at = np.nan_to_num(share) >= FULL
    return float(np.sum(np.gradient(track.t.time)[at]))


def slides(track: Track, leg: str, stands: Mask, foot: Array | None) -> float:
    """How far [m] a foot slides while it stands: by its slip speed, else by where it is."""
    t = track.t
    if f"{leg}/foot/slip" in t:
        return float(np.trapezoid(np.where(stands, t[f"{leg}/foot/slip"], 0.0), t.time))
    if foot is None or "body/x" not in t:
        return float("nan")
    way = 0.0
    for a, b in runs(stands):
        place = foot[a:b][np.isfinite(foot[a:b])]
        few = max(1, len(place) // 5)
        if len(place) > 2:
            way += abs(float(np.mean(place[-few:]) - np.mean(place[:few])))
    return way


def supply_share(t: Trajectory) -> Array | None:
    """Pressure (rows,) [1] of the supply above the atmosphere, as a share of that at the start;
    None where it is not known."""
    for name in ("supply/P", "supply/line/s", "supply/s"):
        if name in t and np.isfinite(t[name]).any():
            level = t[name] - (ATMOSPHERE if name.endswith("P") else 0.0)
            known = level[np.isfinite(level)]
            return np.asarray(level / np.median(known[:AT_START]))
    return None


def pressure(t: Trajectory, leg: str, side: str, cylinder: Cylinder) -> Array | None:
    """Pressure (rows,) [Pa] of a chamber: its column, else by its force."""
    area = cylinder.area_extend if side == "extend" else cylinder.area_retract
    where = f"{leg}/chamber/{side}" if leg else f"chamber/{side}"
    if f"{where}/P" in t:
        return t[f"{where}/P"]
    return ATMOSPHERE + t[f"{where}/F"] / area if f"{where}/F" in t else None


def air_drawn(track: Track, leg: str, cylinder: Cylinder) -> float | None:
    """Air [kg] that a leg's chambers take from the supply: what each holds more after its valve
    was on, at room temperature."""
    t = track.t
    place = f"{leg}/piston/x" if leg else "piston/x"
    drawn, found = 0.0, False
    for side in ("extend", "retract"):
        P, valve = pressure(t, leg, side, cylinder), f"{leg}/valve/{side}" if leg else ""
        if P is None or place not in t or (valve or f"valve/{side}") not in t:
            continue
        x = t[place] if side == "extend" else cylinder.stroke - t[place]
        area = cylinder.area_extend if side == "extend" else cylinder.area_retract
        mass = P * (cylinder.tube + area * x) / (GAS * TEMPERATURE)
        on = np.nan_to_num(t[valve or f"valve/{side}"]) > 0.5
        for start, end in track.source.spans(np.asarray(on)):
            a, b = np.interp([start, end], t.time[np.isfinite(mass)], mass[np.isfinite(mass)])
            drawn += max(0.0, float(b - a))
        found = True
    return drawn if found else None


def envelope(motor: Motor) -> Iterable[tuple[float, float]]:
    """Corners of what the motor can give: driving speed [rad/s], torque [N.m]."""
    slope = (motor.w_noload - motor.w_rated) / motor.tau_rated
    yield -motor.w_noload, motor.tau_peak
    yield max(0.0, motor.w_noload - slope * motor.tau_peak), motor.tau_peak
    yield motor.w_noload, 0.0
