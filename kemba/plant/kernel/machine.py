"""What the kernel is given: a model's machine code and structure, memory to work in, a state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kemba.plant.stepping.arrays import Array


class Machine(NamedTuple):
    """A model as the kernel sees it.

    Addresses of machine code, functions of x = (q, v, s, u, p, a, lam): `full` and `smooth` give
    `Memory.full` and `Memory.air`, `smooth` without D and A; `pairs` gives `Memory.pairs` and
    `gap`, `outputs` the columns of a log. Sizes: n coordinates, ns effect states, nl forces.
    Pairs as in `PairTable`: `gaps` (ng,), `rigid` (ng,), `group` (nl,), `ungapped` (nl,); `hard`
    (nl,): rows of instances with a rigid gap; `slips` (nl, nl): row i names the rows of slip that
    the slip speed i bounds.
    """

    full: int
    smooth: int
    pairs: int
    outputs: int
    n: int
    ns: int
    nl: int
    gaps: Array
    rigid: Array
    group: Array
    ungapped: Array
    hard: Array
    slips: Array


class Memory(NamedTuple):
    """Where the kernel works. `full` and `smooth` (n, 2 n + 1 + nl) hold D | M | F | B of the
    motion, `air` and `later` (ns, ns + 1) hold A | f of the effect states, `pairs` and `before`
    (nl, n + nl + 1) hold W | L | w0; `held` is the active set of the last step."""

    x: Array
    full: Array
    smooth: Array
    air: Array
    later: Array
    pairs: Array
    before: Array
    gap: Array
    y: Array
    left: Array
    inertia: Array
    X: Array
    Y: Array
    air_left: Array
    k1: Array
    k2: Array
    held: Array


class State(NamedTuple):
    """Coordinates, velocities and effect states `y` (2 n + ns,) at a `time` (1,) [s]; `gap` (ng,)
    [m] and its `rate` [m/s] of every position pair."""

    time: Array
    y: Array
    gap: Array
    rate: Array


def memory(m: Machine, nu: int, np_: int, ny: int) -> Memory:
    """Memory for a model with `nu` inputs, `np_` free parameters and `ny` outputs."""
    n, ns, nl, ng = m.n, m.ns, m.nl, len(m.gaps)
    shapes = {
        "x": (3 * n + ns + nu + np_ + nl,),
        "full": (n, 2 * n + 1 + nl),
        "smooth": (n, 2 * n + 1 + nl),
        "air": (ns, ns + 1),
        "later": (ns, ns + 1),
        "pairs": (nl, n + nl + 1),
        "before": (nl, n + nl + 1),
        "gap": (ng,),
        "y": (ny,),
        "left": (n, n),
        "inertia": (n, n),
        "X": (n, 1 + nl),
        "Y": (n, 1 + nl),
        "air_left": (ns, ns),
        "k1": (ns, 1),
        "k2": (ns, 1),
    }
    return Memory(
        **{name: np.zeros(shape) for name, shape in shapes.items()}, held=np.zeros(nl, dtype=bool)
    )


def state(m: Machine) -> State:
    """A state of zeros."""
    ng = len(m.gaps)
    return State(np.zeros(1), np.zeros(2 * m.n + m.ns), np.zeros(ng), np.zeros(ng))
