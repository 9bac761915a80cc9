"""Repeated executions as on hardware: another plant, scatter, noise of sensors."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import load_yaml
from kemba.effects import Effect
from kemba.effects.catalogue import CHAMBERS
from kemba.effects.mechanics.load import Payload
from kemba.effects.sensors import CHANNELS, as_measured
from kemba.effects.series import Series
from kemba.errors import KembaError
from kemba.mechanism import load_robot
from kemba.model import Model, build_model, load_model, load_spec
from kemba.model.spec import ModelSpec, changed_effects, own_robot
from kemba.ocp.certificate.status import moved
from kemba.plant.certificate import PLANT
from kemba.plant.commands import scattered
from kemba.plant.controller import Execution, execute, read_controller
from kemba.plant.kernel.machine import Array
from kemba.plant.replay import Replay
from kemba.quantity import to_si
from kemba.scene import FLAT, Scene, scene_in
from kemba.stopwatch import Stage, Tell, silent
from kemba.trajectory import Trajectory

PLAIN = "planning"


def counterpart(
    model: str,
    payload: float = 0.0,
    supply: float | None = None,
    plant: str = "plant",
    own_effects: bool = True,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    scene: Scene = FLAT,
) -> Model:
    """The model YAML `plant` on the robot of the planning model `model`, with its own effects.

    The plant gives the air and what its file describes beyond the shipped planning model; all else
    is the model's, so that one without a boom has a plant without one. An effect that was learnt
    from logs replaces the plant's own. A plant whose file names a robot keeps that one.
    `own_effects` False: the plant as its file has it. `payload` [kg], `supply` [Pa] and `changes`
    of effects and `scene` are the task's. Raises KembaError as `load_model` does.
    """
    spec, own = load_spec(plant), load_spec(model)
    extra: list[Effect] = [Payload(m=payload)] if payload else []
    if own_effects:
        theirs = _described(spec)
        mine = _carried(own, [*own.effects, *changed_effects(model, changes or {})], theirs)
        kept = {e.name: e for e in (*theirs, *mine)}
        spec = spec.model_copy(update={"effects": tuple(kept.values())})
    spec = spec.model_copy(update={"robot": own_robot(plant) or own.robot})
    return build_model(spec, extra, supply or own.supply, scene=scene)


def lacking(model: str, plant: str) -> list[str]:
    """The effects of the plant's file that its counterpart for a model leaves out, because the
    model does not have them either."""
    known = {e.name for e in (*load_spec(model).effects, *_described(load_spec(plant)))}
    return [e.name for e in load_spec(plant).effects if e.name not in known]


def _carried(own: ModelSpec, effects: Iterable[Effect], theirs: Sequence[Effect]) -> list[Effect]:
    """Those of the `effects` of a planning model that its plant has too: none of the air, and none
    that the plant has by itself unless it was learnt."""
    air = {e.name for make in CHAMBERS.values() for e in make()}
    learnt = {e.name for e in own.effects if e.support is not None}
    fixed = {e.name for e in theirs if e.name not in learnt} | air
    last = {e.name: e for e in effects}
    return [e for e in last.values() if e.moves and e.name not in fixed]


def carried_over(model: str, plant: str = "plant", payload: float = 0.0) -> list[str]:
    """What the plant has because the planning model has it, beyond the shipped one: effects that
    were learnt or added, found lengths, and the task's `payload` [kg]."""
    plain, own = {e.name for e in load_spec(PLAIN).effects}, load_spec(model)
    carried = _carried(own, own.effects, _described(load_spec(plant)))
    added = [e.name for e in carried if e.name not in plain]
    return [*added, *([f"payload {payload:g} kg"] if payload else [])]


def another_robot(model: str, plant: str) -> str | None:
    """The name of the robot that the file of `plant` names, where it is not that of `model`."""
    named = own_robot(plant)
    return load_robot(named).name if named and named != load_spec(model).robot else None


def _described(plant: ModelSpec) -> list[Effect]:
    """What a plant has beyond the shipped planning model."""
    plain: list[Effect] = [*load_spec(PLAIN).effects]
    return [e for e in plant.effects if e not in plain]


COMMANDS = re.compile(r".*(hip/tau|valve/(extend|retract))")
CHANNEL = re.compile(
    r"body/(x|z|pitch|vx|vz|ax|az)|.*hip/q|.*hip/tau|(.*/)?piston/(x|v|F)"
    r"|(.*/)?valve/(extend|retract)|(.*/)?chamber/(extend|retract)/P|supply/P|.*foot/F[xz]"
)
ENCODERS = {"pitch": 2e-4, "q": 2 * np.pi / 2**14}  # rad; smallest step


@dataclass(frozen=True)
class Sensors:
    """How a log is taken: `rate` [Hz], `jitter` by which samples come late [s, 1 sigma], noise
    [1 sigma] and smallest step by channel ending, in the channel's SI unit."""

    rate: float = 1000.0
    jitter: float = 0.0
    noise: dict[str, float] = field(default_factory=dict)
    steps: dict[str, float] = field(default_factory=dict)

    @classmethod
    def usual(cls) -> Sensors:
        """The usual noise of every channel (the boom's 0.3 mm is the paper's, II-B)."""
        return cls(jitter=2e-5, noise={k: sigma for k, (_, sigma) in CHANNELS.items()},
                   steps=ENCODERS)  # fmt: skip

    def times(self, duration: float, rng: np.random.Generator) -> Array:
        """Sample times (m,) [s] from 0 to `duration`, strictly increasing. No sample is early: a
        row is written after the commands of its tick were sent, and contains them."""
        period = 1.0 / self.rate
        times = np.arange(int(duration * self.rate + 1e-9) + 1) * period
        shift = np.clip(np.abs(rng.normal(0.0, self.jitter, len(times))), 0.0, 0.4 * period)
        shift[[0, -1]] = 0.0
        return times + shift if self.jitter else times


def take_log(
    truth: Trajectory, sensors: Sensors, rng: np.random.Generator, effects: Iterable[Effect] = ()
) -> Trajectory:
    """The log of a simulated motion: its measured channels with the sensor faults among `effects`,
    then noise, then quantisation. Commands are logged as they are."""
    effects = list(effects)
    columns, sigmas = {}, {}
    for name, header in zip(truth.names, truth.headers, strict=True):
        if not CHANNEL.fullmatch(name):
            continue
        values = _averaged(truth, name)
        if not COMMANDS.fullmatch(name):
            values = as_measured(effects, name, Series(truth.time, values)).value
            ending = name.split("/")[-1]
            sigma, step = sensors.noise.get(ending, 0.0), sensors.steps.get(ending, 0.0)
            values = values + rng.normal(0.0, sigma, len(values)) if sigma else values
            values = np.round(values / step) * step if step else values
            if sigma:
                sigmas[header] = float(np.hypot(sigma, step / np.sqrt(12.0)))
        columns[header] = values
    meta = {"kind": "robot" if "body/z" in truth else "bench"}
    return Trajectory(truth.time, columns, {**meta, "noise": sigmas} if sigmas else meta)


def _averaged(truth: Trajectory, name: str) -> Array:
    """A channel; an accelerometer averages over its sample, so impacts stay finite in it."""
    if name not in ("body/ax", "body/az") or len(truth) < 2:
        return truth[name]
    speed = truth[name.replace("/a", "/v")]
    mean: Array = np.diff(speed, prepend=np.nan) / np.diff(truth.time, prepend=np.nan)
    mean[0] = mean[1]
    return mean


Play = Callable[[Model, Array, list[int], bool], Execution]
VALVE_SCATTER = 1e-4  # s, 1 sigma of every switching on hardware; Fig. 3 shows less than 1 ms


@dataclass(frozen=True)
class Repeat:
    """One execution: the log that was written, and how it compares with the plan (None without
    a plan)."""

    path: Path
    execution: Execution
    replay: Replay | None

    @property
    def summary(self) -> dict[str, Any]:
        """The figures of `kemba-opt simulate --json` for this log."""
        motion = self.execution.trajectory
        facts = {"log": str(self.path), "apex_m": float(motion["body/z"].max())}
        return facts | (self.replay.summary() if self.replay else {})


def outcome(repeats: Sequence[Repeat], plant: str) -> str:
    """What executions on `plant` reached, how far they were off their plan, and how many of them
    keep its end, in words."""
    facts = dict.fromkeys(", ".join(moved(repeat.execution.trajectory)) for repeat in repeats)
    text = f"reached {'; '.join(facts)} on {plant}"
    found = [repeat.replay for repeat in repeats if repeat.replay]
    if not found:
        return text
    worst = 1e3 * max(abs(one.apex_error_m) for one in found)
    ends = [abs(one.end.velocity_m_s) for one in found if one.end]
    last = f" at the apex and {max(ends):.2f} m/s at the end" if ends else ""
    does = "stayed upright" if ends else "landed"
    keep = f"{sum(one.landed for one in found)} of {len(repeats)} {does}"
    return f"{text}, off the plan by at most {worst:.0f} mm{last}; {keep}"


def repeat_run(
    run: str | Path,
    model: Model,
    out: str | Path,
    count: int = 1,
    noise: bool = False,
    seed: int = 0,
    play: Play | None = None,
    tell: Tell = silent,
) -> list[Repeat]:
    """Execute the controller of a run `count` times on `model` and write `log-1.csv`, ... to `out`.

    With `noise`, sensors are noisy and the valves scatter; the same `seed` gives the same logs.
    `play` executes the table in another way than eq. 10 alone; it gets the model, the times of the
    samples and the numbers that seed it, and whether there is noise. `tell` gets the name of
    each execution. Raises KembaError when `run` has no controller table.
    """
    folder = Path(run)
    controller = folder / "controller.csv" if folder.is_dir() else folder
    if not controller.is_file():
        what = "has no controller.csv" if folder.exists() else "no such run folder or table"
        raise KembaError(str(run), what, hint="make one with: kemba-opt solve jump.yaml")
    table = read_controller(controller)
    plan_file = controller.parent / "trajectory.csv"
    plan = Trajectory.read(plan_file) if plan_file.is_file() else None
    repeats = []
    for number in range(1, count + 1):
        tell(Stage("executing", number, count))
        rng = np.random.default_rng([seed, number])
        sensors = Sensors.usual() if noise else Sensors()
        valves = scattered(model, table, VALVE_SCATTER, rng) if noise else None
        begin = float(table.time[0])
        sample = begin + sensors.times(float(table.time[-1]) - begin, rng)
        if play is None:
            done = execute(table, model, valves=valves, sample=sample)
        else:
            done = play(model, sample, [seed, number, 1], noise)
        log = _as_sent(take_log(done.trajectory, sensors, rng, model.effects), done.table)
        log.meta |= model.mechanism.scene.dump()
        log.meta |= {"run": number, "repeat_of": controller.parent.name, "plant": model.name}
        path = Path(out) / f"log-{number}.csv"
        log.write(path)
        repeats.append(Repeat(path, done, done.against(model, plan) if plan else None))
    return repeats


def _as_sent(log: Trajectory, table: Trajectory) -> Trajectory:
    """The log with valve commands as sent: a log cannot show how late each valve acts."""
    valves = [name for name in log.names if "/valve/" in name and name in table]
    return log.with_columns({f"{n} [{log.unit(n)}]": table.held(n, log.time) for n in valves})


def plant_of(run: str | Path, name: str | None = None) -> Model:
    """The plant of the task that a run was made for: its robot, supply, payload, own effects.

    Another plant `name` is used unchanged, but on the task's robot, unless its own file names
    one, and with the task's supply and payload.
    """
    file = (Path(run) if Path(run).is_dir() else Path(run).parent) / "task.yaml"
    task = load_yaml(file).data if file.is_file() else None
    if not task:
        return load_model(name or PLANT)
    payload, supply = to_si(task.get("payload") or 0.0, "kg"), task.get("supply")
    own = str(task.get("plant", PLANT))
    return counterpart(
        str(task.get("model", PLAIN)),
        payload,
        None if supply is None else to_si(supply, "Pa"),
        name or own,
        own_effects=name in (None, own),
        changes=task.get("effects"),
        scene=scene_in(task, str(file)),
    )
