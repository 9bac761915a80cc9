"""Pulses of valves put into a solved plan where its multipliers say that they lower the cost.

With valves fixed by phases, the derivative of the Lagrangian by a valve's position over one element
is, to first order, what the cost changes by if the valve is turned there: the mode insertion
gradient of a switched system (Egerstedt, Wardi and Axelsson, IEEE TAC 51, 2006).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from kemba.ocp.nlp.ending import Stagnation
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.settings import Refining
from kemba.ocp.refinement.solve import solve, warm
from kemba.ocp.refinement.start import carried
from kemba.ocp.transcription.layout import STEP

Solution = tuple[PhaseProgram, Iterate]

PAYS = 0.02  # of the cost: a smaller gain is within what starts differ by
FAILS = 2  # pulses without a cheaper plan, after which no other is tried
# a solve is given up after so many first iterations without a smaller violation, while that is
# above UNDERWAY (scaled)
PATIENCE, UNDERWAY = 10, 0.5


@dataclass(frozen=True)
class Pulse:
    """Valve `valve` turned in the elements first <= e < last of phase `phase`; `gain`: what that
    lowers the cost by, to first order."""

    phase: int
    valve: int
    first: int
    last: int
    gain: float


def reduced_costs(program: PhaseProgram, found: Iterate) -> np.ndarray:
    """What the cost changes by, to first order, if a valve is turned over an element (elements,
    valves), by the multipliers of a solution."""
    assert found.lam_g is not None
    body, n = program.parts[0], program.nodes
    m = body.g.numel()
    lam = ca.SX.sym("lam", m)
    places = [i - program.layout.slices["u"].start for i in program.layout.binary]
    first = body.z.numel() - 1 - program.columns.u.shape[1]  # z ends with u and h
    slope = ca.gradient(body.f + ca.dot(lam, body.g), body.z)[[first + i for i in places]]
    at = ca.Function("reduced", [body.z, lam], [slope]).map(n)
    multipliers = found.lam_g[: n * m].reshape(n, m)
    values = np.array(at(found.Y[body.columns].T, multipliers.T)).T
    positions = np.array([program.phases[p].valves for p in program.columns.phase_of])
    return np.asarray(values * (1.0 - 2.0 * positions))


def pulses(program: PhaseProgram, found: Iterate) -> list[Pulse]:
    """The pulses that promise most, the best one of every phase and valve, the best first.

    Each is about as long as valves must dwell, and as far from other switches of its valve.
    """
    costs, phases = reduced_costs(program, found), program.phases
    lasts = found.Y[program.columns.h[:, 0]] * STEP  # [s] of an element of each phase
    found_pulses = []
    for p, phase in enumerate(phases):
        long = max(1, int(np.ceil(program.task.min_dwell / lasts[p] - 1e-9)))
        for valve in range(costs.shape[1]):
            before = p > 0 and phases[p - 1].valves[valve] != phase.valves[valve]
            after = p + 1 < len(phases) and phases[p + 1].valves[valve] != phase.valves[valve]
            a, b = phase.first + long * before, phase.last - long * (after + 1)
            windows = [(float(costs[k : k + long, valve].sum()), k) for k in range(a, b + 1)]
            if windows:
                cost, k = min(windows)
                found_pulses.append(Pulse(p, valve, k, k + long, -cost))
    return sorted(found_pulses, key=lambda pulse: -pulse.gain)


def inserted(phases: Sequence[Phase], pulse: Pulse) -> list[Phase]:
    """The phases with a pulse."""
    own = phases[pulse.phase]
    valves = list(own.valves)
    valves[pulse.valve] = 1.0 - valves[pulse.valve]
    parts = [
        replace(own, last=pulse.first),
        Phase(pulse.first, pulse.last, own.modes, tuple(valves)),
        replace(own, first=pulse.last),
    ]
    cut = [part for part in parts if part.elements]
    return [*phases[: pulse.phase], *cut, *phases[pulse.phase + 1 :]]


def with_pulses(
    best: Solution, build: Callable[[Sequence[Phase]], PhaseProgram], control: Control
) -> Solution:
    """A solved program with pulses put in, one after the other, while they lower its cost.

    `build` makes the program of other phases on the same elements. A pulse that takes the motion
    off its order of contacts and stops has no solution near; after a few such the plan is left as
    it is.
    """
    left, failed = pulses(*best), 0
    while left and failed < FAILS:
        (program, solution), pulse = best, left.pop(0)
        least = PAYS * abs(solution.objective)
        if pulse.gain < least:
            break
        longer = build(inserted(program.phases, pulse))
        begin = carried(longer, program.columns, program.scheme.points, solution.Y)
        new = _solved(longer, Iterate(begin), control)
        if new is not None and new[1].objective < solution.objective - least:
            best, left = new, pulses(*new)
        else:
            failed += 1
    return best


def _solved(program: PhaseProgram, start: Iterate, control: Control) -> Solution | None:
    """A program with its solution; None where it has none near."""
    settings = Refining.current()
    stagnation = Stagnation(PATIENCE, UNDERWAY, settings.slow)
    found = solve(program, start, warm(settings.rough_iterations), control, stagnation)
    return (program, found) if found.solved else None
