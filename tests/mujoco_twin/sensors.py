"""Sensors of the second twin: a filter, a colour and a step of its own in every channel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from .hidden import LEGS
from .machine import CHANNELS, Run

# 1 sigma of the noise, and the step, by the last part of a channel's name
SIGMA = {"x": 3e-4, "z": 3e-4, "pitch": 3e-4, "q": 1e-3, "piston": 1e-4}
STEPS = {"x": 1e-4, "z": 1e-4, "pitch": 1e-4, "q": 3.8e-4, "piston": 5e-5}
UNITS = {"x": "m", "z": "m", "pitch": "rad", "q": "rad", "piston": "m"}
FILTER = (5e-5, 1.5e-4)  # s, time constants of the filters are drawn between these
CLOCK = 5e-6  # s, 1 sigma of the written times


@dataclass(frozen=True)
class Sensors:
    """`noise`: factor on all sigmas; `colour`: largest share of it that is left after 1 ms, each
    channel drawing its own; `drift`: slow part, in sigmas; `steps`: factor on the steps."""

    noise: float = 1.0
    colour: float = 0.0
    drift: float = 0.0
    steps: float = 1.0

    def filters(self, rng: np.random.Generator) -> np.ndarray:
        """Time constants [s] of one robot's sensors (7,)."""
        return rng.uniform(*FILTER, len(CHANNELS)) if self.noise else np.zeros(len(CHANNELS))

    def sigma(self, channel: str) -> float:
        """1 sigma of a channel's noise, its step counted in."""
        return float(np.hypot(self.noise * SIGMA[kind_of(channel)], self._step(channel) / 12**0.5))

    def _step(self, channel: str) -> float:
        return self.steps * STEPS[kind_of(channel)] if self.noise else 0.0

    def columns(
        self, run: Run, read: Sequence[float], faults: Sequence[dict[str, Any]], seed: list[int]
    ) -> dict[str, np.ndarray]:
        """The log of a run. `read`: shares by which the boom's encoders read too much."""
        robot = np.random.default_rng(seed[:-1])  # one robot's sensors keep their colours
        colours = self.colour * robot.uniform(0.6, 1.0, len(CHANNELS))
        rng = np.random.default_rng(seed)
        stamps = run.ticks + np.clip(CLOCK * rng.standard_normal(run.ticks.size), -2e-5, 2e-5)
        stamps[0] = run.ticks[0]
        columns = {"time [s]": stamps}
        for i, channel in enumerate(CHANNELS):
            gain = 1.0 + (read[i] if i < 2 else 0.0)
            value = _faulty(channel, run.ticks, gain * run.seen[:, i], faults)
            noise = self.noise * SIGMA[kind_of(channel)] * self._noise(run.ticks, colours[i], rng)
            step = self._step(channel)
            value = np.round((value + noise) / step) * step if step else value + noise
            columns[f"{channel} [{UNITS[kind_of(channel)]}]"] = value
        for i, leg in enumerate(LEGS):
            columns[f"{leg}/hip/tau [N.m]"] = run.command[:, i]
            columns[f"{leg}/valve/extend [1]"] = run.sent[:, 2 * i]
            columns[f"{leg}/valve/retract [1]"] = run.sent[:, 2 * i + 1]
        return columns

    def _noise(self, times: np.ndarray, keep: float, rng: np.random.Generator) -> np.ndarray:
        """Unit noise with `keep` of it left after a millisecond, and its slow part."""
        fast = _remembering(rng.standard_normal(times.size), keep)
        slow = _remembering(rng.standard_normal(times.size), float(np.exp(-1e-3)))
        return fast + self.drift * slow


def _remembering(white: np.ndarray, keep: float) -> np.ndarray:
    drive = np.sqrt(1.0 - keep**2) * white
    drive[0] = white[0]
    return np.asarray(lfilter([1.0], [1.0, -keep], drive))


def _faulty(
    channel: str, times: np.ndarray, true: np.ndarray, faults: Sequence[dict[str, Any]]
) -> np.ndarray:
    late, scale, bias = 0.0, 1.0, 0.0
    for fault in faults:
        if fault["kind"].split(":", 1)[1] == channel:
            late += fault["parameters"].get("dt", 0.0)
            scale += fault["parameters"].get("k", 0.0)
            bias += fault["parameters"].get("b", 0.0)
    return np.asarray(scale * np.interp(times - late, times, true) + bias)


def kind_of(channel: str) -> str:
    return "piston" if "piston" in channel else channel.split("/")[-1]
