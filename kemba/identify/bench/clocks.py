"""Clocks of a bench log: commands, position and force may be written by clocks that drift apart.

Of two recorders that begin together one may gain on the other. A rate of 0.001 is 1 ms a second:
the chambers then seem to fill later and later, as with a hose that grows. Such rates are looked for
before any fit, and the logs are put on one clock; what is left of the rate is a nuisance parameter.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from kemba.identify.bench.bench_log import BenchLog, SmoothedMotion
from kemba.identify.infer.linear import linearise, moved, priors
from kemba.identify.logs.reading import GateSettings
from kemba.identify.problem.problem import Problem, Theta
from kemba.trajectory import Trajectory

COMMANDS, POSITION = "clock:valve", "clock:piston/x"  # names in theta
Drift = tuple[str, float]  # whose clock gains on the others, and its rate
# whose clock gains on the others: in theta, its sign there
OWNERS: Mapping[str, Mapping[str, float]] = {
    "the valve commands": {COMMANDS: 1.0},
    "piston/x": {POSITION: 1.0},
    "piston/F": {COMMANDS: -1.0, POSITION: -1.0},
}


# Clocks that run at different rates.
# prior sigma of what is left of a rate after logs were put on one clock: the search for it was
# off by 0.1e-3 to 0.3e-3 on logs of the twin
RATE = 3e-4
FARTHEST = 0.16  # largest drift over a log that is looked for before any fit [s]
STRIDE = 8e-3  # step of that search [s]: the fastest rise time of Table I
# rows of the logs in which a drift is looked for: the search takes about 6 s of CPU time for so
# many; `check` has to end in 10 s
ROWS = 6000
# mean square, in noise units, that a fit with all effects may leave of logs in which no drift
# is looked for: 0.8 to 1.1 on clean logs of the twin of tests/twin, where one effect is missing
# 0.9 to 19
FITS = 1.0
# share of its cost that such a fit may keep with a drift that is believed: on the twin, 0.99 or
# more on 22 logs without drift, 0.02 to 0.6 with 10 ms or more of the commands
BETTER = 0.9
AGAIN = 3.0  # factor of the least cost within which a trial is linearised again


def nuisance(drift: Drift | None) -> dict[str, tuple[float, float]]:
    """Nominal value and prior sigma of the rates that are not exactly known after a drift."""
    moved = OWNERS[drift[0]] if drift else ()
    return dict.fromkeys(moved, (0.0, RATE))


def commands_by_one_clock(run: BenchLog, theta: Theta) -> BenchLog:
    """A run with its commands when they were sent by the clock of the force, at theta."""
    rate, begin = theta.get(COMMANDS, 0.0), run.motion.time[0]
    if not rate:
        return run

    def true(instant: float) -> float:
        return float(begin + (instant - begin) / (1.0 + rate))

    extend, retract = ([(true(a), true(b)) for a, b in sent] for sent in run.commands)
    return replace(run, commands=(extend, retract))


def motion_by_one_clock(motion: SmoothedMotion, theta: Theta) -> SmoothedMotion:
    """The motion by the clock of the force, at theta; it rests after its end."""
    rate, time = theta.get(POSITION, 0.0), motion.time
    if not rate:
        return motion
    written = time[0] + (time - time[0]) * (1.0 + rate)
    x, v, a = (np.interp(written, time, y) for y in (motion.x, motion.v, motion.a))
    return replace(motion, x=x, v=v * (1.0 + rate), a=a * (1.0 + rate) ** 2)


def looked_at(logs: Sequence[Trajectory]) -> list[Trajectory]:
    """The first logs, as many as are searched for a drift; the last of them is cut."""
    found, left = [], ROWS
    for log in logs:
        found.append(log.rows(slice(0, left)))
        left -= len(log)
        if left < GateSettings.fewest:
            break
    return found


def drift_between(problem: Problem, logs: Sequence[BenchLog]) -> Drift | None:
    """Whose clock gains on the others and by which rate, where that explains what nothing in the
    catalogue does; None where no drift shows.

    The model with all effects free is linearised and fitted at every trial of a rate; where a rate
    does well it is linearised again, since slopes along a wrong motion may praise a wrong rate.
    """
    cost = _cost_about(problem, {})
    usual = cost({})
    if 2.0 * usual < FITS * len(problem.rows()):
        return None
    step = STRIDE / max(float(np.ptp(log.motion.time)) for log in logs)
    half = step * np.arange(1.0, FARTHEST / STRIDE + 0.5)
    costs = {
        (owner, sign * rate): cost(_theta(owner, sign * rate))
        for owner in OWNERS
        for sign in (1.0, -1.0)
        for rate in (0.5 * step, *half.tolist())
    }
    if min(costs.values()) > BETTER * usual:
        return None
    leaders: dict[tuple[str, bool], Drift] = {}
    for owner, rate in sorted(costs, key=costs.__getitem__):
        if costs[owner, rate] < AGAIN * min(costs.values()):
            leaders.setdefault((owner, rate > 0), (owner, rate))
    found = [_refined(problem, owner, rate, step) for owner, rate in leaders.values()]
    alike = min(found)[0] / BETTER  # where the piston hardly moves, its clock is no matter
    order = list(OWNERS)
    within = [(cost, drift) for cost, drift in found if cost <= alike]
    least, (owner, rate) = min(within, key=lambda item: (order.index(item[1][0]), item[0]))
    inside = abs(rate) < half[-1] - 0.5 * step
    return (owner, rate) if inside and least < BETTER * usual else None


def _cost_about(problem: Problem, theta: Theta) -> Callable[[Theta], float]:
    """What the best fit leaves at any theta, every effect free, with the slopes at this one."""
    blocks = np.zeros(len(problem.rows()), dtype=int)
    linear, slopes, _ = linearise(problem, theta, blocks)

    def cost(at: Theta) -> float:
        z, *_ = priors(problem, at, linear.names)
        there = moved(linear, z, slopes, problem.residual(at), blocks)
        return there.cost(there.best())

    return cost


def _refined(problem: Problem, owner: str, rate: float, step: float) -> tuple[float, Drift]:
    """Cost and drift of the best rate near a good one, with the slopes there."""
    near = _cost_about(problem, _theta(owner, rate))
    found = minimize_scalar(
        lambda trial: near(_theta(owner, trial)),
        bounds=(rate - 0.5 * step, rate + 0.5 * step),
        method="bounded",
        options={"xatol": 0.01 * step},
    )
    return float(found.fun), (owner, float(found.x))


def without_drift(log: BenchLog, owner: str, rate: float) -> BenchLog:
    """A log with all channels by the clock of the force.

    Where the commands alone have another clock, a row shows what was sent since the row before: in
    the mean half a row earlier, as in a slow log.
    """
    if OWNERS[owner].keys() == {COMMANDS} and not log.seen_within:
        row = float(np.median(np.diff(log.motion.time)))
        log = replace(log.sent(-0.5 * row), seen_within=row)
    theta, time = _theta(owner, rate), log.motion.time
    known = time <= time[0] + (time[-1] - time[0]) / (1.0 + max(0.0, *theta.values()))
    keep = {channel: k & known for channel, k in log.keep.items()}
    moved, motion = commands_by_one_clock(log, theta), motion_by_one_clock(log.motion, theta)
    return replace(moved, motion=motion, keep=keep)


def said(owner: str, rate: float, span: float) -> str:
    """A remark on a drift; `span` [s] of the log."""
    word = "fast" if rate > 0 else "slow"
    return (
        f"the clock of {owner} runs {100 * abs(rate):.2g} % {word} against the others, "
        f"{1e3 * abs(rate) * span:.2g} ms in {span:.2g} s: its column was put on their clock. "
        "Record all columns with one clock, or let one trigger start both and check their rates"
    )


def _theta(owner: str, rate: float) -> dict[str, float]:
    return {name: sign * rate for name, sign in OWNERS[owner].items()}
