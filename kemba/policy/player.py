"""The reference player of a policy file. It imports only numpy, so that it can be copied.

    policy = Policy("policy.npz")
    every millisecond: torques, valves = policy.step(measured, hip_rates)

`measured` (k,): body/x, body/z, body/pitch, hips and pistons, in the order of `policy.measured`;
`hip_rates` (m,) [rad/s]. The first call is for the first row of controller.csv.
"""

from os import PathLike
from typing import IO, Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]


class Policy:
    """Hips follow the plan and correct deviations; valve edges come sooner or later."""

    def __init__(
        self, file: str | PathLike[str] | IO[bytes], retime: bool = True, hips: bool = True
    ) -> None:
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
        self.x = np.zeros(d["A"].shape[1])  # estimated deviation of the state
        self.late: list[tuple[int, Array]] = []  # what comes of moved edges, and at which row

    def step(self, measured: Array, hip_rates: Array) -> tuple[Array, Array]:
        """Torques (m,) [N.m] and valves (v,) of the next tick."""
        d, row = self.data, min(self.tick, len(self.data["reference"]) - 1)
        deviation = np.asarray(measured) - d["reference"][row]
        self.x = self.x + d["L"][row] @ (deviation - d["C"][row] @ self.x)
        wanted = d["wanted"][min(row, len(d["wanted"]) - 1)]
        angle = np.asarray(measured)[d["joint_rows"]]
        torque = d["K_p"] * (wanted[:, 0] - angle) + d["K_d"] * (wanted[:, 1] - hip_rates)
        most, added = float(d["most_torque"]), np.zeros(len(angle))
        if self.hips and self.tick < len(d["hip_gains"]):
            added = np.clip(d["hip_gains"][row] @ self.x, -most, most)
        self._switch()
        self.x = d["A"][row] @ self.x + d["B"][row] @ added
        self.x += sum(change for at, change in self.late if at == self.tick)
        self.tick += 1
        return self._limited(torque + wanted[:, 2] + added, hip_rates), self.state.copy()

    def _switch(self) -> None:
        """Edges that are due; each moves by its gain, at most `most_shift` ticks."""
        d = self.data
        most = int(d["most_shift"])
        for v, waiting in enumerate(self.waiting):
            if not waiting:
                continue
            k, tick = waiting[0], int(d["edge_tick"][waiting[0]])
            shift = float(d["edge_gain"][k] @ self.x) if self.retime else 0.0
            if self.tick >= tick + round(min(max(shift, -most), most)):
                self.state[v] = d["edge_value"][k]
                acts = max(int(d["edge_acts"][k]), self.tick)
                self.late.append((acts, (self.tick - tick) * d["edge_late"][k]))
                waiting.pop(0)  # two edges of a valve are a tick apart

    def _limited(self, torque: Array, speed: Array) -> Array:
        """What the motors give: peak torque, and less the faster they turn."""
        peak, noload, slope = self.data["limits"].T
        with np.errstate(invalid="ignore"):
            high = np.minimum(peak, np.maximum(0.0, slope * (noload - speed)))
            low = -np.minimum(peak, np.maximum(0.0, slope * (noload + speed)))
        return np.clip(torque, low, high)
