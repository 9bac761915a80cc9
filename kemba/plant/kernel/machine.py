"""What the kernel is given: a model's machine code and structure, memory to work in, a state."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

GAMMA = 1.0 - 0.5**0.5  # of ROS2, which is L-stable with it; no tuning number
# How long steps of a simulation are, where none is asked for.
# largest difference between both stages, in `speed`, `spin` or an effect state's scale (apexes
# agree with steps of 12.5 us within 0.005 mm (docs/plant.md))
TOLERANCE = 3e-5
SPEED = 1.0  # m.s-1; usual speed of a jump
SPIN = 5.0  # rad.s-1; usual turning rate of a jump
SHORTEST_STEP = 2.5e-5  # s; shortest step
FIRST_STEP = 1e-4  # s; first step
LONGEST_STEP = 5e-4  # s; longest step (1 ms would step over a touch and release within it)


class KernelModel(NamedTuple):
    """A model as the kernel sees it.

    Addresses of machine code, functions of x = (q, v, s, u, p, a, lam): `full` and `smooth` give
    `Memory.full` and `Memory.air`, `smooth` without D and A; `pairs` gives `Memory.pairs` and
    `gap`, `outputs` the columns of a log. Sizes: n coordinates, ns effect states, nl forces.
    Pairs as in `PairTable`: `gaps` (ng,), `rigid` (ng,), `group` (nl,), `ungapped` (nl,); `hard`
    (nl,): rows of instances with a rigid gap; `slips` (nl, nl): row i names the rows of slip that
    the slip speed i bounds. `scale` (n + ns,): usual sizes of velocities and effect states.
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
    scale: Array


class Lcp(NamedTuple):
    """A complementarity problem 0 <= z _|_ A z + b >= 0 of up to nl unknowns.

    `on`: the active set, a guess before and the answer after. The rest is memory.
    """

    A: Array
    b: Array
    z: Array
    on: Array
    inner: Array
    right: Array
    places: Array
    table: Array
    basis: Array
    left: Array


class Memory(NamedTuple):
    """Where the kernel works. `full` and `smooth` (n, 2 n + 1 + nl) hold D | M | F | B of the
    motion, `air` and `later` (ns, ns + 1) hold A | f of the effect states, `pairs` and `before`
    (nl, n + nl + 1) hold W | L | w0. `rows` (nl,) begins with the pairs that take part, `held`
    (nl,) is the active set of the last step, `v` and `old` (n,) are velocities."""

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
    v: Array
    old: Array
    rows: Array
    held: Array
    hits: Array
    lcp: Lcp


class State(NamedTuple):
    """Coordinates, velocities and effect states `y` (2 n + ns,) at a `time` (1,) [s]; `gap` (ng,)
    [m] and its `rate` [m/s] of every position pair."""

    time: Array
    y: Array
    gap: Array
    rate: Array


def lcp_memory(n: int) -> Lcp:
    """Memory for problems of up to `n` unknowns."""
    square, vector = np.zeros((2, n, n)), np.zeros((3, n))
    whole, truth = np.zeros((2, n), dtype=int), np.zeros((2, n), dtype=bool)
    return Lcp(
        A=square[0],
        b=vector[0],
        z=vector[1],
        on=truth[0],
        inner=square[1],
        right=vector[2],
        places=whole[0],
        table=np.zeros((n, 2 * n + 2)),
        basis=whole[1],
        left=truth[1],
    )


def memory(m: KernelModel, inputs: int, parameters: int, outputs: int) -> Memory:
    """Memory for a model with so many inputs, free parameters and outputs."""
    n, ns, nl, ng = m.n, m.ns, m.nl, len(m.gaps)
    shapes = {
        "x": (3 * n + ns + inputs + parameters + nl,),
        "full": (n, 2 * n + 1 + nl),
        "smooth": (n, 2 * n + 1 + nl),
        "air": (ns, ns + 1),
        "later": (ns, ns + 1),
        "pairs": (nl, n + nl + 1),
        "before": (nl, n + nl + 1),
        "gap": (ng,),
        "y": (outputs,),
        "left": (n, n),
        "inertia": (n, n),
        "X": (n, 1 + nl),
        "Y": (n, 1 + nl),
        "air_left": (ns, ns),
        "k1": (ns, 1),
        "k2": (ns, 1),
        "v": (n,),
        "old": (n,),
    }
    return Memory(
        **{name: np.zeros(shape) for name, shape in shapes.items()},
        rows=np.zeros(nl, dtype=int),
        held=np.zeros(nl, dtype=bool),
        hits=np.zeros(ng, dtype=bool),
        lcp=lcp_memory(nl),
    )


def state(m: KernelModel) -> State:
    """A state of zeros."""
    ng = len(m.gaps)
    return State(np.zeros(1), np.zeros(2 * m.n + m.ns), np.zeros(ng), np.zeros(ng))
