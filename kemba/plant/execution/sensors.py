"""From what truly happened to a log: channels, sample times, noise, quantisation, faults."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from kemba.effects import Effect
from kemba.effects.sensors import CHANNELS, as_measured
from kemba.effects.series import Series
from kemba.plant.stepping.arrays import Array
from kemba.trajectory import Trajectory

COMMANDS = re.compile(r".*(hip/tau|valve/(extend|retract))")
CHANNEL = re.compile(
    r"body/(x|z|pitch|vx|vz|ax|az)|.*hip/q|.*hip/tau|(.*/)?piston/(x|v|F)"
    r"|(.*/)?valve/(extend|retract)|(.*/)?chamber/(extend|retract)/P|supply/P|.*foot/F[xz]"
)
ENCODERS = {"pitch": 2e-4, "q": 2 * np.pi / 2**14}  # rad; smallest step


@dataclass(frozen=True)
class Sensors:
    """How a log is taken: `rate` [Hz], `jitter` by which samples come late [s, 1 sigma], noise
    [1 sigma] and smallest step by channel ending, in the channel's SI unit."""

    rate: float = 1000.0
    jitter: float = 0.0
    noise: dict[str, float] = field(default_factory=dict)
    steps: dict[str, float] = field(default_factory=dict)

    @classmethod
    def usual(cls) -> Sensors:
        """The usual noise of every channel (the boom's 0.3 mm is the paper's, II-B)."""
        return cls(jitter=2e-5, noise={k: sigma for k, (_, sigma) in CHANNELS.items()},
                   steps=ENCODERS)  # fmt: skip

    def times(self, duration: float, rng: np.random.Generator) -> Array:
        """Sample times (m,) [s] from 0 to `duration`, strictly increasing. None comes early: a row
        is written after its tick's commands were sent, and shows them."""
        period = 1.0 / self.rate
        times = np.arange(int(duration * self.rate + 1e-9) + 1) * period
        shift = np.clip(np.abs(rng.normal(0.0, self.jitter, len(times))), 0.0, 0.4 * period)
        shift[[0, -1]] = 0.0
        return times + shift if self.jitter else times


def take_log(
    truth: Trajectory,
    sensors: Sensors,
    rng: np.random.Generator,
    effects: Iterable[Effect] = (),
) -> Trajectory:
    """The log of a simulated motion: its measured channels with the sensor faults among `effects`,
    then noise, then quantisation. Commands are logged as they are."""
    effects = list(effects)
    columns, sigmas = {}, {}
    for header, name in zip(truth.headers, truth.names, strict=True):
        if not CHANNEL.fullmatch(name):
            continue
        values = _averaged(truth, name)
        if not COMMANDS.fullmatch(name):
            values = as_measured(effects, name, Series(truth.time, values)).value
            ending = name.split("/")[-1]
            sigma, step = sensors.noise.get(ending, 0.0), sensors.steps.get(ending, 0.0)
            values = values + rng.normal(0.0, sigma, len(values)) if sigma else values
            values = np.round(values / step) * step if step else values
            if sigma:
                sigmas[header] = float(np.hypot(sigma, step / np.sqrt(12.0)))
        columns[header] = values
    meta = {"kind": "robot" if "body/z" in truth else "bench"}
    return Trajectory(truth.time, columns, {**meta, "noise": sigmas} if sigmas else meta)


def _averaged(truth: Trajectory, name: str) -> Array:
    """A channel; an accelerometer averages over its sample, so impacts stay finite in it."""
    if name not in ("body/ax", "body/az") or len(truth) < 2:
        return truth[name]
    speed = truth[name.replace("/a", "/v")]
    mean: Array = np.diff(speed, prepend=np.nan) / np.diff(truth.time, prepend=np.nan)
    mean[0] = mean[1]
    return mean
