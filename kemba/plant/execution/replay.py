"""Replay: a plan's own inputs, open loop, on the finely simulated same model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.model import Model
from kemba.plant.simulation.commands import Commands, Profile
from kemba.plant.simulation.record import Impact
from kemba.plant.simulation.simulate import Simulated, run
from kemba.plant.stepping.arrays import Array
from kemba.scene import above_ground
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Trajectory


class LandingSettings(Settings):
    """What counts as standing, as a touchdown and as a landing."""

    on_ground: float = setting(1e-3, "m", "planned feet below this stand", CHOSEN)
    touches: float = setting(1e-4, "m", "planned feet below this touch", CHOSEN)
    exact: float = setting(
        1e-6, "m", "executed feet below this touch", "derived: the kernel's closed gap"
    )
    lifted: float = setting(5e-3, "m", "a foot above this at the end stands no more", CHOSEN)
    upright: float = setting(0.35, "rad", "a landing with more pitch has failed", CHOSEN)
    lasts: float = setting(
        0.02,
        "s",
        "a shorter contact is no touchdown, unless it takes as much as the weight in that",
        "derived: the weight takes 0.2 m/s of the fall in that time",
    )
    settle: float = setting(
        0.3, "s", "the last commands are held so long before a landing is judged", CHOSEN
    )


@dataclass(frozen=True)
class Replay:
    """How far an executed plan ends from the plan; errors are executed minus planned.

    `touchdown_error_s`, of the first touchdown that carries the body, is None when either has none
    after its apex. `fault`: what the robot does wrong (`tips over`). It is None when at the end the
    feet that stand in the plan stand, the body is upright, and neither a hip nor a knee met the
    ground.
    """

    apex_error_m: float
    touchdown_error_s: float | None
    final_error_m: float
    fault: str | None
    trajectory: Trajectory
    impacts: tuple[Impact, ...]

    @property
    def landed(self) -> bool:
        """Whether nothing is wrong with the landing."""
        return self.fault is None

    def summary(self) -> dict[str, float | bool | str | None]:
        """The figures of the certificate."""
        return {
            "apex_error_m": self.apex_error_m,
            "touchdown_error_s": self.touchdown_error_s,
            "final_error_m": self.final_error_m,
            "landed": self.landed,
            "fault": self.fault,
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
    mechanism = model.mechanism
    listed = [*mechanism.coordinates, *mechanism.velocities, *model.states.values()]
    names = [q.name for q in listed] + [f"{leg}/piston/x" for leg in mechanism.legs]
    present = (name for name in names if name in plan and np.isfinite(plan[name][0]))
    return {name: float(plan[name][0]) for name in present}


def judge(model: Model, plan: Trajectory, clock: Array, done: Simulated) -> Replay:
    """Compare what was executed with the plan, whose times are `clock` [s] of the execution."""
    real, settings = done.trajectory, LandingSettings.current()
    planned = int(np.argmax(plan["body/z"]))
    apex_time, apex = peak(real.time, real["body/z"])
    weight = model.mechanism.weight
    was = _landings(touches(plan, clock, float(clock[planned]), settings.touches, weight))
    now = _landings(touches(real, real.time, apex_time, settings.exact, weight))
    impacts = [i.time for i in done.impacts if any("contact:" in label for label in i.labels)]
    exact = [_exact(time, real.time, apex_time, impacts) for time in now]
    late = [n - w for n, w in zip(exact, was, strict=False)] if was and now else []
    final = np.array([real[name][-1] - plan[name][-1] for name in ("body/x", "body/z")])
    return Replay(
        apex_error_m=apex - float(plan["body/z"][planned]),
        touchdown_error_s=min(late, key=abs, default=None),
        final_error_m=float(np.hypot(*final)),
        fault=_fault(model, plan, real, apex_time),
        trajectory=real,
        impacts=done.impacts,
    )


def peak(time: Array, z: Array) -> tuple[float, float]:
    """Time [s] and height [m] of the highest point, by the parabola through its neighbours."""
    i = int(np.argmax(z))
    if not 0 < i < len(z) - 1:
        return float(time[i]), float(z[i])
    c, b, a = np.polynomial.polynomial.polyfit(time[i - 1 : i + 2] - time[i], z[i - 1 : i + 2], 2)
    shift = -b / (2 * a) if a < 0 else 0.0
    return float(time[i] + shift), float(c + shift * (b + a * shift))


def touches(
    t: Trajectory, clock: Array, after: float, low: float, weight: float
) -> list[tuple[float, bool]]:
    """When [s] a foot that was in the air touches, after `after`, and whether it carries the body.

    A foot touches while it is below `low` [m]. A contact carries if it lasts 20 ms or to the
    end, or if its force, without impacts, adds up to what the weight [N] does in 20 ms (0.2 m/s).
    A foot that grazes the ground on its way does neither.
    """
    found, least = [], LandingSettings.current().lasts
    for foot, height in above_ground(t).items():
        down = height <= low
        force = t[f"{foot}/Fz"] if f"{foot}/Fz" in t else np.zeros(len(t))
        edges = np.flatnonzero(np.diff(down.astype(int), prepend=1, append=0))
        for i in (i for i in edges if i < len(t) and down[i] and clock[i] > after):
            end = int(edges[edges > i][0])  # the first row in the air again
            took = float(np.trapezoid(force[i:end], clock[i:end]))
            lasts = end == len(t) or clock[end] - clock[i] >= least
            found.append((float(clock[i]), bool(lasts or took >= least * weight)))
    return sorted(found)


def _landings(found: list[tuple[float, bool]]) -> list[float]:
    """The first touch that carries the body, and the first touch at all; none if none carries.

    Whether a short touch carries is a matter of degree: plan and execution are compared by both,
    and the nearer pair counts.
    """
    carrying = [time for time, carries in found if carries]
    return [carrying[0], found[0][0]] if carrying else []


def _exact(time: float, rows: Array, after: float, impacts: list[float]) -> float:
    """The time [s] of the impact in the row before `time`: rows are coarser than impacts."""
    before = max(after, float(rows[rows < time - 1e-9].max(initial=-np.inf)))
    return min([i for i in impacts if before < i <= time + 1e-9], default=time)


def ends_standing(model: Model, plan: Trajectory) -> list[str]:
    """The legs on which a plan stands at its end."""
    low, feet = LandingSettings.current().on_ground, above_ground(plan)
    return [
        leg
        for leg in model.mechanism.legs
        if f"{leg}/foot" not in feet or feet[f"{leg}/foot"][-1] <= low
    ]


def _fault(model: Model, plan: Trajectory, real: Trajectory, apex_time: float) -> str | None:
    standing, settings = ends_standing(model, plan), LandingSettings.current()
    if not standing:
        return "ends in the air"
    if abs(real["body/pitch"][-1]) > settings.upright:
        return "tips over"
    late = real.time > apex_time
    for point in ("hip", "knee"):
        for place, height in above_ground(real, point).items():
            if (height[late] <= 0.0).any():
                return f"meets the ground with the {place.replace('/', ' ')}"
    feet = above_ground(real)
    up = [leg for leg in standing if feet[f"{leg}/foot"][-1] > settings.lifted]
    return f"ends with the {up[0]} foot in the air" if up else None
