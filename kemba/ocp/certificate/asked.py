"""What a task asks, measured on a written motion: every requirement, by an evaluation of its own.

The programs lower a requirement to bounds and rows, and leave out what follows from others. Nothing
of that is used here: values come from the columns of the motion, and between nodes from its joints.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.effects.mechanics.ground import Contact
from kemba.events import LASTS, PLANNED, read
from kemba.mechanism.knee import felt
from kemba.model import Model
from kemba.ocp.task.expressions import along
from kemba.ocp.task.requirement import SCALES, Requirement, landing_nodes, quantity_expression
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.course import begin_ways, cubic
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.unilateral import rigid_constraints
from kemba.trajectory import Array, Trajectory

BETWEEN = 8  # parts of every interval at which bounds are looked at
CLOSED = 1e-6  # m; a smaller gap touches
EULER_SPEED = 0.01  # m/s; what of an impact's speed the row of a step leaves open


@dataclass(frozen=True)
class MeasuredRequirement:
    """One requirement on a motion: the value furthest beyond its limits, or nearest to them.

    `line`: where the task asks for it (`jump.yaml:31`); `text`: what it asks, with the quantity
    (`end.*/foot/z:front/foot/z`); `value`, `lower`, `upper` and `allowed`, by which the value may
    be beyond its limits, in `unit`; `node`, `time_s`: where it is,
    the node before it where it is between two.
    """

    line: str
    text: str
    value: float
    lower: float
    upper: float
    unit: str
    allowed: float
    scale: float
    node: int
    time_s: float

    @property
    def goal(self) -> str:
        """The name of the goal that it is, empty for all else."""
        kind, _, name = self.text.partition(":")[0].partition(".")
        return name if kind == "goals" else ""

    @property
    def miss(self) -> float:
        """How far the value is beyond its limits; infinite where there is none."""
        over = max(self.lower - self.value, self.value - self.upper, 0.0)
        return float(over) if np.isfinite(self.value) else np.inf

    @property
    def met(self) -> bool:
        """Whether the requirement is kept."""
        return self.miss <= self.allowed

    @property
    def sentence(self) -> str:
        """What is asked and what is there: `end.body/z:body/z` (jump.yaml:31) is
        0.441 m at 0.700 s, 0.5 m asked: 0.059 m off."""
        asked, at = _range(self.lower, self.upper, self.unit), f"at {self.time_s:.3f} s"
        line = f" ({self.line})" if self.line else ""
        there, off = _with_unit(self.value, self.unit), _with_unit(self.miss, self.unit)
        return f"`{self.text}`{line} is {there} {at}, {asked} asked: {off} off"

    def json(self) -> dict[str, Any]:
        """The entry of the certificate."""
        numbers = {"value": self.value, "lower": self.lower, "upper": self.upper}
        known = {name: x if np.isfinite(x) else None for name, x in numbers.items()}
        return {"line": self.line, "text": self.text, **known, "unit": self.unit, "met": self.met}


def measured(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> tuple[MeasuredRequirement, ...]:
    """Every requirement of a task on a plan, in the order of the task.

    Nodes may miss by the task's tolerance of bounds; between them, where no program asks for
    anything, lengths and angles of a bound by what the re-simulation may. A plan that is yet to be
    refined is measured at its nodes: implicit Euler is coarse between them.
    """
    last_one = "phases" in plan.meta or task.refine != "radau"
    course = _between(model, requirements if last_one else (), plan)
    found = [_on_plan(requirement, task, plan, course) for requirement in _at_nodes(requirements)]
    return (*found, *_of_the_task(model, task, requirements, plan))


def on_execution(
    asked: Sequence[Requirement],
    plan: Trajectory,
    real: Trajectory,
    way: float,
    end: float,
    late: float,
) -> tuple[MeasuredRequirement, ...]:
    """The requirements on lengths and angles on an execution of a plan, by the plan's clock.

    `way`, `end`: how far [m] the execution may be from the plan up to its landing, and from there
    on; angles at an arm of `SCALES`. `late`: how much earlier or later [s] it may be, where a bound
    begins or ends under way. Rates, forces and valves at one instant are not compared: an execution
    that touches down a millisecond later has others.
    """
    clock, found = plan.time - plan.time[0], []
    landed = min(read(plan, PLANNED, clock=clock).landing, float(clock[-1]))
    for requirement in _at_nodes(asked):
        quantity = requirement.quantity
        if quantity.unit not in ("m", "rad") or requirement.minus is not None:
            continue
        there = along(quantity.name, real)
        if there is None or (requirement.lower, requirement.upper) == (-np.inf, np.inf):
            continue
        if requirement.at is not None:
            time = np.array([clock[requirement.node(len(plan) - 1)]])
            values = np.interp(time, real.time, there)
        else:
            at = requirement.nodes(len(plan) - 1)
            begin, until = clock[at[0]] + late * (at[0] > 0), clock[at[-1]]
            until -= late * (at[-1] < len(plan) - 1)
            rows = (real.time >= begin) & (real.time <= until)
            time, values = real.time[rows], there[rows]
        parts = [(time < landed, way), (time >= landed, end)]
        each = [
            _worst(requirement, values[part], time[part], most / SCALES["m"] * requirement.scale)
            for part, most in parts
            if part.any()
        ]
        found += [m for m in each if not m.met][:1] or each[:1]
    return tuple(found)


def _at_nodes(requirements: Iterable[Requirement]) -> list[Requirement]:
    """Those that hold at nodes or between them; contacts are measured by their order."""
    return [r for r in requirements if r.location[0] != "contacts"]


def _on_plan(
    requirement: Requirement, task: Task, plan: Trajectory, course: Course
) -> MeasuredRequirement:
    name, last = requirement.quantity.name, len(plan) - 1
    times, course_values = course
    exact = task.tolerances.bounds * requirement.scale
    exact += 0.0 if "phases" in plan.meta else requirement.loose
    values = _values(requirement, plan)
    if values is None:
        return _worst(requirement, np.array([np.nan]), plan.time[[-1]], exact)
    at = np.array(requirement.nodes(last))
    nodes = _worst(requirement, values[at], plan.time[at], exact, at)
    if requirement.at is not None or name not in course_values or not nodes.met:
        return nodes
    inside = (times >= plan.time[at[0]]) & (times <= plan.time[at[-1]])
    if not inside.any():
        return nodes
    between = task.tolerances.apex / SCALES["m"] * requirement.scale
    time = times[inside]
    before = np.searchsorted(plan.time, time) - 1
    way = _worst(requirement, course_values[name][inside], time, between, before)
    return way if not way.met or way.miss > nodes.miss else nodes


def _values(requirement: Requirement, plan: Trajectory) -> Array | None:
    """What is asked about at every node (n,), less what is subtracted; None without its columns."""
    values = along(requirement.quantity.name, plan)
    if requirement.minus is None or values is None:
        return values
    earlier = along(requirement.minus.name, plan)
    return None if earlier is None else values - earlier[requirement.minus.node(len(plan) - 1)]


def _worst(
    requirement: Requirement, values: Array, time: Array, allowed: float, nodes: Array | None = None
) -> MeasuredRequirement:
    """The value furthest beyond the limits of a requirement, or nearest to them."""
    beyond = np.maximum(requirement.lower - values, values - requirement.upper)
    i = int(np.argmax(np.where(np.isfinite(values), beyond, np.inf)))
    quantity = requirement.quantity
    return MeasuredRequirement(
        line=requirement.line,
        text=requirement.label,
        value=float(values[i]),
        lower=requirement.lower,
        upper=requirement.upper,
        unit=quantity.unit,
        allowed=allowed,
        scale=requirement.scale,
        node=int(nodes[i]) if nodes is not None else 0,
        time_s=float(time[i]),
    )


Course = tuple[Array, dict[str, Array]]  # times (n,) [s], values (n,) by name


def _between(model: Model, requirements: Iterable[Requirement], plan: Trajectory) -> Course:
    """The requirements' lengths and angles between the nodes of a plan, whose coordinates are
    cubics on every interval."""
    node = model.node
    wanted = {
        r.quantity.name: quantity_expression(model, r.quantity.name)
        for r in requirements
        if r.at is None and r.quantity.unit in ("m", "rad")
    }
    others = ca.vertcat(node.v, node.s, node.lam, node.u)
    kept = {n: g for n, g in wanted.items() if not ca.depends_on(ca.SX(g), others)}
    if not kept:
        return np.zeros(0), {}
    x, h = arrays(model, plan), np.diff(plan.time)[:, None]
    share = np.arange(1, BETWEEN) / BETWEEN
    q0, q1, end = x["q"][:-1], x["q"][1:], h * x["v"][1:]
    begin = begin_ways(plan.meta, x["q"], h * x["v"][:-1], end)
    time = [plan.time[:-1] + s * h[:, 0] for s in share]
    f = ca.Function("course", [node.q], [ca.densify(ca.vertcat(*kept.values()))])
    rows = np.concatenate([cubic(q0, q1, begin, end, s) for s in share])
    values = np.array(f.map(len(rows))(rows.T))
    return np.concatenate(time), dict(zip(kept, values, strict=True))


def _of_the_task(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> Iterator[MeasuredRequirement]:
    """What keys of their own ask: the duration, how long valves stay, soft landings, grip."""
    last, inf = len(plan) - 1, np.inf

    def of(
        key: str,
        value: float,
        lower: float,
        upper: float,
        unit: str = "s",
        node: int = last,
        loose: float = 0.0,
    ) -> MeasuredRequirement:
        scale = task.duration if unit == "s" else 1.0
        allowed, time = task.tolerances.bounds * scale, float(plan.time[node])
        limits = lower, upper, unit, allowed + loose, scale
        return MeasuredRequirement(task.place(key), key, value, *limits, node, time)

    euler = "phases" not in plan.meta
    spread = task.step_variation * task.duration
    lasts = float(plan.time[-1] - plan.time[0])
    yield of("duration", lasts, task.duration - spread, task.duration + spread)
    dwell = _shortest_dwell(model, plan)
    if dwell is not None and task.min_dwell:
        # an implicit Euler plan switches at nodes, whose steps vary
        yield of("min_dwell", dwell, task.min_dwell, inf, loose=task.step * euler)
    if task.landing.impact_speed is not None:
        speed, node = _fastest_impact(model, plan, landing_nodes(requirements, last))
        # an implicit Euler plan knows the speed of an impact to what gravity adds in a step
        most, loose = task.landing.impact_speed, EULER_SPEED * euler
        yield of("landing.impact_speed", speed, -inf, most, "m.s-1", node, loose)
    if task.contacts:
        parts = float(len(task.contacts))
        yield of("contacts", float(_stances_in_order(task, plan)), parts, parts, "1")
    if task.grip < 1.0 and (grip := grip_of(model, plan)) is not None:
        yield of("grip", grip, -inf, task.grip, "1")


def _stances_in_order(task: Task, plan: Trajectory) -> int:
    """How many parts of `contacts` a plan has in their order before it first departs from it.

    Feet that leave or come together do so to within `LASTS`, unless the stance between is the part
    that comes next; a foot that scuffs in between is counted, however short.
    """
    legs = {name.split("/")[0] for name in plan.names if name.endswith("/foot/Fz")}
    stands = zip(*((plan[f"{leg}/foot/Fz"] > 0.0)[1:] for leg in legs), strict=True)
    found = [{leg for leg, on in zip(legs, row, strict=True) if on} for row in stands]
    spans = [list(rows) for _, rows in itertools.groupby(range(len(found)), found.__getitem__)]
    order = [found[rows[0]] for rows in spans]
    asked = [set(part.on) for part in task.contacts]
    kept = order[:1]
    for rows, stance, after in zip(spans[1:], order[1:], [*order[2:], None], strict=True):
        brief = plan.time[rows[-1] + 1] - plan.time[rows[0]] < LASTS
        on_the_way = after is not None and kept[-1] & after <= stance <= kept[-1] | after
        is_next = asked[len(kept) : len(kept) + 1] == [stance]
        if stance != kept[-1] and (is_next or not (brief and on_the_way)):
            kept.append(stance)
    same = itertools.takewhile(lambda pair: pair[0] == pair[1], zip(kept, asked, strict=False))
    return min(sum(1 for _ in same), 2 * len(asked) - len(kept))


def _shortest_dwell(model: Model, plan: Trajectory) -> float | None:
    """The shortest time [s] between two switches of one valve; None where none switches twice."""
    found = []
    for name in (q.name for q in model.inputs.values() if q.binary):
        edges = plan.time[:-1][np.flatnonzero(np.diff(plan[name][1:])) + 1]
        found += [b - a for a, b in itertools.pairwise(edges)]
    return float(min(found)) if found else None


def _fastest_impact(model: Model, plan: Trajectory, nodes: list[int]) -> tuple[float, int]:
    """The largest speed [m/s] of feet and stops that close at some nodes, and its node."""
    node, x = model.node, arrays(model, plan)
    speed, at = 0.0, len(plan) - 1
    for constraint in rigid_constraints(model, whole(node)):
        f = ca.Function("gap", [node.q, node.v], [constraint.gap, constraint.rate])
        gap, rate = (np.array(part).ravel() for part in f.map(len(plan))(x["q"].T, x["v"].T))
        closes = np.flatnonzero((gap[:-1] > CLOSED) & (gap[1:] <= CLOSED)) + 1
        for k in closes[np.isin(closes, nodes)]:
            if "phases" not in plan.meta:  # implicit Euler: the rate that the step stopped
                rate[k] = rate[k - 1]
            own = -felt(model.mechanism, constraint.label) * float(rate[k])
            speed, at = max((speed, at), (own, int(k)))
    return speed, at


def _range(lower: float, upper: float, unit: str) -> str:
    if lower == upper:
        return _with_unit(lower, unit)
    least = [f"at least {_with_unit(lower, unit)}"] * bool(lower > -np.inf)
    most = [f"at most {_with_unit(upper, unit)}"] * bool(upper < np.inf)
    return " and ".join(least + most)


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".removesuffix(" 1")


LOADED = 1e-3  # least load of a foot that counts, of the weight or its impulse in a second
SLIDES = 1e-4  # m.s-1; a foot that slides uses all its friction by itself


def grip_of(model: Model, plan: Trajectory) -> float | None:
    """The largest share of the friction cone, 0 to 1, that sticking feet and impacts need in
    a plan; None on another ground, or where there is no load."""
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    if ground is None or not ground.mu:
        return None
    shares = []
    for leg in model.mechanism.legs:
        for tangential, normal in (("Fx", "Fz"), ("impulse_x", "impulse_z")):
            names = [f"{leg}/foot/{name}" for name in (tangential, normal)]
            if not all(name in plan for name in names):
                continue
            push, load = (plan[name] for name in names)
            on = load > LOADED * model.mechanism.weight
            if f"{leg}/foot/slip" in plan:
                on &= plan[f"{leg}/foot/slip"] < SLIDES
            x = plan.get(f"{leg}/foot/x", np.zeros(len(plan)))
            mu = np.broadcast_to(model.mechanism.scene.ground.friction(x, ground.mu), x.shape)
            shares += [np.abs(push[on]) / (mu[on] * load[on])]
    used = np.concatenate(shares) if shares else np.array([])
    return float(used.max()) if len(used) else None
