"""Lengths of the legs from feet that stand: what needs no forces is found before any force.

A foot that stands is at the height of the ground, whatever pushes it. Lengths that bring more rows
of the logs to one height are believed where they do so much better than faults of sensors, and
where no mistake in the columns does better still. Nor where the ground is soft: a
foot sinks into it as it is loaded, and its load goes with the body's acceleration.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from kemba.identify.problem.problem import Array, Candidate, Flags
from kemba.identify.problem.sensor_faults import GEOMETRY
from kemba.identify.robot.batch import Batch
from kemba.identify.robot.contact import steady
from kemba.identify.robot.linear import Reference
from kemba.identify.robot.physics import Physics
from kemba.machine_code import SampleMap
from kemba.mechanism.knee import flexion_of
from kemba.mechanism.links import altered

LEVER = "boom_lever"


# How lengths are found from feet that stand.
EVERY = 0.005  # time between the samples that are used [s]
# height at which the ground may seem to be [m]: as the search for the ground in contact.py
LEVEL = 0.02
WINDOW = 5e-3  # height of the band in which standing feet are [m]
# lengths that are tried first, one at a time, in sizes
TRIED = (-3.5, -2.5, -1.75, -1.25, -0.75, -0.35, 0.35, 0.75, 1.25, 1.75, 2.5, 3.5)
BANDS = (0.02, 0.01, 5e-3, 4e-3)  # bands about the ground, from round to round [m]
NOISE = 7e-4  # noise of a standing foot's height [m]
TOGETHER = 4.0  # samples that err together, so that they count as one
PRIOR = 2.0  # prior width of a length, in sizes
REACH = 2.5  # largest value of each, in prior widths
BODY = 3e-3  # prior sigma of the zero of the body's height [m]
ZERO = 0.02  # the same where it is in doubt [m]
ANGLE = 4e-3  # prior sigma of the zeros of pitch and hips [rad]
PISTON = 6e-4  # prior sigma of the zero of a piston [m]
STOP = 2e-3  # the same where it is in doubt [m]
SINK = 3e-3  # prior sigma of how deep a foot sinks at rest [m]
SOFT = 5e-4  # the same from which feet have no one height that could tell of lengths [m]
LONGER = 0.04  # prior sigma of the boom's lever: two sizes
HELD = 1e-6  # width of what is not free, as a share: as good as none
DEEP = 0.02  # depth below the ground at which no foot can be [m]
OFTEN = 0.01  # share of samples so deep from which lengths are not believed
GAIN = 6.0  # gain over faults of sensors alone from which lengths are believed [nats]
# prior sigma of the zero of the pitch where mistakes are judged: no zero is taken for one [rad]
PITCH = 0.05


@dataclass(frozen=True)
class StandingLengths:
    """Theta with the `lengths` [m] at which feet stand; `lever`: share by which a longer boom makes
    them stand as well, 0 where none does."""

    lengths: Mapping[str, float] = field(default_factory=dict)
    lever: float = 0.0


class Standing:
    """Heights of the feet at samples of a motion, for any lengths of the legs.

    `names`: the lengths, as they are called in theta; zeros of pitch, height, hips and pistons, how
    deep a foot sinks at rest, and the share by which the boom is longer than drawn follow them in
    every vector x (k,).
    """

    def __init__(
        self, physics: Physics, batch: Batch, reference: Reference, names: Sequence[str]
    ) -> None:
        self.physics, self.names, self.legs = physics, tuple(names), len(physics.legs)
        dt = float(np.median(batch.h[batch.valid]))
        step = max(1, round(EVERY / dt))
        q = batch.flat(reference.q)[::step]
        y = physics.call("seen", q, 0 * q, p=physics.nominal)[0]
        lift = steady(reference.a[..., 1:2], dt) / physics.mechanism.need_robot().gravity
        load = np.maximum(1.0 + batch.flat(lift)[::step, 0], 0.0)
        self.samples = [q[:, : 3 + self.legs], y[:, -self.legs :], load[:, None]]
        self._map = self._compiled(physics)

    def _compiled(self, physics: Physics) -> SampleMap:
        """(q without knees, pistons, load, x) -> heights (legs,) and their slopes along x."""
        node, legs, robot = physics.node, self.legs, physics.mechanism.need_robot()
        x = ca.SX.sym("x", len(self.names) + 4 + 2 * legs)
        lengths = {n: x[i] for i, n in enumerate(self.names)}
        zeros = x[len(self.names) :]
        body, pistons, load = ca.SX.sym("q", 3 + legs), ca.SX.sym("s", legs), ca.SX.sym("load")
        shape = altered(robot, {n.removeprefix(GEOMETRY).removesuffix(".d"): d
                                for n, d in lengths.items()})  # fmt: skip
        extension = pistons - zeros[2 + legs : 2 + 2 * legs]
        knees = [
            place.fold * flexion_of(shape.leg, extension[i])
            for i, place in enumerate(robot.legs.values())
        ]
        off = ca.vertcat(0.0, zeros[1], zeros[0], zeros[2 : 2 + legs])
        longer = ca.vertcat(1 + zeros[-1], 1 + zeros[-1], ca.DM.ones(1 + legs))
        q = ca.vertcat((body - off) * longer, *knees)
        nominal = zip(physics.names, physics.nominal.tolist(), strict=True)
        p = ca.vertcat(*(lengths.get(n, ca.SX(value)) for n, value in nominal))
        height, places = physics.mechanism.scene.ground.height, node.outputs
        feet = ca.vertcat(
            *(places[f"{g}/foot/z"] - height(places[f"{g}/foot/x"]) for g in physics.legs)
        )
        heights = ca.substitute(feet, ca.vertcat(node.q, node.p), ca.vertcat(q, p))
        heights += load * zeros[-2]
        return SampleMap([body, pistons, load, x], [heights, ca.jacobian(heights, x)])

    def heights(self, x: Array) -> tuple[Array, Array]:
        """Heights (n, legs) [m] of the feet, and their slopes (n, legs, k)."""
        heights, slopes = self._map(self.samples, x)
        return heights, slopes


def standing_lengths(
    physics: Physics,
    batch: Batch,
    reference: Reference,
    candidates: Mapping[str, Candidate],
) -> StandingLengths:
    """The lengths at which feet stand on the ground; none where those of the model are as good, or
    where no lengths are candidates."""
    sizes = {c.key: c.lead.size for c in candidates.values() if c.effect.startswith(GEOMETRY)}
    if not sizes:
        return StandingLengths()
    standing = Standing(physics, batch, reference, tuple(sizes))
    legs = standing.legs
    zeros = [ANGLE, BODY, *[ANGLE] * legs, *[PISTON] * legs, SINK]
    lengths = [PRIOR * size for size in sizes.values()]
    free = np.array([*lengths, *zeros, LONGER])
    width = np.array([*lengths, *zeros, LONGER * HELD])
    start = np.zeros(len(width))
    most = len(_crowd(standing.heights(start)[0]))
    for i, size in enumerate(sizes.values()):
        for share in TRIED:
            trial = np.zeros(len(width))
            trial[i] = share * size
            count = len(_crowd(standing.heights(trial)[0]))
            if count > most:
                most, start = count, trial
    x, cost, rows = _refined(standing, start, width)
    if x[-2] > SOFT or min(_drawn(standing, x, width, rows)) - cost < GAIN:
        return StandingLengths()
    singles = [_only(standing, (i,), x, width, rows) for i in range(len(sizes))]
    one, alone, _ = min(singles, key=lambda fit: fit[1])
    x = one if alone - cost < GAIN else x
    if np.mean(standing.heights(x)[0] < -DEEP) > OFTEN:
        return StandingLengths()  # feet in the ground: columns are wrong, not lengths
    found = {n: float(d) for n, d in zip(sizes, x, strict=False) if abs(d) > 0.01 * sizes[n]}
    boom, by_boom, _ = _only(standing, (), x, free, rows)
    as_good = LEVER in candidates and by_boom - min(alone, cost) < GAIN
    return StandingLengths(found, float(boom[-1]) if as_good else 0.0)


def remarks(found: StandingLengths) -> list[str]:
    """In words, the lengths at which feet stand."""
    if not found.lengths:
        return []
    parts = (
        f"{name.removeprefix(GEOMETRY).removesuffix('.d')} is {1e3 * d:+.1f} mm off"
        for name, d in found.lengths.items()
    )
    said = f"feet stand on level ground if {' and '.join(parts)}"
    if not found.lever:
        return [f"{said}; contacts were read with that"]
    other = f"or if the boom is {100 * found.lever:+.1f} % longer than drawn"
    return [f"{said}, {other}; contacts were read with the former"]


def _drawn(standing: Standing, x: Array, width: Array, rows: Flags) -> Iterator[float]:
    """Costs of fits with the model's lengths: zeros as exact as supposed, or one kind in doubt."""
    first, legs = len(standing.names), standing.legs
    hips = list(range(first + 2, first + 2 + legs))
    doubts: Sequence[list[int]] = ([], [first + 1], [first], hips, [i + legs for i in hips])
    for places, wide in zip(doubts, (0.0, ZERO, PITCH, PITCH, STOP), strict=True):
        loose = width.copy()
        loose[places] = wide
        yield _only(standing, (), np.where(loose == width, x, 0.0), loose, rows)[1]


def _only(
    standing: Standing, free: Sequence[int], x: Array, width: Array, rows: Flags
) -> tuple[Array, float, Flags]:
    """The refined fit with all lengths but the `free` ones as the model has them."""
    held = np.array([i not in free for i in range(len(standing.names))])
    narrow, begin = width.copy(), x.copy()
    narrow[: len(held)][held] *= HELD
    begin[: len(held)][held] = 0.0
    return _refined(standing, begin, narrow, rows)


def _crowd(heights: Array) -> Array:
    """The heights of the samples that stand at one height near that of the ground."""
    near = np.sort(heights[np.abs(heights) < LEVEL])
    ends = np.searchsorted(near, near + WINDOW)
    first = int(np.argmax(ends - np.arange(len(near)))) if len(near) else 0
    return near[first : ends[first]] if len(near) else near


def _refined(
    standing: Standing, x: Array, width: Array, rows: Flags | None = None
) -> tuple[Array, float, Flags]:
    """The best x (k,) with prior widths (k,), its cost, and which samples stand (n, legs)."""
    weight = 1.0 / (NOISE * np.sqrt(TOGETHER))
    cost = 0.0
    for band in BANDS:
        heights, _ = standing.heights(x)
        crowd = _crowd(heights)
        level = float(np.median(crowd)) if len(crowd) else 0.0
        known = np.abs(heights - level) < band if rows is None else rows
        x, cost = _fit(standing, x, width, known, weight)
    return x, cost, known


def _fit(
    standing: Standing, x: Array, width: Array, rows: Flags, weight: float
) -> tuple[Array, float]:
    """The fit of the samples `rows` to the ground, robust against feet that do not stand."""

    def residual(z: Array) -> Array:
        return np.append(weight * standing.heights(z * width)[0][rows], z)

    def slopes(z: Array) -> Array:
        return np.vstack([weight * standing.heights(z * width)[1][rows] * width, np.eye(len(z))])

    start = np.clip(x / width, -0.99 * REACH, 0.99 * REACH)
    found = least_squares(
        residual, start, slopes, (-REACH, REACH), loss="soft_l1", f_scale=2.0, max_nfev=10
    )
    return found.x * width, float(found.cost)
