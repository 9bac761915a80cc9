"""Sensors: sampling, noise, quantisation, faults and gaps.  Nothing here moves the robot."""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from .catalogue import SENSOR_KINDS, SENSOR_SIZES
from .figures import AREA_E, AREA_R, ATMOSPHERE

# channel -> (unit, noise sigma, quantisation step)
CHANNELS = {
    "body/x": ("m", 3e-4, 1e-4),
    "body/z": ("m", 3e-4, 1e-4),
    "body/pitch": ("rad", 3e-4, 1e-4),
    "body/vx": ("m.s-1", 5e-3, 0.0),
    "body/vz": ("m.s-1", 5e-3, 0.0),
    "body/ax": ("m.s-2", 0.3, 0.01),
    "body/az": ("m.s-2", 0.3, 0.01),
    "hip/q": ("rad", 1e-3, 3.8e-4),
    "piston/x": ("m", 1e-4, 5e-5),
    "piston/v": ("m.s-1", 5e-3, 0.0),
    "piston/F": ("N", 1.0, 0.1),
    "chamber/extend/P": ("Pa", 1.5e3, 100.0),
    "chamber/retract/P": ("Pa", 1.5e3, 100.0),
    "supply/P": ("Pa", 1.5e3, 100.0),
    "foot/Fx": ("N", 2.0, 0.1),
    "foot/Fz": ("N", 2.0, 0.1),
}
SIDES = ("front", "rear")
DRIFT_MEMORY = 1.0  # s


def base(channel: str) -> str:
    """`front/piston/x` -> `piston/x`: the row of CHANNELS."""
    return channel.split("/", 1)[1] if channel.split("/")[0] in SIDES else channel


def header(channel: str) -> str:
    return f"{channel} [{CHANNELS[base(channel)][0]}]"


@dataclass(frozen=True)
class Sensors:
    """How the measuring is done.  `noise` scales every sigma; `sigma` overrides by channel."""

    noise: float = 1.0
    sigma: dict[str, float] = field(default_factory=dict)
    quantise: bool = True
    keep: float = 0.0  # AR(1): share of the noise that is left after a millisecond
    drift: float = 0.0  # sigma of a slow drift, in sigmas of the noise; memory 1 s
    steps: float = 1.0  # quantisation steps are so many times as wide
    clock_error: float = 5e-6  # sigma of the written time stamps (s)
    gaps: float = 0.0  # share of rows with a missing cell, per measured channel
    velocities: bool = False
    accelerometer: bool = False
    force: bool = False
    pressures: bool = False
    feet: bool = False

    def one_sigma(self, channel: str) -> float:
        return self.sigma.get(channel, self.sigma.get(base(channel), CHANNELS[base(channel)][1]))

    def spread(self, channel: str) -> float:
        """Noise per sample with the quantisation counted in, for the sidecar."""
        noise = self.noise * self.one_sigma(channel)
        return float(np.hypot(noise, self.step(channel) / np.sqrt(12.0)))

    def step(self, channel: str) -> float:
        """Quantisation step of a channel; 0: none."""
        return self.steps * CHANNELS[base(channel)][2] if self.quantise else 0.0


def sensor_fault(name: str, size: float = 1.0, sensors: Sensors | None = None, **value) -> dict:
    """A hidden sensor effect such as `sensor_bias:body/pitch`; `value` overrides the sized one."""
    kind, channel = name.split(":", 1)
    parameter = SENSOR_KINDS[kind]
    amount = size * SENSOR_SIZES[kind]
    if kind == "sensor_bias":
        amount *= (sensors or Sensors()).one_sigma(channel)
    return {"kind": name, "on": "both", "parameters": {parameter: value.get(parameter, amount)}}


def read(channel, times, truth_times, truth, sensors: Sensors, faults, rng) -> np.ndarray:
    """One measured column: delay, scale, bias, noise, quantisation, gaps, in that order."""
    shift, scale, bias = 0.0, 1.0, 0.0
    for fault in faults:
        where = fault["kind"].split(":", 1)[1]
        if where != channel:
            continue
        shift += fault["parameters"].get("dt", 0.0)
        scale += fault["parameters"].get("k", 0.0)
        bias += fault["parameters"].get("b", 0.0)
    value = scale * np.interp(times - shift, truth_times, truth) + bias
    value = value + sensors.noise * sensors.one_sigma(channel) * noise(times, sensors, rng)
    step = sensors.step(channel)
    if step > 0.0:
        value = np.round(value / step) * step
    if sensors.gaps > 0.0:
        value[rng.random(times.size) < sensors.gaps] = np.nan
    return value


def noise(times: np.ndarray, sensors: Sensors, rng) -> np.ndarray:
    """Noise of unit sigma: white, or AR(1) with `keep` per millisecond, plus a slow drift."""
    white = rng.standard_normal(times.size)
    if sensors.keep == 0.0 and sensors.drift == 0.0:
        return white
    dt = float(np.median(np.diff(times)))
    fast = autoregressive(white, sensors.keep ** (dt / 1e-3))
    if sensors.drift == 0.0:
        return fast
    slow = autoregressive(rng.standard_normal(times.size), np.exp(-dt / DRIFT_MEMORY))
    return fast + sensors.drift * slow


def autoregressive(white: np.ndarray, keep: float) -> np.ndarray:
    """AR(1) noise of unit sigma, `keep` of which is left after each sample."""
    drive = np.sqrt(1.0 - keep**2) * white
    drive[0] = white[0]
    return lfilter([1.0], [1.0, -keep], drive)


def time_stamps(ticks: np.ndarray, sensors: Sensors, rng) -> np.ndarray:
    """Written times: true ones plus clock error, still strictly increasing."""
    error = np.clip(sensors.clock_error * rng.standard_normal(ticks.size), -1e-4, 1e-4)
    stamped = ticks + np.minimum(np.abs(error), 0.3 * np.min(np.diff(ticks))) * np.sign(error)
    stamped[0] = ticks[0]
    return stamped


def robot_channels(truth, sensors: Sensors) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """True signals of every wanted channel as (times, values)."""
    t, y, w = truth.times, truth.y, truth.w
    out = {}
    for i, name in enumerate(("x", "z", "pitch")):
        out[f"body/{name}"] = (t, y[:, i])
    if sensors.velocities:
        out["body/vx"], out["body/vz"] = (t, w[:, 0]), (t, w[:, 1])
    if sensors.accelerometer:
        # a real one averages over its sample: the change of velocity over the interval
        every = w[:: truth.split]
        for i, name in enumerate(("ax", "az")):
            mean = np.diff(every[:, i]) / np.diff(truth.ticks)
            out[f"body/{name}"] = (truth.ticks, np.concatenate([mean[:1], mean]))
    for leg, side in enumerate(SIDES):
        out[f"{side}/hip/q"] = (t, y[:, 3 + leg])
        out[f"{side}/piston/x"] = (t, y[:, 5 + leg])
        if sensors.force:
            out[f"{side}/piston/F"] = (t, truth.rod[:, leg])
        if sensors.pressures:
            extend, retract = pressures(truth.air[:, leg], truth.physical)
            out[f"{side}/chamber/extend/P"] = (t, extend)
            out[f"{side}/chamber/retract/P"] = (t, retract)
        if sensors.feet:
            out[f"{side}/foot/Fx"] = (t, truth.foot[:, leg, 0])
            out[f"{side}/foot/Fz"] = (t, truth.foot[:, leg, 1])
    return out


def pressures(air: np.ndarray, physical: bool) -> tuple[np.ndarray, np.ndarray]:
    """Absolute chamber pressures (extend, retract) of air states (n, N_AIR)."""
    if physical:
        return air[:, 0], air[:, 1]
    return ATMOSPHERE + air[:, 0] / AREA_E, ATMOSPHERE + air[:, 1] / AREA_R


def robot_log(truth, sensors: Sensors, faults=(), rng=None) -> dict[str, np.ndarray]:
    """Columns of a robot log, one row per control tick."""
    rng = rng or np.random.default_rng(0)
    columns = {"time [s]": time_stamps(truth.ticks, sensors, rng)}
    for channel, (when, value) in robot_channels(truth, sensors).items():
        columns[header(channel)] = read(channel, truth.ticks, when, value, sensors, faults, rng)
    for leg, side in enumerate(SIDES):
        columns[f"{side}/hip/tau [N.m]"] = truth.command[:, leg]
        columns[f"{side}/valve/extend [1]"] = truth.sent[:, 2 * leg]
        columns[f"{side}/valve/retract [1]"] = truth.sent[:, 2 * leg + 1]
    return columns


def fault_channels(kind: str) -> tuple[str, ...]:
    """Channels whose faults make sense on this kind of log."""
    if kind == "bench":
        return ("piston/x", "piston/F")
    return ("body/x", "body/z", "body/pitch", *(f"{s}/{c}" for s in SIDES
                                                for c in ("hip/q", "piston/x")))  # fmt: skip
