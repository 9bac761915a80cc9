"""What all solves of one plan share, and a program that is solved step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kemba.ocp.functions.problem import violation
from kemba.ocp.nlp.ending import Ending, Stagnation
from kemba.ocp.nlp.ipopt import Bounds, Control, Ipopt, Iterate
from kemba.ocp.transcription.transcribe import Parameters, Transcription
from kemba.stopwatch import Stopwatch


@dataclass(frozen=True)
class Attempt:
    """One solve, for reports: its name, how it ended, its iterations."""

    name: str
    ending: Ending
    iterations: int


class Stopped(Exception):  # noqa: N818 (a way out, not an error)
    """Raised when the user or the time limit ended a solve; holds the best iterate."""

    def __init__(self, transcription: Transcription, point: Iterate) -> None:
        super().__init__(str(point.ending))
        self.transcription, self.point = transcription, point


@dataclass
class Session:
    """What all solves of one plan share: limits, the listener, what was tried, time of building."""

    control: Control = field(default_factory=Control)
    tell: Callable[[str], None] = lambda text: None
    attempts: list[Attempt] = field(default_factory=list)
    building: Stopwatch = field(default_factory=Stopwatch)

    def schedule(
        self, t: Transcription, options: Mapping[str, Any], where: str = "", pulse: float = 0.0
    ) -> Schedule:
        """A program ready to be solved, its valves with pulses of `pulse` [s] at least; `where`
        follows the name of every solve."""
        ipopt = Ipopt(t, options, self.control, self.building)
        return Schedule(t, ipopt, pulse, lambda name: self.tell(f"{name}{where}"), self.attempts)


@dataclass
class Schedule:
    """A transcription being solved: its solver, the listener, what was tried.

    `pulse`: the shortest pulse [s] of a valve that is rounded; the task's dwell where that is more.
    """

    transcription: Transcription
    ipopt: Ipopt
    pulse: float = 0.0
    tell: Callable[[str], None] = lambda text: None
    attempts: list[Attempt] = field(default_factory=list)

    @property
    def final_eps(self) -> float:
        """The relaxation of the pairs that the task accepts."""
        return self.transcription.task.solver.complementarity

    def solve(
        self,
        name: str,
        start: Iterate,
        parameters: Parameters,
        options: Mapping[str, Any] | None = None,
        fixed: Mapping[int, np.ndarray] | None = None,
        free: Mapping[int, Bounds] | None = None,
        stagnation: Stagnation | None = None,
    ) -> Iterate:
        """One named solve. `fixed` maps columns of Y to values (nodes + 1,) that they keep, `free`
        to bounds that hold as well. Raises Stopped when it was cut short."""
        self.tell(name)
        t = self.transcription
        p, weight = parameters.vector(t.nodes), parameters.proximal
        bounds, regular = _bounds(t, fixed or {}, free or {}), _regularised(t, parameters)
        point = self.ipopt.solve(start, p, options, bounds, weight, stagnation, regular)
        assert point.ending is not None
        self.attempts.append(Attempt(name, point.ending, point.iterations))
        if point.ending.cut_short:
            raise Stopped(t, self.better(start, point, parameters))
        return point

    def better(self, start: Iterate, point: Iterate, parameters: Parameters) -> Iterate:
        """The less violated of a start and an iterate, with the iterate's ending."""
        t = self.transcription

        def worst(Y: np.ndarray) -> float:
            g = np.array(t.problem.g(Y.ravel(), parameters.vector(t.nodes))).ravel()
            return max(violation(t, g), float(np.maximum(t.lower - Y, Y - t.upper).max()))

        return point if worst(point.Y) <= worst(start.Y) else replace(point, Y=start.Y)

    def at_most(self, iterations: int) -> int:
        """As many iterations, or the user's limit if that is less."""
        return min(iterations, int(self.ipopt.options.get("max_iter", iterations)))

    def valves(self, point: Iterate) -> dict[int, np.ndarray]:
        """Columns of the valves -> values (nodes + 1,), rounded to 0 or 1, within the task's
        bounds.

        Shorter pulses than asked are removed.
        """
        t = self.transcription
        least, h = max(t.task.min_dwell, self.pulse), t.h(point.Y)
        rounded = {c: dwelling(point.Y[:, c], h, least) for c in t.layout.binary}
        return {c: np.clip(u, t.lower[:, c], t.upper[:, c]) for c, u in rounded.items()}


def _bounds(
    t: Transcription, fixed: Mapping[int, np.ndarray], free: Mapping[int, Bounds]
) -> Bounds:
    """The program's bounds with columns fixed or narrowed; node 0 keeps its own."""
    lower, upper = t.lower.copy(), t.upper.copy()
    for column, values in fixed.items():
        lower[1:, column] = upper[1:, column] = values[1:]
    for column, (low, high) in free.items():
        lower[1:, column] = np.maximum(lower[1:, column], low[1:])
        upper[1:, column] = np.minimum(upper[1:, column], high[1:])
    return lower, upper


def _regularised(t: Transcription, parameters: Parameters) -> bool:
    """Whether Newton steps have a regularised Hessian: on a whole robot with relaxed pairs.

    Half a robot is as quick without. The paper's penalty on pairs is not changed: it is
    kept for comparison.
    """
    has_pairs = any(rows.kind == "pair" for rows in t.stage.rows)
    return has_pairs and not t.reduction.symmetric and not parameters.pairs


def dwelling(u: np.ndarray, h: np.ndarray, least: float) -> np.ndarray:
    """A rounded valve (nodes + 1,) without pulses shorter than `least` [s]; `h` (nodes,) [s].

    A pulse that is too short is filled in, the shortest first.
    """
    u = np.round(np.clip(u, 0.0, 1.0))
    for _ in h:  # each pass leaves one pulse less; of what is no number it would have no end
        edges = np.flatnonzero(np.diff(u)) + 1
        if len(edges) < 2:
            return u
        ends = np.concatenate([[0.0], np.cumsum(h)])
        spans = ends[edges[1:] - 1] - ends[edges[:-1] - 1]
        i = int(np.argmin(spans))
        if spans[i] >= least - 1e-9:
            return u
        u[edges[i] : edges[i + 1]] = 1.0 - u[edges[i]]
    return u
