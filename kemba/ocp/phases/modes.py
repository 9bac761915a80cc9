"""The mode sequence of an implicit Euler plan: which contacts and stops are closed, which slide.

Phases are also written as texts, which a run keeps so that another plan can start from them.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from kemba.events import runs
from kemba.model import Model
from kemba.ocp.phases.settings import Reading
from kemba.ocp.transcription.course import OPENED, PHASE
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.unilateral import Constraint
from kemba.trajectory import Trajectory

OPEN, HELD, AHEAD, BACK = 0, 1, 2, 3  # open; closed and sticking; sliding forward, backward


@dataclass(frozen=True)
class Phase:
    """Intervals first+1 .. last with the same modes of constraints and valve positions."""

    first: int
    last: int
    modes: tuple[int, ...]
    valves: tuple[float, ...]

    @property
    def elements(self) -> int:
        """Number of elements of the phase."""
        return self.last - self.first

    def active(self, i: int) -> bool:
        """Whether constraint `i` is active: the contact is closed, the stop touched."""
        return self.modes[i] != OPEN


def read_phases(
    model: Model,
    constraints: Sequence[Constraint],
    plan: Trajectory,
    valves: np.ndarray,
    marks: Sequence[int],
    trim: bool = False,
    brief: float = 0.0,
    asked: Mapping[str, np.ndarray] | None = None,
) -> list[Phase]:
    """Phases of a plan with `valves` (rows, n); a phase ends at every node of `marks` too.

    `trim`: a foot that slides under little load has left the ground. A foot that touches for less
    than `brief` [s] on its way through the air does not touch. `asked`: whether a foot stands, by
    the label of its contact (rows,), where the task says it; what its force says is then left.
    """
    asked = asked or {}
    modes = np.column_stack([_modes(model, c, plan, trim, asked.get(c.label)) for c in constraints])
    for i, c in enumerate(constraints):
        if c.friction is not None and c.label not in asked:
            drop_grazes(modes[:, i], plan.time, brief)
    _valves_first(modes, valves)
    same = (modes[1:] == modes[:-1]).all(axis=1) & (valves[1:] == valves[:-1]).all(axis=1)
    borders = sorted({0, len(plan) - 1, *(np.flatnonzero(~same[1:]) + 1).tolist(), *marks})
    rows = itertools.pairwise(borders)
    phases = [
        Phase(a, b, tuple(int(m) for m in modes[b]), tuple(float(u) for u in valves[b]))
        for a, b in rows
    ]
    return [*phases[:-2], *_settling(phases[-3:])] if len(phases) > 2 else phases


def _settling(phases: Sequence[Phase]) -> list[Phase]:
    """The last two of three phases.

    A stop or a foot may close one interval before the last valve switch. Then the switch is put
    first. Implicit Euler spreads an impact over two intervals; in continuous time it is over at
    once, and air that still flows would push the piston off the stop.
    """
    before, hit, last = phases
    closes = any(a == OPEN != b for a, b in zip(before.modes, hit.modes, strict=True))
    between = hit.modes == last.modes and hit.valves == before.valves != last.valves
    if closes and between and hit.elements == 1:
        hit = replace(hit, modes=before.modes, valves=last.valves)
    return [hit, last]


def _modes(
    model: Model,
    constraint: Constraint,
    plan: Trajectory,
    trim: bool,
    asked: np.ndarray | None,
) -> np.ndarray:
    """Mode of a constraint at every row (rows,); `asked`: where it is closed, if the task says."""
    x, node, reading = arrays(model, plan), model.node, Reading
    names = [constraint.gap]
    if constraint.friction is not None:
        names.append(constraint.friction.slip)
    evaluate = ca.Function("at", [node.q, node.v], names)
    found = evaluate.map(len(plan)).call([x["q"].T, x["v"].T])
    values = [np.array(value).ravel() for value in found]
    if asked is not None and constraint.friction is not None:
        slides = np.abs(values[1]) > reading.slides
        return np.where(asked, np.where(slides, np.where(values[1] > 0, AHEAD, BACK), HELD), OPEN)
    force = x["lam"][:, constraint.force] / model.mechanism.weight
    modes = np.where(force * reading.stiff > np.maximum(values[0], 0.0), HELD, OPEN)
    if values[0][0] < reading.closed and modes[1] == OPEN:
        modes[1] = HELD  # a contact that is closed at the start has a force
    _fill_hops(modes, values[0], reading.shudder)
    if constraint.friction is not None:
        light = force < reading.light
        slides = np.abs(values[1]) > reading.slides
        for a, b in _runs(modes):
            if b - a <= reading.brief and light[a:b].all():
                modes[a:b] = OPEN
        if trim:
            modes[light & slides] = OPEN
        _fill_hops(modes, values[0], reading.hop)
        closed = modes != OPEN
        modes[closed & slides] = np.where(values[1] > 0, AHEAD, BACK)[closed & slides]
    return np.asarray(modes)


def drop_grazes(modes: np.ndarray, time: np.ndarray, brief: float) -> None:
    """Open a contact that closes for less than `brief` [s] between two times in the air."""
    for a, b in _runs(modes):
        if a > 1 and b < len(modes) and time[b - 1] - time[a - 1] < brief:
            modes[a:b] = OPEN


def _fill_hops(modes: np.ndarray, gap: np.ndarray, hop: float) -> None:
    """Close a gap that opens by less than `hop` [m] for a step or two between two touches."""
    touches = _runs(modes)
    for (_, a), (b, _) in itertools.pairwise(touches):
        if b - a <= Reading.brief and gap[a:b].max() < hop:
            modes[a:b] = HELD


def _valves_first(modes: np.ndarray, valves: np.ndarray) -> None:
    """Where modes and valves change at one node, change the modes one step later.

    Their times are free in the program; a phase between them lets both be found.
    """
    for k in range(2, len(modes) - 1):
        both = (modes[k] != modes[k - 1]).any() and (valves[k] != valves[k - 1]).any()
        if both and (modes[k + 1] == modes[k]).all():
            modes[k] = modes[k - 1]


def _runs(modes: np.ndarray) -> list[tuple[int, int]]:
    """Half-open ranges of rows in which a constraint is closed, the first row aside."""
    return [(a + 1, b + 1) for a, b in runs(modes[1:] != OPEN)]


LETTERS = {OPEN: OPENED, HELD: "h", AHEAD: "a", BACK: "b"}
MODES = {letter: mode for mode, letter in LETTERS.items()}


def phase_notes(phases: Sequence[Phase], constraints: Sequence[Constraint]) -> dict[str, Any]:
    """Entries of a plan's sidecar.

    A phase is a text such as `12-18 ho 10`: from node 12 to 18 the first of `phase_constraints`
    is held and the second open (`a`, `b`: it slides ahead or back), the first valve is open.
    """
    listed = [
        f"{p.first}-{p.last} {''.join(LETTERS[m] for m in p.modes)} "
        f"{''.join(str(int(u)) for u in p.valves)}"
        for p in phases
    ]
    return {"phase_constraints": [c.label for c in constraints], "phases": listed}


def noted_phases(
    meta: Mapping[str, Any], constraints: Sequence[Constraint], valves: int, nodes: int
) -> list[Phase] | None:
    """The phases that `phase_notes` wrote; None where there are none that fit.

    They fit for the same `constraints`, as many `valves`, and a plan of `nodes` intervals.
    """
    if list(meta.get("phase_constraints") or []) != [c.label for c in constraints]:
        return None
    found = [PHASE.fullmatch(str(text)) for text in meta.get("phases") or []]
    phases = [
        Phase(int(m[1]), int(m[2]), tuple(MODES[x] for x in m[3]), tuple(float(u) for u in m[4]))
        for m in found
        if m is not None
    ]
    borders = [0, *(p.last for p in phases)]
    joined = [p.first for p in phases] == borders[:-1] and bool(np.all(np.diff(borders) > 0))
    sizes = {(len(p.modes), len(p.valves)) for p in phases}
    fits = phases and None not in found and joined and sizes == {(len(constraints), valves)}
    return phases if fits and borders[-1] == nodes else None
