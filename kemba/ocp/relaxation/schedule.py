"""The solving strategy: relaxed pairs from a loose interior start, valves rounded and fixed,
pairs tightened; coarse before fine, half before whole, with fallbacks. See docs/solving.md."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kemba.ocp.nlp.ipopt import WARM, Ipopt, Iterate, Parameters
from kemba.ocp.nlp.stagnation import Stagnation
from kemba.ocp.relaxation.dwell import dwelling
from kemba.ocp.transcription.transcribe import Transcription

RELAX = "relax"  # the first solve of a schedule
LONGEST = 600  # its iterations; where there is a plan it takes 30 to 200
HOPELESS = ("Infeasible_Problem_Detected", "Maximum_Iterations_Exceeded")
LOOSE, TIGHT = 1e-3, 1e-4  # relaxation of the pairs: body weights times metres
MARGIN = 0.8  # the last relaxation stays this much below what the certificate asks
VALVE, SWITCHING = 0.1, 0.05
FORCES = 3e-5  # while valves are sought; without it IPOPT wanders where the cost is flat
STOPS = ("User_Requested_Stop", "Maximum_CpuTime_Exceeded", "Maximum_WallTime_Exceeded")
ANCHOR = 3e-4  # in the last solve, which else wanders too
REACH = 4  # nodes by which a switch may move at a time
MISFIT = 200  # iterations; valves that fit the finer grid take 20 to 100
STUCK, NEAR = 40, 0.05  # iterations without coming nearer; scaled violation that is near
# Off the bounds: a plan whose valves were rounded or released, or between the nodes of its grid, is
# not feasible; the more it must change, the farther off it starts.
ROUNDED, CHANGED = 1e-2, 1e-3
# feasible to the last digit, optimal to a few: the certificate measures the former
EXACT: dict[str, Any] = {"tol": 1e-2, "constr_viol_tol": 1e-8, "acceptable_iter": 0}


@dataclass(frozen=True)
class Attempt:
    """One solve of a schedule, for reports: what, how it ended, iterations."""

    name: str
    message: str
    iterations: int


class Stopped(Exception):  # noqa: N818 (a way out, not an error)
    """The user or a limit ended a solve; the best iterate travels along."""

    def __init__(self, transcription: Transcription, point: Iterate) -> None:
        super().__init__(point.message)
        self.transcription, self.point = transcription, point


@dataclass
class Schedule:
    """A transcription being solved: its solver, what was tried, and who is told."""

    ipopt: Ipopt
    final_eps: float
    tell: Callable[[str], None] = lambda text: None
    attempts: list[Attempt] = field(default_factory=list)

    @property
    def transcription(self) -> Transcription:
        return self.ipopt.transcription

    def solve(self, name: str, start: Iterate, parameters: Parameters, **how: Any) -> Iterate:
        """One labelled solve. Raises Stopped when it was cut short."""
        self.tell(name)
        point = self.ipopt.solve(start, parameters, **how)
        self.attempts.append(Attempt(name, point.message, point.iterations))
        if point.message in STOPS:
            raise Stopped(self.transcription, self.better(start, point, parameters))
        return point

    def better(self, start: Iterate, point: Iterate, parameters: Parameters) -> Iterate:
        """The less violated of a start and an iterate, with the iterate's message."""
        t = self.transcription

        def violation(Y: np.ndarray) -> float:
            g = np.array(t.problem.g(Y.ravel(), parameters.vector(t.nodes))).ravel()
            rows = np.maximum(t.g_lower - g, g - t.g_upper).max(initial=0.0)
            return float(max(rows, np.maximum(t.lower - Y, Y - t.upper).max()))

        if violation(point.Y) <= violation(start.Y):
            return point
        return replace(point, Y=start.Y)

    def at_most(self, iterations: int) -> int:
        """As many iterations, or the user's limit if that is less."""
        return min(iterations, int(self.ipopt.options.get("max_iter", iterations)))

    def valves(self, point: Iterate) -> dict[int, np.ndarray]:
        """Columns of the valves, rounded, without pulses shorter than the task's dwell, as the
        task's own bounds on them allow."""
        t = self.transcription
        least, h = t.task.min_dwell, t.h(point.Y)
        rounded = {c: dwelling(point.Y[:, c], h, least) for c in t.layout.binary}
        return {c: np.clip(u, t.lower[:, c], t.upper[:, c]) for c, u in rounded.items()}


def warm(mu: float, push: float = 1e-6, **more: Any) -> dict[str, Any]:
    """IPOPT options of a warm start at barrier parameter `mu`, `push` off the bounds."""
    pushed = {name: push for name in WARM if name.endswith(("_push", "_frac"))}
    return {**WARM, **pushed, "mu_init": mu, **more}


def find(search: Schedule, start: Iterate) -> Iterate:
    """From a guess to a plan with binary valves, its pairs still a little loose."""
    interior = {"bound_push": 0.3, "bound_frac": 0.3, "mu_init": 0.1, "tol": 1e-3}
    interior["max_iter"] = search.at_most(LONGEST)
    point = search.solve(RELAX, start, Parameters(LOOSE, forces=FORCES), options=interior)
    if point.message in HOPELESS:
        return point  # what the relaxed pairs forbid, tighter ones do not allow
    return binary(search, point)


def binary(search: Schedule, point: Iterate, push: float = 1e-6) -> Iterate:
    """Push the valves towards 0 and 1, then round and fix them, the pairs as loose as before; the
    start moves `push` off the bounds."""
    parameters = Parameters(LOOSE, VALVE, SWITCHING, forces=FORCES)
    point = search.solve("binary valves", point, parameters, options=warm(1e-3, push, tol=1e-3))
    options, fixed = warm(1e-2, ROUNDED, tol=1e-3), search.valves(point)
    parameters = Parameters(LOOSE, forces=FORCES)
    return search.solve("round valves", point, parameters, options=options, fixed=fixed)


def fix(
    search: Schedule,
    point: Iterate,
    forces: float = FORCES,
    patience: Stagnation | None = None,
    **more: Any,
) -> Iterate:
    """Round and fix the valves, the pairs tighter; `more` options to IPOPT."""
    options, fixed = warm(1e-3, CHANGED, tol=1e-3, **more), search.valves(point)
    how = {"options": options, "fixed": fixed, "patience": patience}
    return search.solve("fix valves", point, Parameters(TIGHT, forces=forces), **how)


def tighten(search: Schedule, point: Iterate) -> Iterate:
    """Tighten the pairs to what the certificate asks, with the valves fixed."""
    parameters = Parameters(MARGIN * search.final_eps, anchor=ANCHOR)
    options = warm(1e-5, **EXACT)
    fixed = search.valves(point)
    return search.solve("tighten", point, parameters, options=options, fixed=fixed)


def move(search: Schedule, start: Iterate, eps: float = TIGHT, **more: Any) -> Iterate:
    """Release every valve switch by a few nodes and push the valves towards 0 and 1 again, the
    pairs relaxed by `eps`; `more` options to IPOPT."""
    options, free = {**warm(1e-3, CHANGED, tol=1e-3), **more}, _released(search.valves(start))
    parameters = Parameters(eps, VALVE, SWITCHING / 5, forces=FORCES)
    return search.solve("move switches", Iterate(start.Y), parameters, options=options, free=free)


def _released(valves: dict[int, np.ndarray]) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Bounds of the valve columns: free near their switches, fixed elsewhere."""
    bounds = {}
    for column, u in valves.items():
        near = np.zeros(len(u), dtype=bool)
        for k in np.flatnonzero(np.diff(u)):
            near[max(k + 1 - REACH, 1) : k + 1 + REACH] = True
        bounds[column] = (np.where(near, 0.0, u), np.where(near, 1.0, u))
    return bounds


def refine(search: Schedule, coarse: Transcription, point: Iterate) -> Iterate:
    """A coarse plan on the finer grid of `search`, with its valves kept; where that takes too
    long, as where they no longer fit, with its valves free again."""
    start = Iterate(prolong(coarse, search.transcription, point.Y))
    longest, patience = search.at_most(MISFIT), Stagnation(STUCK, NEAR)
    kept = fix(search, start, forces=0.0, patience=patience, max_iter=longest)
    return kept if kept.solved else fix(search, binary(search, start, CHANGED), forces=0.0)


def prolong(coarse: Transcription, fine: Transcription, Y: np.ndarray) -> np.ndarray:
    """Y of a coarse grid on a finer one: states in between, inputs and forces held."""
    layout = coarse.layout
    nodes = np.linspace(0.0, coarse.nodes, fine.nodes + 1)
    result = np.empty(fine.shape)
    held = np.minimum(np.ceil(nodes - 1e-9).astype(int), coarse.nodes)
    for group, part in layout.slices.items():
        if group in ("q", "v", "s"):
            for column in range(part.start, part.stop):
                result[:, column] = np.interp(nodes, np.arange(coarse.nodes + 1), Y[:, column])
        else:
            result[:, part] = Y[held, part]
    return result
