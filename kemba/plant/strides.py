"""Strides of a periodic motion in a row: how many an execution keeps, how errors grow in one."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.events import UPRIGHT
from kemba.model import Model
from kemba.ocp.reading import joined
from kemba.plant.commands import Commands, Profile
from kemba.plant.kernel.machine import Array
from kemba.plant.replay import Replay, first_row
from kemba.plant.simulate import run
from kemba.trajectory import Trajectory

SUNK = 0.1  # m; a body so far below its plan at the end of a stride has fallen
STEP = 1e-5  # of a state's scale; central differences of the stride map


def kept(plan: Trajectory, done: Replay | None, count: int) -> int:
    """How many of `count` strides an execution of them ends as planned: upright and not sunk.

    `plan` is the single stride, by whose clock the execution runs.
    """
    if done is None:
        return 0
    real, lasts = done.trajectory, plan.time[-1] - plan.time[0]
    for k in range(1, count + 1):
        row = int(np.argmin(np.abs(real.time - k * lasts)))
        sunk = plan["body/z"][-1] - real["body/z"][row] > SUNK
        turned = abs(real["body/pitch"][row] - plan["body/pitch"][-1]) > UPRIGHT
        if sunk or turned:
            return k - 1
    return count


def multipliers(model: Model, plan: Trajectory) -> Array:
    """Floquet multipliers (n,), complex, of the stride on its own model, inputs as planned.

    Eigenvalues of the derivative, by central differences, of the state after a stride with respect
    to the state before it, without `body/x`. Above 1 in size, errors grow from stride to stride.
    Raises KembaError where a stride cannot be simulated.
    """
    listed = [q for q in model.state if q.name != "body/x"]
    after = _stride_map(model, plan)
    columns = []
    for q in listed:
        up, down = (after({q.name: sign * STEP * q.scale}) for sign in (1.0, -1.0))
        columns.append([(up[o.name] - down[o.name]) / (2 * STEP * q.scale) for o in listed])
    return np.asarray(np.linalg.eigvals(np.array(columns).T))


def _stride_map(model: Model, plan: Trajectory) -> Callable[[dict[str, float]], dict[str, float]]:
    """From changes of the state at the start of a stride to the state at its end."""
    clock, start = plan.time - plan.time[0], first_row(model, plan)
    inputs = {q.name: Profile.of(clock[:-1], plan[q.name][1:]) for q in model.inputs.values()}

    def after(change: dict[str, float]) -> dict[str, float]:
        begin = {name: value + change.get(name, 0.0) for name, value in start.items()}
        done = run(model, begin, Commands(inputs), float(clock[-1]), dead_time=False).trajectory
        return {name: float(done[name][-1]) for name in start}

    return after


@dataclass(frozen=True)
class Stability:
    """What a periodic motion does stride after stride: strides kept of `of`, by execution, and the
    largest Floquet multiplier on its own model, None where it could not be computed."""

    of: int
    kept: dict[str, int]
    largest: float | None

    def json(self) -> dict[str, Any]:
        """The entry `strides` of the certificate."""
        return {"of": self.of, **self.kept, "largest_multiplier": self.largest}

    @property
    def sentence(self) -> str:
        """In words."""
        own, plant = self.kept["table_replay"], self.kept["plant_replay"]
        kept = f"{own} of {self.of} strides on its own model, {plant} on the simulated robot"
        text = f"open loop {kept}"
        if self.largest is not None:
            grow = "grow" if self.largest > 1.0 else "shrink"
            text += f"; errors {grow} {self.largest:.3g} times a stride"
        return text


def stability(
    model: Model,
    plan: Trajectory,
    count: int,
    execute: Callable[[Trajectory], dict[str, Replay | None]],
) -> Stability:
    """How stable a periodic plan is; `execute` plays strides in a row, by name of the execution."""
    done = execute(joined([plan] * count))
    try:
        largest: float | None = float(np.abs(multipliers(model, plan)).max())
    except (KembaError, np.linalg.LinAlgError):
        largest = None
    names = ("replay", "table_replay", "plant_replay")
    return Stability(count, {n: kept(plan, done.get(n), count) for n in names}, largest)
