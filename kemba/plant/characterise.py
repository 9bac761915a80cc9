"""Air and friction of a cylinder from bench logs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from kemba.config import Document, dump_yaml, parse
from kemba.effects import Effect
from kemba.effects.pneumatics.chamber import Chamber, ModeDamping, at_supply
from kemba.effects.pneumatics.valve import Valve
from kemba.errors import KembaError
from kemba.mechanism import Cylinder, rig_mechanism
from kemba.model import Model, ModelSpec
from kemba.model.model import NOMINAL_SUPPLY
from kemba.plant.commands import Profile
from kemba.plant.kernel.machine import Array
from kemba.plant.rigs import drive, followed
from kemba.quantity import to_si
from kemba.trajectory import Trajectory

Key = TypeVar("Key")


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % interval; the interval is NaN where the data are too few."""

    value: float
    low: float = float("nan")
    high: float = float("nan")


def mean(values: Array) -> Estimate:
    """The mean of repeated values (n,)."""
    return linear(np.ones((len(values), 1)), np.asarray(values, dtype=float))[0][0]


def linear(X: Array, y: Array, read: Array | None = None) -> tuple[list[Estimate], float]:
    """Estimates of `read` @ coefficients (of the coefficients without it), and R2 of the fit.

    X (n, k), y (n,), read (m, k).
    """
    from scipy.stats import t

    beta, _, rank, _ = np.linalg.lstsq(X, y, rcond=None)
    rest, freedom = y - X @ beta, len(y) - int(rank)
    total = float(((y - y.mean()) ** 2).sum())
    r2 = 1.0 - float(rest @ rest) / total if total > 0.0 else float("nan")
    read = np.eye(X.shape[1]) if read is None else read
    values = read @ beta
    if freedom < 1:
        return [Estimate(float(value)) for value in values], r2
    covariance = np.linalg.pinv(X.T @ X) * float(rest @ rest) / freedom
    width = t.ppf(0.975, freedom) * np.sqrt(np.einsum("ij,jk,ik->i", read, covariance, read))
    bounds = zip(values, values - width, values + width, strict=True)
    return [Estimate(float(v), float(a), float(b)) for v, a, b in bounds], r2


STILL = 2e-4  # m; way below which the rod counts as locked
STEP = 20.0  # N; smallest step of the force that is read
LOW = 0.02  # lower share of the step for the line to its start
HIGH = 0.10  # upper share of the step for the line to its start
ROWS = 20  # rows that an answer needs


@dataclass(frozen=True)
class Rise:
    """One switching of one chamber of a locked rod.

    `u`: the valve's new value; `x` [m]: the chamber's own extension, of `stroke` [m] at most;
    `time` [s] from the command and `level` (n,) from 0 to 1 along the step; `dead` [s]; `plateau`
    [N] the steady force of the chamber when full.
    """

    u: float
    x: float
    stroke: float
    supply: float
    chamber: str
    time: Array
    level: Array
    dead: float
    plateau: float

    def fit(self, dead: float) -> tuple[float, Array]:
        """Time constant [s] of the first-order answer after `dead`, and the fitted levels."""
        from scipy.optimize import least_squares

        late = np.clip(self.time - dead, 0.0, None)
        begin = max(float(np.interp(1 - np.exp(-1), self.level, late)), 1e-4)
        found = least_squares(
            lambda p: p[1] * (1.0 - np.exp(-late / abs(p[0]))) - self.level, [begin, 1.0]
        )
        tau, full = abs(float(found.x[0])), float(found.x[1])
        return tau, full * (1.0 - np.exp(-late / tau))


@dataclass(frozen=True)
class RiseTable:
    """Table I: time constants [s] at both valve states and both ends, dead times [s]."""

    fill: tuple[Estimate, Estimate]
    vent: tuple[Estimate, Estimate]
    dead: dict[str, Estimate]
    r2: float
    r2_linear: float


def find_rises(log: Trajectory, stroke: float) -> Iterator[Rise]:
    """Every switching of a chamber in a bench log of a cylinder of `stroke` [m], while the rod is
    locked."""
    x = log["piston/x"]
    if np.ptp(x) > STILL:
        return
    valves = {name: log[f"valve/{name}"] > 0.5 for name in ("extend", "retract")}
    edges = {name: np.flatnonzero(np.diff(v.astype(int))) + 1 for name, v in valves.items()}
    every, supply = np.concatenate([*edges.values()]), log.meta.get("supply", NOMINAL_SUPPLY)
    for chamber, indices in edges.items():
        sign, own = (1.0, x) if chamber == "extend" else (-1.0, stroke - x)
        for edge in indices.tolist():
            stop = int(min(every[every > edge], default=len(log)))
            answer = _answer(log.time, sign * log["piston/F"], edge, stop)
            if answer is not None:
                u, place = float(valves[chamber][edge]), float(own.mean())
                yield Rise(u, place, stroke, supply, chamber, *answer)


def _answer(
    time: Array, force: Array, edge: int, stop: int
) -> tuple[Array, Array, float, float] | None:
    """Time, level, dead time and plateau, as of a `Rise`, of the switching at row `edge`, until row
    `stop`; None where it shows nothing."""
    time = time[edge - 1 : stop] - time[edge]
    before = float(force[max(edge - 20, 0) : edge].mean())
    after = float(force[stop - max((stop - edge) // 10, 3) : stop].mean())
    if abs(after - before) < STEP or stop - edge < ROWS:
        return None
    level = (force[edge - 1 : stop] - before) / (after - before)
    low, high = (_crossing(time, level, share) for share in (LOW, HIGH))
    dead = low - (high - low) * LOW / (HIGH - LOW)
    return time, level, dead, max(before, after)


def _crossing(time: Array, level: Array, share: float) -> float:
    """The first time [s] at which the level passes `share`, interpolated."""
    i = max(int(np.argmax(level > share)), 1)
    return float(np.interp(share, level[i - 1 : i + 1], time[i - 1 : i + 1]))


def dead_times(rises: Iterable[Rise]) -> dict[str, Estimate]:
    """Dead times [s] of switching `on` and `off`, as far as the tests have them."""
    return _means(("on" if rise.u else "off", rise.dead) for rise in rises)


def _means(values: Iterable[tuple[Key, float]]) -> dict[Key, Estimate]:
    """The mean of the values of each key."""
    groups: dict[Key, list[float]] = {}
    for key, value in values:
        groups.setdefault(key, []).append(value)
    return {key: mean(np.array(own)) for key, own in groups.items()}


def rise_table(rises: Iterable[Rise]) -> RiseTable:
    """Dead times and the bilinear time constants of eq. 5. Raises KembaError on too few tests."""
    rises = list(rises)
    if {r.u for r in rises} != {0.0, 1.0} or len({round(r.x, 4) for r in rises}) < 2:
        what = "the locked tests do not cover filling and venting at two positions"
        raise KembaError("characterise", what, "tests as in configs/rigs/locked.yaml were expected")
    dead = dead_times(rises)
    fits = [r.fit(dead["on" if r.u else "off"].value) for r in rises]
    taus = np.array([tau for tau, _ in fits])
    level = np.concatenate([r.level for r in rises])
    error = np.concatenate([fitted for _, fitted in fits]) - level
    r2 = 1.0 - float(error @ error) / float(((level - level.mean()) ** 2).sum())
    u, x = np.array([r.u for r in rises]), np.array([r.x / r.stroke for r in rises])
    corners = np.array([[1, a, b, a * b] for a in (1.0, 0.0) for b in (0.0, 1.0)])
    table, r2_linear = linear(np.column_stack([np.ones_like(u), u, x, u * x]), taus, corners)
    return RiseTable((table[0], table[1]), (table[2], table[3]), dead, r2, r2_linear)


VALVES = ("extend", "retract")
MODES = {(1, 0): "extend", (0, 1): "retract", (1, 1): "both", (0, 0): "none"}


TRAVEL = 0.01  # m; way below which the rod does not move
MOVING = 0.2  # share of the top speed from which the rod moves
BEGIN = 0.5  # share of the way after which chambers have settled
END = 0.85  # share of the way after which the end is near
STEADY = 0.03  # deviation from the median speed that counts
FEWEST = 3  # samples that a steady part needs


@dataclass(frozen=True)
class Stroke:
    """One steady stroke: valve mode, supply [Pa], speed [m/s] and force [N]."""

    mode: str
    supply: float
    speed: float
    force: float


@dataclass(frozen=True)
class StrokeLine:
    """One row of Table II: F = F_static - c_d v."""

    mode: str
    supply: float
    F_static: Estimate
    c_d: Estimate
    r2: float


def find_stroke(log: Trajectory) -> Stroke | None:
    """The steady part of a bench log in which the rod moves at one speed in one valve mode.

    None where there is no such part.
    """
    modes = {
        (int(a > 0.5), int(b > 0.5))
        for a, b in zip(log["valve/extend"], log["valve/retract"], strict=True)
    }
    x = log["piston/x"]
    if len(modes) > 1 or np.ptp(x) < TRAVEL:
        return None
    v = log["piston/v"] if "piston/v" in log else np.gradient(x, log.time)
    moving = np.abs(v) > MOVING * np.abs(v).max()
    usual = float(np.median(v[moving]))
    progress = np.abs(x - x[0]) / float(np.abs(x - x[0]).max())
    used = moving & (progress > BEGIN) & (progress < END)
    used &= np.abs(v - usual) < STEADY * abs(usual)
    if used.sum() < FEWEST:
        return None
    mode = MODES[modes.pop()]
    supply = 0.0 if mode == "none" else log.meta.get("supply", NOMINAL_SUPPLY)
    return Stroke(mode, supply, float(v[used].mean()), float(log["piston/F"][used].mean()))


def stroke_table(strokes: Iterable[Stroke]) -> list[StrokeLine]:
    """Table II: one line per mode and supply with at least two speeds."""
    groups: dict[tuple[str, float], list[Stroke]] = {}
    for stroke in strokes:
        groups.setdefault((stroke.mode, stroke.supply), []).append(stroke)
    order = list(MODES.values())
    lines = []
    for (mode, supply), group in sorted(
        groups.items(), key=lambda item: (order.index(item[0][0]), item[0][1])
    ):
        v = np.array([stroke.speed for stroke in group])
        if len(np.unique(np.round(v, 3))) < 2:
            continue
        force = np.array([stroke.force for stroke in group])
        (F_static, c_d), r2 = linear(np.column_stack([np.ones_like(v), -v]), force)
        lines.append(StrokeLine(mode, supply, F_static, c_d, r2))
    return lines


@dataclass(frozen=True)
class Characteristics:
    """What bench logs say about a `cylinder`; `check` holds R2 and RMS [N] of the fitted model's
    force by log, for logs in which the rod and the valves both move."""

    cylinder: Cylinder
    rises: RiseTable | None
    lines: list[StrokeLine]
    plateaus: dict[tuple[str, float], Estimate]
    check: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def effects(self) -> tuple[Chamber, ModeDamping, Valve]:
        """The fitted effects; where the logs give nothing the figures of the file are kept."""
        chamber = Chamber().of_cylinder(self.cylinder)
        damping, valve = ModeDamping().of_cylinder(self.cylinder), Valve()
        force = {key: abs(e.value) for key, e in self.plateaus.items()}
        force |= {(line.mode, line.supply): abs(line.F_static.value) for line in self.lines}
        drag = {(line.mode, line.supply): max(line.c_d.value, 0.0) for line in self.lines}
        supplies = sorted({p for mode, p in force if mode in VALVES and p > 0.0})
        if supplies:
            at = {f"F_{m}": _over(force, m, supplies, chamber, f"F_{m}") for m in VALVES}
            chamber = chamber.model_copy(update={"pressures": tuple(supplies), **at})
        if drag:
            known = sorted({p for _, p in drag if p > 0.0}) or list(damping.value("pressures"))
            at = {f"c_{m}": _over(drag, m, known, damping, f"c_{m}") for m in (*VALVES, "both")}
            rest = drag.get(("none", 0.0), damping.c_none)
            damping = damping.model_copy(update={"pressures": tuple(known), **at, "c_none": rest})
        if self.rises:
            ends = {"fill": self.rises.fill, "vent": self.rises.vent}
            times = {name: tuple(e.value for e in pair) for name, pair in ends.items()}
            chamber = chamber.model_copy(update=times)
            dead = float(np.mean([e.value for e in self.rises.dead.values()]))
            valve = valve.model_copy(update={"dead_time": dead})
        return chamber, damping, valve

    def write_model(self, path: str | Path, name: str = "characterised") -> None:
        """Write a model YAML: the planning model with the fitted chambers, damping and valves.

        Raises KembaError, and writes nothing, where a fitted value is none that a model can have.
        """
        effects = [effect.model_dump(exclude_none=True) for effect in self.effects()]
        notes = "chambers, damping and valves fitted by kemba-opt characterise"
        data = {"name": name, "base": "planning", "effects": effects, "notes": notes}
        parse(Document(data, f"the figures that these logs give {path}"), ModelSpec)
        dump_yaml(data, path)


def characterise(
    logs: dict[str, Trajectory], cylinder: Cylinder, supplies: Sequence[float] = ()
) -> Characteristics:
    """Fit eq. 4 to 7 to bench `logs` by name, of a `cylinder` of these dimensions; `supplies` [Pa]
    of logs that do not tell theirs. Raises KembaError when they hold nothing to fit."""
    for name, log in logs.items():
        for column in ("piston/x", "piston/F", "valve/extend", "valve/retract"):
            if column not in log:
                raise KembaError(name, f"has no column '{column}'", "a bench log was expected")
    remarks = tell_supplies(logs, supplies)
    rises = [rise for log in logs.values() for rise in find_rises(log, cylinder.stroke)]
    strokes = [s for s in map(find_stroke, logs.values()) if s is not None]
    if not rises and not strokes:
        what = "no log holds a locked rod with a switching valve, or a steady stroke"
        expected = "bench logs as kemba-opt simulate writes them for configs/rigs were expected"
        raise KembaError("characterise", what, expected)
    table = rise_table(rises) if rises else None
    plateaus = _means(((r.chamber, r.supply), r.plateau) for r in rises)
    found = Characteristics(cylinder, table, stroke_table(strokes), plateaus, remarks=remarks)
    effects, check = found.effects(), {}
    for name, log in logs.items():
        switches = any(np.ptp(log[f"valve/{chamber}"]) > 0.5 for chamber in VALVES)
        if np.ptp(log["piston/x"]) > 1e-3 and switches:
            check[name] = agreement(predict(cylinder, effects, log), log)
    return replace(found, check=check)


def _over(
    found: dict[tuple[str, float], float],
    mode: str,
    supplies: list[float],
    usual: Effect,
    table: str,
) -> tuple[float, ...]:
    """Values of a mode at the supplies, those of `table` of an effect where a test is missing."""
    return tuple(found.get((mode, p), float(at_supply(usual, table, p))) for p in supplies)


def agreement(predicted: Trajectory, log: Trajectory) -> tuple[float, float]:
    """R2 and RMS [N] of a predicted force on a log of the same times."""
    error = predicted["piston/F"] - log["piston/F"]
    spread = float(np.var(log["piston/F"]))
    return 1.0 - float(np.mean(error**2)) / spread, float(np.sqrt(np.mean(error**2)))


def predict(cylinder: Cylinder, effects: tuple[Any, ...], log: Trajectory) -> Trajectory:
    """What a `cylinder` with `effects` answers to the motion and the valves of a bench log."""
    supply = log.meta.get("supply", NOMINAL_SUPPLY)
    model = Model(rig_mechanism(cylinder), effects, supply, "bench")
    valves = {name: Profile.of(log.time, log[name]) for name in ("valve/extend", "valve/retract")}
    return drive(model, followed(log), valves, log.time)


APART = 0.02  # share by which the pressures of two supplies differ at least
SETTLED = 0.9  # quantile of an open chamber's pressure: it fills, and falls while the rod is fast


def tell_supplies(logs: Mapping[str, Trajectory], supplies: Sequence[float]) -> tuple[str, ...]:
    """Note in each log its supply [Pa]: what its sidecar says, else one of `supplies`, which go in
    ascending order with the levels at which chambers settle, else the nominal one. Returns what is
    to be said about it. Raises KembaError where levels and supplies differ in number."""
    untold = []
    for name, log in logs.items():
        if "supply" not in log.meta and any(np.any(log[f"valve/{v}"] > 0.5) for v in VALVES):
            untold.append((_level(log), name))
        try:
            log.meta["supply"] = to_si(log.meta.get("supply", NOMINAL_SUPPLY), "Pa")
        except ValueError as error:
            raise KembaError(f"{name}: supply", str(error)) from None
    untold.sort()
    groups: list[list[tuple[float, str]]] = []
    for level, name in untold:
        if not groups or level > (1.0 + APART) * groups[-1][-1][0]:
            groups.append([])
        groups[-1].append((level, name))
    at = ", ".join(f"{np.median([level for level, _ in g]) / 1e6:.3g}" for g in groups)
    seen = f"their chambers settle at {at} MPa (absolute)" if any(lv for lv, _ in untold) else ""
    if len(supplies or groups[:1]) != len(groups):
        what = f"{len(untold)} logs do not tell their supply" + (f"; {seen}" if seen else "")
        hint = f"--supply for each of {len(groups)}, or `supply: 0.6 MPa` in NAME.meta.yaml"
        raise KembaError(groups[0][0][1] if groups else "supply", what, hint=hint)
    for supply, group in zip(sorted(supplies) or [NOMINAL_SUPPLY], groups, strict=False):
        for _, name in group:
            logs[name].meta["supply"] = supply
    if supplies or not groups:
        return ()
    taken = f"{NOMINAL_SUPPLY / 1e6:g} MPa"
    said = f"no sidecar tells the supply of {len(untold)} logs: taken as {taken}"
    return (f"{said}, {seen or 'no pressure is logged'}; --supply tells it",)


def _level(log: Trajectory) -> float:
    """The pressure [Pa] of the supply if it is logged, else that at which open chambers settle, the
    lower one of two, since a rod that moves presses on the other; 0 where none is logged."""
    if "supply/P" in log:
        return float(np.nanmedian(log["supply/P"]))
    found = []
    for valve in VALVES:
        name, on = f"chamber/{valve}/P", log[f"valve/{valve}"] > 0.5
        if name in log and np.isfinite(log[name][on]).any():
            found.append(float(np.nanquantile(log[name][on], SETTLED)))
    return min(found, default=0.0)
