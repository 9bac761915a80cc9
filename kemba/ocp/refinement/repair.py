"""Modes that do not fit: they are changed in the elements where an elastic program violates them.

The elastic program is an exact penalty: its slacks are zero but where modes contradict each other.
So the mode of a constraint changes in those elements only, the way the sign of the slack says.

Pulses of valves are put into a solved plan where its multipliers say that they lower the cost. With
valves fixed by phases, the derivative of the Lagrangian by a valve's position over one element is,
to first order, what the cost changes by if the valve is turned there: the mode insertion gradient
of a switched system (Egerstedt, Wardi and Axelsson, IEEE TAC 51, 2006).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from kemba.events import runs
from kemba.ocp.nlp.ending import Stagnation
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN, Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.settings import Refining
from kemba.ocp.refinement.start import carried, solve_along, warm
from kemba.ocp.transcription.layout import STEP

Solution = tuple[PhaseProgram, Iterate]
FAR = 0.1  # of the worst misfit
FITS = 10.0 * Refining.rough_rows  # a larger slack is no rounding


class Misfit(NamedTuple):
    """The mode of a constraint that is violated in an element: what it asks, the side, how far."""

    element: int
    constraint: int
    kind: str
    side: int
    size: float


def misfits(program: PhaseProgram, x: np.ndarray, fits: float = FITS) -> list[Misfit]:
    """What an elastic program violates by more than `fits` at `x` (size,), scaled variables, in the
    order of time. With an exact penalty, slacks of modes that fit are zero to its tolerance.
    """
    found: list[Misfit] = []
    for soft in program.soft:
        for way, side in ((soft.above, 1), (soft.below, -1)):
            for e, size in zip(soft.elements, x[way], strict=True) if way is not None else ():
                if size > fits:
                    found.append(Misfit(int(e), soft.constraint, soft.kind, side, float(size)))
    return sorted(found)


@dataclass(frozen=True)
class Misfitting:
    """Modes that do not fit: at which step of its elastic programs that showed, and what is
    violated in the solution x (size,) there."""

    step: int
    program: PhaseProgram
    x: np.ndarray
    wrong: Sequence[Misfit]

    @property
    def score(self) -> tuple[int, float]:
        """Better ones are smaller: how far it came, how much is violated."""
        return -self.step, sum(misfit.size for misfit in self.wrong)


ALONE = 3  # misfits that are repaired one by one: further ones are far smaller, or follow
KEPT = 5  # orders of modes: each holds a program


def best_first(known: Sequence[Misfitting]) -> list[Misfitting]:
    """The best of the orders of modes, the best one first."""
    return sorted(known, key=lambda one: one.score)[:KEPT]


def next_repair(
    known: Sequence[Misfitting],
    seen: Sequence[Sequence[Phase]],
    marks: Callable[[int], Sequence[int]],
) -> tuple[list[Phase], tuple[PhaseProgram, np.ndarray]] | None:
    """Phases that were not `seen` yet, and the program and solution (size,) they begin from: all
    misfits of the first of the `known` orders are repaired, then each of its worst alone, then
    those of the next. None where nothing is left. `marks`: where phases end on so many nodes."""
    for one in known:
        worst = sorted(one.wrong, key=lambda misfit: -misfit.size)[:ALONE]
        for part in (one.wrong, *([misfit] for misfit in worst)):
            phases = repaired(one.program, part, marks(one.program.nodes))
            if phases is not None and phases not in seen:
                return phases, (one.program, one.x)
    return None


def settled(program: PhaseProgram, found: Iterate) -> Iterate:
    """A solution of an elastic program as one of the same program without slacks."""
    x = found.Y.copy()
    for soft in program.soft:
        for slack in (soft.above, soft.below):
            if slack is not None:
                x[slack] = 0.0
    return replace(found, Y=x, objective=float(program.problem.grad_f(x, [])[0]))


def repaired(
    program: PhaseProgram, found: Sequence[Misfit], marks: Sequence[int]
) -> list[Phase] | None:
    """Phases with other modes where they do not fit; None where nothing is left to change.

    What is violated far less than the worst is left, for it may follow from that, and so is what
    comes later in the same touch. The times of borders are free, so a touch that is too early comes
    after the next event: it leaves the whole phase.
    """
    modes = np.array([p.modes for p in program.phases for _ in range(p.elements)])
    before, begun = modes.copy(), set()
    worst = max((misfit.size for misfit in found), default=0.0)
    for misfit in (m for m in found if m.size > FAR * worst):
        e, i = misfit.element, misfit.constraint
        own, new = before[:, i], modes[:, i].copy()
        if misfit.kind not in ("touch", "rate", "stays", "approach"):
            new[e] = _other(own, misfit)
            _change(program, modes, i, new)
            continue
        first = e
        while first > 0 and own[first - 1] != OPEN:
            first -= 1
        if (i, first) in begun:
            continue
        begun.add((i, first))
        phase = program.phases[program.columns.phase_of[e]]
        last = phase.last if e == first else e + 1
        new[e:last] = OPEN
        _change(program, modes, i, new)
    phases = [
        replace(p, first=e, last=e + 1, modes=tuple(int(m) for m in modes[e]))
        for p in program.phases
        for e in range(p.first, p.last)
    ]
    new = merged(phases, marks)
    return None if new == merged(program.phases, marks) else new


def _change(program: PhaseProgram, modes: np.ndarray, i: int, new: np.ndarray) -> None:
    """Give constraint `i` its `new` modes (elements,), unless the task says which feet stand, and
    this one would stand more or less often."""
    foot = program.task.contacts and program.constraints[i].friction is not None
    if not foot or len(runs(new != OPEN)) == len(runs(modes[:, i] != OPEN)):
        modes[:, i] = new


def _other(modes: np.ndarray, misfit: Misfit) -> int:
    """The mode that a violation suggests; `modes` (elements,): those of the constraint."""
    e, kind, side = misfit.element, misfit.kind, misfit.side
    mode = int(modes[e])
    if kind == "gap":  # closed still, or already, as beside it
        beside = [int(modes[k]) for k in (e - 1, e + 1) if 0 <= k < len(modes)]
        return max(beside) or HELD
    slides = {"slip": side, "settles": side, "cone forward": -1, "cone backward": 1}
    if kind == "settles" or (kind in slides and mode == HELD):
        return AHEAD if slides[kind] > 0 else BACK
    return HELD if kind in slides else mode


def merged(phases: Sequence[Phase], marks: Sequence[int]) -> list[Phase]:
    """Neighbours with the same modes and valves as one phase, except across `marks`."""
    found = [phases[0]]
    for phase in phases[1:]:
        last = found[-1]
        same = (last.modes, last.valves) == (phase.modes, phase.valves)
        if same and phase.first not in marks:
            found[-1] = replace(last, last=phase.last)
        else:
            found.append(phase)
    return found


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
    stagnation = Stagnation(PATIENCE, UNDERWAY, Refining.slow)
    found = solve_along(program, start, warm(Refining.pulse_iterations), control, stagnation)
    return (program, found) if found.solved else None
