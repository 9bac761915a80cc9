"""Playing a policy on a simulated robot."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.plant.commands import Commands
from kemba.plant.controller import PERIOD, Execution, condition_of, read_controller
from kemba.plant.repeat import VALVE_SCATTER, Play, Sensors
from kemba.plant.simulate import simulate_one
from kemba.policy.modes import FINE, Array
from kemba.policy.player import Policy
from kemba.trajectory import Trajectory


@dataclass
class Driver:
    """Feeds a policy with what sensors measure, and valves with what it sends, late."""

    policy: Policy
    model: Model
    knees: dict[str, ca.Function]  # by piston column: its extension by the angle of the knee
    noise: dict[str, float]
    rng: np.random.Generator
    scatter: float = 0.0
    wait: int = 0  # ticks before the simulation begins, of a robot that is held

    def __post_init__(self) -> None:
        self.count, self.torques = 0, np.zeros(len(self.policy.data["joints"]))
        self.sent = [[(-np.inf, 0.0)] for _ in self.policy.valves]
        self.names = self.policy.measured
        self.joints = [str(j) for j in self.policy.data["joints"]]
        self.fine = FINE
        self.commands: list[Array] = []

    def __call__(self, time: float, sense: Mapping[str, float]) -> dict[str, float]:
        fine = self.fine
        while self.count % fine == 0 and self.policy.tick <= self.wait + self.count // fine:
            self._tick(time, sense)
        self.count += 1
        asked = {f"{j}/tau": float(t) for j, t in zip(self.joints, self.torques, strict=True)}
        for name, history in zip(self.policy.valves, self.sent, strict=True):
            asked[name] = next(value for at, value in reversed(history) if at <= time + 1e-9)
        return asked

    def _tick(self, time: float, sense: Mapping[str, float]) -> None:
        y = np.array([self._read(name, sense) for name in self.names])
        rates = np.array([sense[f"{j}/w"] for j in self.joints])
        self.torques, valves = self.policy.step(y, rates)
        self.commands.append(valves)
        for name, history, value in zip(self.policy.valves, self.sent, valves, strict=True):
            if value != history[-1][1]:
                on, off = self.model.timing(name.split("/")[0])
                late = (on if value else off) + self.scatter * self.rng.standard_normal()
                history.append((max(time + late, history[-1][0]), float(value)))

    def _read(self, name: str, sense: Mapping[str, float]) -> float:
        value = sense.get(name, np.nan)
        if name in self.knees:
            value = float(self.knees[name](sense[f"{name.split('/')[0]}/knee/q"]))
        sigma = self.noise.get(name.split("/")[-1], 0.0)
        return float(value + sigma * self.rng.standard_normal())


def execute_policy(
    run: str | Path | Trajectory,
    policy: Policy,
    model: Model,
    extra: float = 0.0,
    start: dict[str, float] | None = None,
    sample: float | Array = 1e-3,
    noise: bool = False,
    scatter: float = 0.0,
    seed: int | list[int] = 0,
) -> Execution:
    """Play a policy around a controller table on `model`; arguments as those of `execute`.

    `noise`: of the sensors that the policy reads; `scatter` [s] (1 sigma) of every switching.
    Raises KembaError when the table lacks a column.
    """
    table = read_controller(run)
    condition = condition_of(table, model, extra=extra, start=start, sample=sample)
    usual = Sensors.usual().noise if noise else {}
    rng = np.random.default_rng(seed)
    held = round((condition.begin - table.time[0]) / PERIOD)
    driver = Driver(policy, model, _knees(model), usual, rng, scatter, held)
    commands = Commands({}, driver, PERIOD / FINE)
    done = simulate_one(replace(condition, commands=commands))
    return Execution(done, _sent(table, policy, driver.commands))


def _sent(table: Trajectory, policy: Policy, commands: list[Array]) -> Trajectory:
    """The table with the valve commands that were sent."""
    rows = np.array(commands + [commands[-1]] * len(table))[: len(table)]
    sent = zip(policy.valves, rows.T, strict=True)
    return table.with_columns({f"{n} [{table.unit(n)}]": values for n, values in sent})


def player_of(file: str | Path, run: str | Path) -> Play:
    """How `repeat_run` executes a run with a policy file. Raises KembaError without a table."""
    table = read_controller(run)

    def play(model: Model, sample: Array, seed: list[int], noise: bool) -> Execution:
        scatter = VALVE_SCATTER if noise else 0.0
        return execute_policy(table, Policy(file), model, 0.0, None, sample, noise, scatter, seed)

    return play


def _knees(model: Model) -> dict[str, ca.Function]:
    """Piston extensions by knee angles, by piston column."""
    mechanism = model.mechanism
    angles = {c.name: mechanism.q[i] for i, c in enumerate(mechanism.coordinates)}
    pistons = {leg: mechanism.port(f"{leg}/piston/x").phi for leg in mechanism.legs}
    return {
        f"{leg}/piston/x": ca.Function("x", [angles[f"{leg}/knee/q"]], [x])
        for leg, x in pistons.items()
    }
