"""The reference player of a policy file. It imports only numpy, so that it can be copied.

    policy = Policy("policy.npz")
    every millisecond: torques, valves = policy.step(measured, hip_rates)

`measured` (k,): body/x, body/z, body/pitch, hips and pistons, in the order of `policy.measured`;
`hip_rates` (m,) [rad/s]. The first call is for the first row of controller.csv.
"""

from os import PathLike
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]


class Policy:
    """Hips follow the plan and correct deviations; valve edges come sooner or later."""

    def __init__(self, file: str | PathLike[str], retime: bool = True, hips: bool = True) -> None:
        with np.load(file, allow_pickle=False) as data:
            self.data = {name: data[name] for name in data.files}
        d = self.data
        self.measured = [str(name) for name in d["measured"]]
        self.valves = [str(name) for name in d["valves"]]
        self.retime, self.hips = retime, hips
        self.tick = 0
        self.state = np.zeros(len(self.valves))
        self.waiting = [
            np.flatnonzero(d["edge_valve"] == v).tolist() for v in range(len(self.valves))
        ]
        self.past: list[Array] = []  # deviations of the last ticks

    def step(self, measured: Array, hip_rates: Array) -> tuple[Array, Array]:
        """Torques (m,) [N.m] and valves (v,) of the next tick."""
        d, row = self.data, min(self.tick, len(self.data["reference"]) - 1)
        deviation = self._deviation(np.asarray(measured) - d["reference"][row])
        wanted = d["wanted"][min(row, len(d["wanted"]) - 1)]
        angle = np.asarray(measured)[d["joint_rows"]]
        torque = d["K_p"] * (wanted[:, 0] - angle) + d["K_d"] * (wanted[:, 1] - hip_rates)
        torque += wanted[:, 2]
        if self.hips and self.tick < len(d["hip_gains"]):
            most = float(d["most_torque"])
            torque += np.clip(d["hip_gains"][row] @ deviation, -most, most)
        self._switch(deviation)
        self.tick += 1
        return self._limited(torque, hip_rates), self.state.copy()

    def _deviation(self, here: Array) -> Array:
        """Deviations and their rates, by a straight line through the last ticks."""
        d = self.data
        self.past = [*self.past, here][-int(d["window"]) :]
        n = len(self.past)
        rate = np.zeros_like(here)
        if n > 2:
            time = (np.arange(n) - (n - 1) / 2) * float(d["period"])
            rate = time @ np.array(self.past) / (time @ time)
        return np.concatenate([here, rate])

    def _switch(self, deviation: Array) -> None:
        """Edges that are due; each moves by its gain, at most `most_shift` ticks."""
        d = self.data
        most = int(d["most_shift"])
        for v, waiting in enumerate(self.waiting):
            while waiting:
                k = waiting[0]
                shift = float(d["edge_gain"][k] @ deviation) if self.retime else 0.0
                due = int(d["edge_tick"][k]) + round(min(max(shift, -most), most))
                if self.tick < due:
                    break
                self.state[v] = d["edge_value"][k]
                waiting.pop(0)
                break  # two edges of a valve are a tick apart

    def _limited(self, torque: Array, speed: Array) -> Array:
        """What the motors give: peak torque, and less the faster they turn."""
        peak, noload, slope = self.data["limits"].T
        with np.errstate(invalid="ignore"):
            high = np.minimum(peak, np.maximum(0.0, slope * (noload - speed)))
            low = -np.minimum(peak, np.maximum(0.0, slope * (noload + speed)))
        return np.clip(torque, low, high)
