"""A problem small enough to know the answer: effects on a line, exactly linear, white noise."""

from collections.abc import Mapping

import numpy as np

from kemba.identify.problem.problem import Array, Candidate, Parameter, Problem, Rows, Theta

EFFECTS = ("bend", "drag", "hum", "kick", "ramp", "twin", "wave")


class Toy(Problem):
    """y(t) = gain * u(t) + effects; `twin` is nearly `drag`, so the two cannot be told apart.

    `more`: so many further effects, each a wave of its own: the more, the less likely is each.
    """

    def __init__(
        self, truth: Mapping[str, float], seed: int = 0, runs: int = 3, more: int = 0
    ) -> None:
        rng = np.random.default_rng(seed)
        self.runs = tuple(f"run {i}" for i in range(runs))
        self.nuisance = {"gain": (1.0, 0.02), "slope": (0.0, 0.5)}
        self.candidates = {
            name: Candidate(
                name, Parameter("a", "N", 0.0, 10.0, 0.0 if name == "drag" else -np.inf)
            )
            for name in (*EFFECTS, *(f"wave{i}" for i in range(more)))
        }
        t = np.arange(800) / 1e3
        self._time = np.tile(t, runs)
        v = np.concatenate([np.sin(7 * t + i) for i in range(runs)])
        u = np.sign(np.sin(31 * self._time))
        self._shapes = {
            "bend": v**3, "drag": np.tanh(5 * v), "twin": np.tanh(5.0001 * v),
            "kick": u * v, "wave": np.sin(50 * self._time), "hum": np.cos(90 * self._time),
            "ramp": self._time * v,
            **{f"wave{i}": np.sin((100 + 10 * i) * self._time) for i in range(more)},
        }  # fmt: skip
        self._u = 100.0 * u
        self.measured = np.zeros(len(v))
        self.measured = self.residual({"gain": 1.01, **truth}) + rng.standard_normal(len(v))

    def residual(self, theta: Theta) -> Array:
        y = theta.get("gain", 1.0) * self._u + theta.get("slope", 0.0) * self._time
        for name, shape in self._shapes.items():
            y = y + theta.get(f"{name}.a", 0.0) * shape
        return np.asarray(y - self.measured)

    def rows(self) -> Rows:
        n = len(self._time)
        run = np.repeat(np.arange(len(self.runs)), n // len(self.runs))
        label = np.full(n, "moving")
        return Rows(run, np.zeros(n, int), self._time, label, label, ("F",), np.ones(n))

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        return {"step": np.sign(self._time - 0.4)}
