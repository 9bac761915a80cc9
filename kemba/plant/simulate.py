"""Fine simulation of a model from a start, under commands."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib import import_module
from threading import Thread
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from kemba.errors import KembaError, suggest
from kemba.mechanism.knee import flexion
from kemba.model import Model, load_model
from kemba.plant.commands import Commands, delayed
from kemba.plant.equations import equations_of, share_equations
from kemba.plant.kernel.machine import LONGEST_STEP, Array
from kemba.plant.record import Impact, trajectory
from kemba.stopwatch import Tell
from kemba.trajectory import SAME_TIME, Trajectory

if TYPE_CHECKING:
    from kemba.plant.player import Player


def initial_values(model: Model, values: Mapping[str, float]) -> tuple[Array, Array, Array]:
    """Coordinates (n,), velocities (n,) and effect states (ns,) with the `values` by column name.

    What is missing stands as in the standing pose, at rest, effect states at their nominal value;
    without `body/z` the lower foot is put on the ground. `LEG/piston/x` may stand for
    `LEG/knee/q`. Raises KembaError on unknown names.
    """
    mechanism = model.mechanism
    coordinates = [c.name for c in mechanism.coordinates]
    velocities = [c.name for c in mechanism.velocities]
    states = [quantity.name for quantity in model.states.values()]
    pistons = {f"{leg}/piston/x": f"{leg}/knee/q" for leg in mechanism.legs}
    known = {*coordinates, *velocities, *states, *pistons}
    for name in values:
        if name not in known:
            raise KembaError("initial", f"no state '{name}'", hint=suggest(name, known))
    start = dict(mechanism.standing)
    for piston, knee in pistons.items():
        if piston in values and knee not in values:
            leg, robot = piston.split("/")[0], mechanism.need_robot()
            try:
                bend = flexion(robot.leg, values[piston])
            except ValueError:
                what = f"{piston} = {values[piston]:g} m cannot be reached"
                raise KembaError("initial", what) from None
            start[knee] = robot.legs[leg].fold * bend
    start.update(values)
    q = np.array([start.get(name, 0.0) for name in coordinates])
    if "body/z" in coordinates and "body/z" not in values:
        q[coordinates.index("body/z")] -= _lowest_foot(model, q)
    v = np.array([values.get(name, 0.0) for name in velocities])
    s = np.array([values.get(x.name, x.value) for x in model.states.values()], dtype=float)
    return q, v, s


def lowest_foot(model: Model, values: Mapping[str, float]) -> float:
    """Height [m] of the lowest foot above its ground in the pose of `initial_values`. Raises
    KembaError likewise."""
    return _lowest_foot(model, initial_values(model, values)[0])


def _lowest_foot(model: Model, q: Array) -> float:
    """Height [m] of the lowest foot above its ground at coordinates q (nq,)."""
    mechanism = model.mechanism
    ground, port = mechanism.scene.ground, mechanism.port
    places = [[port(f"{leg}/foot/{axis}").phi for axis in "xz"] for leg in mechanism.legs]
    feet = [z - ground.height(x) for x, z in places]
    height = ca.Function("feet", [mechanism.q], [ca.mmin(ca.vertcat(*feet))])
    return float(height(q))


@dataclass(frozen=True)
class Simulated:
    """A simulated motion, and the impacts on the way."""

    trajectory: Trajectory
    impacts: tuple[Impact, ...]


@dataclass(frozen=True)
class Condition:
    """A simulation of `model` for `duration` [s].

    `initial`: coordinates, velocities and effect states by column name; the standing pose at rest
    stands for what is missing. Steps are as long as the motion allows; `step` [s] makes them equal
    and no longer than that. Valve switchings, controller ticks and impacts end steps exactly.
    `sample` [s], or the times themselves (m,). `dead_time`: valves act later than sent, by the
    model's own timing; their columns show them as sent. Values at a sample hold just after it.
    `begin` [s]: when it begins by the clock of the motion; all times here count from there.
    """

    model: Model
    initial: Mapping[str, float] | None = None
    commands: Commands | None = None
    duration: float = 1.0
    step: float | None = None
    sample: float | Array = 1e-3
    dead_time: bool = True
    begin: float = 0.0


def simulate(model: Model, *arguments: Any, **named: Any) -> Trajectory:
    """The motion with every output, state, input and force; arguments are those of `Condition`.
    Raises KembaError on unknown names and on models without free motion."""
    return run(model, *arguments, **named).trajectory


def run(model: Model, *arguments: Any, **named: Any) -> Simulated:
    """As `simulate`, with the impacts that happened."""
    return simulate_one(Condition(model, *arguments, **named))


def simulate_one(condition: Condition) -> Simulated:
    """The simulation that a condition describes. Raises KembaError as `simulate` does."""
    return _played(_player(condition), condition)


def run_many(
    conditions: Iterable[Condition], jobs: int | None = None
) -> list[Simulated | KembaError]:
    """Many simulations side by side on `jobs` cores (all of them), in the order given.

    Models that differ in numbers only, as `Model.with_effects` makes them, share their machine
    code. A simulation that fails gives its error; the others go on. Raises KembaError as
    `simulate` does where a condition makes no sense.
    """
    conditions = list(conditions)
    share_equations(condition.model for condition in conditions)
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        waiting = [pool.submit(_tried, _player(c), c) for c in conditions]
        return [future.result() for future in waiting]


def _tried(player: Player, condition: Condition) -> Simulated | KembaError:
    try:
        return _played(player, condition)
    except KembaError as error:
        return error


SHORT = 1e-4  # s; as long as the shortest steps that plants are tested with


def _player(condition: Condition) -> Player:
    from kemba.plant.player import Player  # numba takes half a second to import

    model, step = condition.model, condition.step
    if model.mechanism.imposed:
        raise KembaError(model.name, "its motion is imposed", hint="use kemba.plant.rigs")
    longest = LONGEST_STEP  # longer ones of equal length would miss events, too
    if step is not None and not 0.0 < step <= longest:
        expected = f"up to {longest:g} s was expected"
        raise KembaError("step", f"{step:g} s is out of range", expected)
    commands = condition.commands or Commands()
    profiles = dict(commands.profiles)
    acting = delayed(model, profiles) if condition.dead_time else profiles
    start = initial_values(model, condition.initial or {})
    samples = _samples(condition.duration, condition.sample)
    equations = equations_of(model)
    return Player(model, equations, start, commands, acting, samples, condition.duration)


def _played(player: Player, condition: Condition) -> Simulated:
    try:
        player.play(condition.step)
    except KembaError:
        # a long step may land where no contact forces fit; short ones of equal length tell
        if condition.step is not None:
            raise
        player = _player(condition)
        player.play(SHORT)
    begin = condition.begin
    motion = trajectory(player.model, player.equations, player.times + begin, player.table)
    impacts = (replace(impact, time=impact.time + begin) for impact in player.impacts)
    return Simulated(motion, tuple(impacts))


def _samples(duration: float, sample: float | Array) -> Array:
    if np.ndim(sample):
        return np.asarray(sample, dtype=float)
    times = np.arange(int(duration / float(sample) + 1e-6) + 1) * float(sample)
    return np.append(times[times < duration - SAME_TIME], duration)


_STARTED: list[subprocess.Popen[bytes]] = []  # nobody waits for it: the kernel's lock does


def load_meanwhile(*modules: str) -> None:
    """Begin to import the simulator, then these `modules`, in a second thread, where there is a
    core for it; the first time on a machine, also to compile it in a second process.

    CasADi's solvers leave Python to other threads while they work; this one does not touch CasADi.
    """
    if (os.cpu_count() or 1) > 1 and "numba" not in sys.modules:
        Thread(target=_load, args=modules, name="loading").start()


def _load(*modules: str) -> None:
    import kemba.plant.player  # noqa: F401
    from kemba.plant.kernel.jit import FOLDER, is_kept, load
    from kemba.plant.kernel.play import play

    if FOLDER is not None and not is_kept(play):
        _STARTED.append(_compiler())
    load()
    for module in modules:
        import_module(module)


def _compiler() -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", f"from {__name__} import compile_kernel; compile_kernel()"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def wait_for_compiler(tell: Tell) -> None:
    """Say so and wait where the simulator is compiled for the first time on this machine."""
    from kemba.plant.kernel.jit import is_kept
    from kemba.plant.kernel.play import play

    if not is_kept(play):
        tell("compiling the simulator, once on this machine")
        compile_kernel()


def compile_kernel() -> None:
    """Have the kernel compiled and kept, by a simulation that is as short as any."""
    run(load_model("plant"), duration=2e-3)
