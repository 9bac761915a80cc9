"""The paper's bench rigs: what they impose on a piston, from YAML, and their logs."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, product
from pathlib import Path
from typing import Annotated, Any, Literal

import casadi as ca
import numpy as np
from pydantic import Field

from kemba.config import FileName, Section, find_config, load_yaml, parse
from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.model.rest import Buffered, at_rest, rate_of
from kemba.plant.commands import Profile, among, breaks, delayed, input_table, merged
from kemba.plant.kernel.machine import GAMMA, Array
from kemba.plant.repeat import Sensors, take_log
from kemba.quantity import Param
from kemba.trajectory import Trajectory

ImposedMotion = Callable[[Array], tuple[Array, Array]]  # times (m,) -> x [m], v [m/s]


STEP = 2e-4  # s; longest step of the air


def drive(
    model: Model,
    motion: ImposedMotion,
    valves: Mapping[str, Profile],
    times: Array,
    start: Mapping[str, float] | None = None,
    step: float | None = None,
    dead_time: bool = True,
) -> Trajectory:
    """The force of a bench piston moved as `motion` says, sampled at `times` (m,) [s].

    `valves` are commands as sent, by column name; effect states begin at `start` or at what they
    come to at rest with the first commands. Raises KembaError when the model's motion is free.
    """
    if not model.mechanism.imposed:
        raise KembaError(model.name, "its motion is free", hint="use kemba.plant.simulate")
    step = STEP if step is None else step
    acting = delayed(model, dict(valves)) if dead_time else dict(valves)
    times, node = np.asarray(times, dtype=float), model.node
    edges = breaks([*acting.values(), *valves.values()], times[0], times[-1])
    marks = merged(times, edges)
    u, sent = (np.nan_to_num(input_table(model, p, marks)) for p in (acting, valves))
    if start is None:
        s = at_rest(model, motion(times[:1])[0], u[0])
    else:
        s = np.array([start.get(q.name, q.value) for q in model.states.values()], dtype=float)
    states = [s]
    for held, (begin, end) in zip(u, pairwise(marks), strict=False):
        count = max(1, int(np.ceil((end - begin) / step - 1e-6)))
        for (x, x1), (v, v1) in zip(
            *map(pairwise, motion(np.linspace(begin, end, count + 1))), strict=True
        ):
            (s,) = air_step(model)(x, v, s, held, x1, v1, (end - begin) / count)
        states.append(s.ravel().copy())
    wanted = among(marks, times)
    s, u, sent = np.array(states)[wanted], u[wanted], sent[wanted]
    still, (x, v) = np.zeros((1, len(times))), motion(times)
    measured = node.measure.map(len(times))(x[None], v[None], still, s.T, 0.0 * s.T, [], u.T, [])
    quantities = [*model.states.values(), *model.inputs.values(), *node.output_quantities]
    columns: dict[str, Array] = {}
    for quantity, values in zip(quantities, [*s.T, *sent.T, *np.array(measured)], strict=True):
        columns.setdefault(quantity.header, values)
    return Trajectory(times, columns)


@lru_cache(maxsize=8)
def air_step(model: Model) -> Buffered:
    """The effect states `h` [s] later while the piston goes from (q, v) to (q1, v1), from
    (q, v, s, u, q1, v1, h): as a step of the kernel does it, see `kemba.plant.kernel.step`."""
    node, h = model.node, ca.SX.sym("h")
    q1, v1 = ca.SX.sym("q1"), ca.SX.sym("v1")
    rate = rate_of(node)
    f = ca.Function("f", [node.q, node.v, node.s, node.u], [rate])
    left = ca.SX.eye(node.s.numel()) - GAMMA * h * ca.jacobian(rate, node.s)
    k1 = ca.solve(left, rate)
    k2 = ca.solve(left, f(q1, v1, node.s + h * k1, node.u) - 2 * k1)
    after = ca.densify(node.s + h * (3 * k1 + k2) / 2)
    return Buffered(ca.Function("step", [node.q, node.v, node.s, node.u, q1, v1, h], [after]))


def locked(x: float) -> ImposedMotion:
    """A rod held at `x` [m]."""
    return lambda t: (np.full(len(t), x), np.zeros(len(t)))


def stroke(begin: float, speed: float, after: float, ramp: float, stop: float) -> ImposedMotion:
    """A stroke: at rest at `begin` [m] until `after` [s], then moved at `speed` [m/s] to `stop`
    [m].

    The speed is reached within `ramp` [s]. Raises KembaError where the way is too short for it.
    """
    acceleration = speed / ramp
    reach = begin + 0.5 * acceleration * ramp**2

    def motion(t: Array) -> tuple[Array, Array]:
        late = np.clip(t - after, 0.0, None)
        up = np.minimum(late, ramp)
        x = begin + 0.5 * acceleration * up**2 + speed * (late - up)
        over = (x - stop) * np.sign(speed) > 0.0
        return np.where(over, stop, x), np.where(over, 0.0, acceleration * up)

    if (stop - reach) * np.sign(speed) <= 0.0:
        raise KembaError("rig", f"the stroke is too short for {speed:g} m/s")
    return motion


def hermite(knots: Array, x: Array, v: Array) -> ImposedMotion:
    """Cubic pieces through positions `x` and speeds `v` (k,) at the times `knots` (k,)."""
    from scipy.interpolate import CubicHermiteSpline

    spline = CubicHermiteSpline(knots, x, v)
    rate = spline.derivative()
    return lambda t: (spline(t), rate(t))


def monotone(knots: Array, x: Array) -> ImposedMotion:
    """A way through the positions `x` (k,) at the times `knots` (k,) that never overshoots them.

    Where it turns round, and at both ends, it rests for a moment.
    """
    from scipy.interpolate import PchipInterpolator

    v = PchipInterpolator(knots, x)(knots, 1)
    v[[0, -1]] = 0.0
    motion = hermite(knots, x, v)
    return lambda t: motion(np.clip(t, knots[0], knots[-1]))


def followed(log: Trajectory) -> ImposedMotion:
    """The motion of a bench log; its speed is the log's where it has one."""
    x = log["piston/x"]
    v = log["piston/v"] if "piston/v" in log else np.gradient(x, log.time)
    return hermite(log.time, x, v)


Length = Annotated[float, Param("m", lower=0.0, doc="rod extension")]
Speed = Annotated[float, Param("m.s-1", lower=0.0, doc="rod speed")]
Second = Annotated[float, Param("s", lower=0.0, doc="time")]
Hertz = Annotated[float, Param("Hz", lower=0.0, doc="rate")]
Pressure = Annotated[float, Param("Pa", lower=0.0, doc="supply pressure")]
Mode = Literal["extend", "retract", "both", "none"]
VALVES: dict[str, tuple[float, float]] = {
    "extend": (1.0, 0.0),
    "retract": (0.0, 1.0),
    "both": (1.0, 1.0),
    "none": (0.0, 0.0),
}
# up to what each mode reaches on its own, m/s
SPEEDS: dict[Mode, tuple[float, ...]] = {
    "extend": (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25),
    "retract": (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0),
    "both": (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8),
    "none": (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0),
}


@dataclass(frozen=True)
class Test:
    """One test of a rig: what moves, what is switched, when it is sampled [s]."""

    name: str
    supply: float
    motion: ImposedMotion
    valves: dict[str, Profile]
    times: Array
    facts: dict[str, Any]


class Rig(Section):
    """What every rig has: supply pressures, logging rate, repetitions."""

    name: FileName
    notes: str = ""
    supplies: tuple[Pressure, ...] = (0.7e6,)
    repeats: int = Field(default=1, ge=1, le=100)
    rate: Hertz = 2000.0

    def tests(self, rng: np.random.Generator, stroke: float) -> Iterator[Test]:
        """The tests in order, of a cylinder of `stroke` [m]; random ones are drawn from `rng`.
        Raises KembaError where a position lies beyond the stroke."""
        raise NotImplementedError

    @property
    def numbers(self) -> range:
        """Of the repetitions of a test."""
        return range(1, self.repeats + 1)

    def clock(self, duration: float) -> Array:
        """Sample times [s] of a test."""
        return np.arange(int(duration * self.rate) + 1) / self.rate


def check_places(key: str, places: Iterable[float], stroke: float) -> None:
    """Raise KembaError, which blames a `key`, for a place [m] beyond the stroke."""
    for x in places:
        if x > stroke:
            what = f"{1e3 * x:g} mm is beyond the stroke"
            raise KembaError(f"rig.{key}", what, f"0 to {1e3 * stroke:g} mm was expected")


class LockedRig(Rig):
    """A locked rod on a force transducer; one chamber fills or vents (paper, Fig. 3 and 4).

    `positions`: by default both ends of the stroke.
    """

    kind: Literal["locked"] = "locked"
    chamber: Literal["extend", "retract"] = "extend"
    positions: tuple[Length, ...] | None = None
    switch: tuple[Literal["fill", "vent"], ...] = ("fill", "vent")
    command: Second = 0.02
    duration: Second = 0.35

    def tests(self, rng: np.random.Generator, stroke: float) -> Iterator[Test]:
        """As of every rig. Raises KembaError where a position is outside of the stroke."""
        positions = (0.0, stroke) if self.positions is None else self.positions
        check_places("positions", positions, stroke)
        each = product(self.supplies, positions, self.switch, self.numbers)
        for supply, x, switch, number in each:
            steps = [0.0, 1.0] if switch == "fill" else [1.0, 0.0]
            valve = Profile(np.array([-1.0, self.command]), np.array(steps))
            facts = {"test": "locked", "switch": switch, "position": x}
            name = f"{switch}-{1e3 * x:.0f}mm-{supply / 1e6:.1f}MPa-{number}"
            valves, times = {f"valve/{self.chamber}": valve}, self.clock(self.duration)
            yield Test(name, supply, locked(x), valves, times, facts)


class DynamometerRig(Rig):
    """Constant `speeds` in each valve mode (paper, Fig. 5 and 6).

    The opposing piston behind its flow-restricting valve is replaced by its purpose: a rod
    speed that is constant after `ramp`. The chambers have settled before the rod moves.
    """

    kind: Literal["dynamometer"] = "dynamometer"
    speeds: dict[Mode, tuple[Speed, ...]] = Field(default_factory=lambda: dict(SPEEDS))
    ramp: Second = 0.005
    settle: Second = 0.05

    def tests(self, rng: np.random.Generator, stroke: float) -> Iterator[Test]:
        cases = [(mode, speed) for mode, speeds in self.speeds.items() for speed in speeds]
        for supply, (mode, speed), number in product(self.supplies, cases, self.numbers):
            yield self._test(supply, mode, speed, number, stroke)

    def _test(self, supply: float, mode: str, speed: float, number: int, way: float) -> Test:
        u_e, u_r = VALVES[mode]
        valves = {"valve/extend": Profile.constant(u_e), "valve/retract": Profile.constant(u_r)}
        begin, end, sign = (way, 0.0, -1.0) if mode == "retract" else (0.0, way, 1.0)
        motion = stroke(begin, sign * speed, self.settle, self.ramp, end)
        times = self.clock(self.settle + self.ramp + way / speed)
        name = f"{mode}-{1e3 * speed:.0f}mms-{supply / 1e6:.1f}MPa-{number}"
        return Test(name, supply, motion, valves, times, {"test": "dynamometer", "mode": mode})


class RandomRig(Rig):
    """Random valve commands and random motion (paper, Fig. 7).

    Every 1/`frequency` both valves are drawn anew and the rod is at a uniformly random position
    with a uniformly random speed; cubic pieces lie in between.
    """

    kind: Literal["random"] = "random"
    frequency: Hertz = 10.0
    speed: Speed = 0.6
    duration: Second = 10.0

    def tests(self, rng: np.random.Generator, stroke: float) -> Iterator[Test]:
        knots = np.arange(int(self.duration * self.frequency) + 2) / self.frequency
        times = self.clock(self.duration)
        for supply, number in product(self.supplies, self.numbers):
            motion = hermite(knots, *self._states(len(knots), rng, stroke))
            valves = {
                f"valve/{chamber}": Profile.of(knots, rng.integers(0, 2, len(knots)))
                for chamber in ("extend", "retract")
            }
            name = f"random-{supply / 1e6:.1f}MPa-{number}"
            yield Test(name, supply, motion, valves, times, {"test": "random"})

    def _states(self, count: int, rng: np.random.Generator, stroke: float) -> tuple[Array, Array]:
        """Positions and speeds whose cubic pieces stay within the stroke."""
        x, v = [stroke / 2], [0.0]
        inside = np.linspace(0.0, 1.0, 21)
        while len(x) < count:
            place, speed = rng.uniform(0.0, stroke), rng.uniform(-self.speed, self.speed)
            knots = np.array([0.0, 1.0 / self.frequency])
            piece = hermite(knots, np.array([x[-1], place]), np.array([v[-1], speed]))
            path = piece(inside / self.frequency)[0]
            if path.min() >= 0.0 and path.max() <= stroke:
                x.append(place)
                v.append(speed)
            elif rng.random() < 0.02:  # a corner without a way out: go back one
                x, v = (x[:-1], v[:-1]) if len(x) > 1 else (x, v)
        return np.array(x), np.array(v)


class CourseRig(Rig):
    """A motion and valve commands that are written down, as `kemba-opt experiment` designs them.

    The rod is at the `places` one after the other, with `every` between them; it turns round, or
    rests, where the way does. `extend` and `retract`: spans of time in which each valve is on.
    """

    kind: Literal["course"] = "course"
    places: tuple[Length, ...] = Field(min_length=2, max_length=1000)
    every: Annotated[float, Param("s", lower=1e-3, doc="time from place to place")]
    extend: tuple[tuple[Second, Second], ...] = ()
    retract: tuple[tuple[Second, Second], ...] = ()

    @property
    def duration(self) -> float:
        """Time of the course [s]."""
        return self.every * (len(self.places) - 1)

    def tests(self, rng: np.random.Generator, stroke: float) -> Iterator[Test]:
        """As of every rig. Raises KembaError where a place is outside of the stroke, or spans of a
        valve are not one after the other."""
        check_places("places", self.places, stroke)
        valves = {"valve/extend": spans("extend", self.extend)}
        valves["valve/retract"] = spans("retract", self.retract)
        motion = monotone(self.every * np.arange(len(self.places)), np.array(self.places))
        for supply, number in product(self.supplies, self.numbers):
            name, times = f"course-{supply / 1e6:.1f}MPa-{number}", self.clock(self.duration)
            yield Test(name, supply, motion, valves, times, {"test": "course"})


def spans(valve: str, on: Sequence[tuple[float, float]]) -> Profile:
    """A valve that is on in these spans [s]. Raises KembaError where they overlap."""
    edges = [time for span in on for time in span]
    if any(later <= earlier for earlier, later in pairwise(edges)):
        what = "has spans that overlap or end before they begin"
        raise KembaError(f"rig.{valve}", what, "[begin, end] one after the other was expected")
    values = [0.0] + [float(i % 2 == 0) for i in range(len(edges))]
    return Profile(np.array([-1.0, *edges]), np.array(values))


AnyRig = Annotated[LockedRig | DynamometerRig | RandomRig | CourseRig, Field(discriminator="kind")]


FORCE_NOISE = 0.3  # N, 1 sigma of a bench force transducer


class RigFile(Section):
    """A rig YAML: `rig` holds one of the rigs."""

    rig: AnyRig


def load_rig(name: str | Path) -> Rig:
    """The rig of a YAML file, or a shipped one. Raises KembaError with every mistake."""
    return parse(load_yaml(find_config(name, "rigs")), RigFile).rig


def bench_model(name: str | Path, supply: float) -> Model:
    """The bench piston of a model YAML at a supply pressure [Pa]."""
    return load_model(name, supply=supply, rig=True)


def run_rig(
    rig: Rig, model: Callable[[float], Model], seed: int = 0, noise: bool = False
) -> Iterator[tuple[str, Trajectory]]:
    """Names and bench logs of a rig's tests; `model` gives the piston at a supply pressure [Pa].

    Deterministic by `seed`.
    """
    rng = np.random.default_rng(seed)
    models = {supply: model(supply) for supply in rig.supplies}
    sensors = Sensors(noise={"F": FORCE_NOISE, "x": 1e-5, "P": 1e3} if noise else {})
    for test in rig.tests(rng, models[rig.supplies[0]].mechanism.stroke):
        piston = models[test.supply]
        truth = drive(piston, test.motion, test.valves, test.times)
        log = take_log(truth, sensors, rng, piston.effects)
        log.meta |= {"kind": "bench", "rig": rig.name, "supply": test.supply, **test.facts}
        yield test.name, log


def write_rig(
    rig: Rig, model: Callable[[float], Model], out: str | Path, seed: int = 0, noise: bool = False
) -> list[Path]:
    """Run a rig and write one log per test; the paths in order."""
    paths = []
    for name, log in run_rig(rig, model, seed, noise):
        paths.append(Path(out) / f"{name}.csv")
        log.write(paths[-1])
    return paths
