"""Replay: a plan's own inputs, open loop, on the finely simulated same model."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kemba.events import (
    EXECUTED,
    PLANNED,
    STAYS,
    UPRIGHT,
    EventComparison,
    compared,
    ends_standing,
    gap,
    read,
    turned,
)
from kemba.model import Model
from kemba.plant.commands import Commands, Profile
from kemba.plant.record import Impact
from kemba.plant.simulate import Simulated, run
from kemba.trajectory import Array, Trajectory


@dataclass(frozen=True)
class EndError:
    """Of a motion that ends in the air or moving: executed minus planned pitch [rad], velocity of
    the body [m/s] and rate of its pitch [rad/s] at the end of the plan."""

    pitch_rad: float
    velocity_m_s: float
    rate_rad_s: float


@dataclass(frozen=True)
class Replay:
    """How far an execution is from its plan; errors are executed minus planned.

    `apex_error_m`: of the highest point. `touchdown_error_s`: of the first landing after it, None
    where there is none. `fault`: what the robot does wrong (`tips over`). It is None when at the
    end the feet that stand in the plan stand, the body is as upright as planned after as many
    turns, and neither a hip nor a knee met the ground. `end`: errors of a motion that does not end
    at rest on its feet; such a one is judged by them.
    """

    apex_error_m: float
    touchdown_error_s: float | None
    final_error_m: float
    fault: str | None
    trajectory: Trajectory
    impacts: tuple[Impact, ...]
    compared: EventComparison = field(default_factory=EventComparison)
    end: EndError | None = None

    @property
    def landed(self) -> bool:
        """Whether nothing is wrong with the end: a landing is kept, or the body is as upright as
        planned where the plan does not land."""
        return self.fault is None

    def summary(self) -> dict[str, Any]:
        """The figures of the certificate."""
        return {
            "apex_error_m": self.apex_error_m,
            "touchdown_error_s": self.touchdown_error_s,
            "final_error_m": self.final_error_m,
            "landed": self.landed,
            "fault": self.fault,
            "order_kept": not self.compared.difference,
            "events": [event.json() for event in self.compared.events],
            "end": self.end and vars(self.end),
        }


def replay(model: Model, plan: Trajectory, step: float | None = None) -> Replay:
    """Execute the inputs of `plan` on `model` from the plan's first node.

    Input k of an implicit Euler plan acts on (t[k-1], t[k]]; valves act as planned, without dead
    time. Raises KembaError when the plan lacks columns of the model.
    """
    clock = plan.time - plan.time[0]
    profiles = {
        quantity.name: Profile.of(clock[:-1], plan[quantity.name][1:])
        for quantity in model.inputs.values()
    }
    done = run(
        model, first_row(model, plan), Commands(profiles), float(clock[-1]), step, dead_time=False
    )
    return judge(model, plan, clock, done)


def first_row(model: Model, plan: Trajectory) -> dict[str, float]:
    """Coordinates, velocities and effect states at the start of a plan, as far as it has them."""
    names = [q.name for q in model.state]
    names += [f"{leg}/piston/x" for leg in model.mechanism.legs]
    present = (name for name in names if name in plan and np.isfinite(plan[name][0]))
    return {name: float(plan[name][0]) for name in present}


def judge(model: Model, plan: Trajectory, clock: Array, done: Simulated) -> Replay:
    """Compare what was executed with the plan, whose times are `clock` [s] of the execution."""
    real, weight = done.trajectory, model.mechanism.weight
    was = read(plan, PLANNED, weight, clock)
    now = read(real, EXECUTED, weight, hits=_hits(done.impacts))
    found = compared(was, now)
    late = (one.late for one in found.landings() if one.planned > was.top[0])
    standing = ends_standing(plan, model.mechanism.legs)
    at = float(real.time[-1] if standing else clock[-1])

    def off(name: str) -> float:
        return float(np.interp(at, real.time, real[name]) - plan[name][-1])

    end = None
    if not standing:
        velocity = float(np.hypot(off("body/vx"), off("body/vz")))
        end = EndError(off("body/pitch"), velocity, off("body/pitch_rate"))
    return Replay(
        apex_error_m=now.top[1] - was.top[1],
        touchdown_error_s=next(late, None),
        final_error_m=float(np.hypot(off("body/x"), off("body/z"))),
        fault=_fault(model, plan, clock, real, standing),
        trajectory=real,
        impacts=done.impacts,
        compared=found,
        end=end,
    )


def _hits(impacts: Iterable[Impact]) -> dict[str, list[float]]:
    """When [s] the foot of each leg hits the ground."""
    found: dict[str, list[float]] = {}
    for impact in impacts:
        for leg, _, pair in (label.rpartition("/") for label in impact.labels):
            if pair.startswith("contact:"):
                found.setdefault(leg, []).append(impact.time)
    return found


def _fault(
    model: Model, plan: Trajectory, clock: Array, real: Trajectory, standing: list[str]
) -> str | None:
    pitch = float(real["body/pitch"][-1])
    planned = float(plan["body/pitch"][-1]) if "body/pitch" in plan else 0.0
    if turned(pitch, planned) > UPRIGHT:
        return "tips over"
    if abs(pitch - planned) > np.pi:
        return "ends upright, but another number of turns away"
    for point in ("hip", "knee"):
        for leg in model.mechanism.legs:
            low = gap(real, leg, point) <= 0.0
            if f"{leg}/{point}/z" in plan:  # a plan may lie on the ground itself
                low &= np.interp(real.time, clock, gap(plan, leg, point)) > 0.0
            if low.any():
                return f"meets the ground with the {leg} {point}"
    up = [leg for leg in standing if gap(real, leg)[-1] > STAYS]
    return f"ends with the {up[0]} foot in the air" if up else None
