"""Mistakes in the columns of a rig's log, tried as whole hypotheses before anything is fitted."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from scipy.optimize import minimize_scalar, nnls

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.errors import KembaError
from kemba.identify.bench.validate import END, REVERSED, SMALL, Texts, simplest
from kemba.identify.problem.problem import Array
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.model.model import Model

Gap = Callable[[RigLog], Array]  # the force of the model less that of the log, along a log
LEAST = 0.15  # zero [rad] from which it is a mistake, and no fault of a sensor
ZEROS = np.linspace(-np.pi, np.pi, 25)  # those that are tried first [rad]
# factor from which a gain is another unit, and no other inertia: the closest usual units, feet and
# metres, have 3.28
UNIT = 3.0
TIME = "the time"
SIZES = np.linspace(-9.0, 9.0, 33)  # logarithms of those that are tried first


def contradictions(log: RigLog, model: Model, sigma: Array, gap: Gap) -> list[KembaError]:
    """What must be wrong with a log's columns, if anything; `sigma` (k,) of the gap."""
    answer = ANSWER[model.mechanism.rig]
    side, still = 1.0 if model.mechanism.bore else -1.0, model.mechanism.sign_speed

    def size(trial: RigLog) -> float:
        force = trial.channels.others[answer][trial.channels.rows]
        return float(np.linalg.norm(force / sigma))

    def left(trial: RigLog) -> float:
        """Share of the force left by any friction and damping, and a drive's zero."""
        known = [side * np.tanh(trial.speed / still), side * trial.speed]
        if not model.mechanism.bore:
            known += [np.ones(len(sigma)), -np.ones(len(sigma))]
        columns = np.stack(known, axis=1) / sigma[:, None]
        return float(nnls(columns, gap(trial) / sigma)[1]) / size(trial)

    small = SMALL * np.sqrt(len(sigma)) / size(log)
    if left(log) < small:
        return []
    trials = {texts: left(trial) for texts, trial in mix_ups(log, model, left)}
    said = "; or ".join(map(" and ".join, simplest(trials, small)))
    what = "the force answers the motion so much better then"
    hint = "correct it in a column map (--map), or the rig's figures in the model"
    return [KembaError(log.name, said, what, hint)] if said else []


def mix_ups(
    log: RigLog, model: Model, left: Callable[[RigLog], float]
) -> Iterator[tuple[Texts, RigLog]]:
    """What may be wrong with a log, and the log with that put right; `left` of one."""
    rig, bore, logged = model.mechanism.rig, model.mechanism.bore, model.mechanism.logged
    place, answer = PLACE[rig], ANSWER[rig]
    end = END if bore else f"{place} has the reversed sign"
    other = REVERSED if bore else f"{answer} has the reversed sign"
    pressures = list(_pressures({n: log.channels.others[n] for n in logged if n.endswith("/P")}))
    for sign, turned, (said, read) in product((1.0, -1.0), (1.0, -1.0), pressures):
        texts = (end,) * (sign < 0.0) + (other,) * (turned < 0.0) + said
        others = {**log.channels.others, answer: turned * log.channels.others[answer], **read}
        trial = _moved(log, sign, bore.stroke if bore and sign < 0.0 else 0.0, others)
        yield texts, trial
        if logged[place] == "rad":  # where it hangs straight down
            zero = _best(ZEROS, partial(_moved, trial, 1.0, others=others), left)
            moved = f"{place} counts from another zero (`offset: {np.degrees(zero):+.1f} deg`)"
            if abs(zero) > LEAST:
                yield (*texts, moved), _moved(trial, 1.0, zero, others)
        if not bore and turned > 0.0:
            yield (*texts, f"{place} and {answer} are swapped"), _exchanged(trial, answer)
        for name in () if said else (answer,) if bore else (place, answer, TIME):
            size = _best(SIZES, partial(_scaled, trial, name), left)
            times = np.exp(abs(size))
            if times > UNIT:
                about = f"{name} is about {float(f'{times:.2g}'):g} times"
                wrong = f"{about} too {'small' if size > 0.0 else 'large'} (its unit is wrong)"
                yield (*texts, wrong), _scaled(trial, name, size)


def _pressures(read: dict[str, Array]) -> Iterator[tuple[Texts, dict[str, Array]]]:
    """What may be wrong with pressures, and these without that."""
    swapped = dict(zip(read, reversed(read.values()), strict=True))
    swaps = {(): read, (" and ".join(read) + " are swapped",) * (len(read) > 1): swapped}
    groups = {tuple(read), *((name,) for name in read)} - {()}
    for said, columns in swaps.items():
        yield said, columns
        for names, zero in product(sorted(groups), (ATMOSPHERE, -ATMOSPHERE)):
            which = f"{' and '.join(names)} count{'s' * (len(names) == 1)} from another zero"
            moved = f"{which} (`offset: {zero:+.0f} Pa`, unless piston/F has a zero so far off)"
            yield (*said, moved), columns | {name: columns[name] + zero for name in names}


def _moved(log: RigLog, gain: float, zero: float, others: dict[str, Array]) -> RigLog:
    """A log whose position is gain * q + zero, with its other channels."""
    c, turned = log.channels, {n: gain * getattr(log.channels, n) for n in ("v", "a", "quick")}
    moved = {n: gain * getattr(c, n) + zero for n in ("q", "read")}
    return replace(log, channels=replace(c, others=others, **moved, **turned))


def _scaled(log: RigLog, name: str, size: float) -> RigLog:
    """A log with exp(size) times the readings of one channel, or times as long."""
    gain, c, others = float(np.exp(size)), log.channels, log.channels.others
    if name == TIME:
        v, quick, a, width = c.v / gain, c.quick / gain, c.a / gain**2, gain * c.width
        slower = replace(c, time=gain * c.time, width=width, v=v, quick=quick, a=a)
        return replace(log, channels=slower)
    if name in others:
        return _moved(log, 1.0, 0.0, {**others, name: gain * others[name]})
    return _moved(log, gain, 0.0, others)


def _exchanged(log: RigLog, answer: str) -> RigLog:
    """A log with the readings of position and force exchanged."""
    c, q = log.channels, log.channels.others[answer]
    v = np.gradient(q, c.time)
    a, others = np.gradient(v, c.time), {**c.others, answer: c.q}
    return replace(log, channels=replace(c, others=others, q=q, read=q, v=v, quick=v, a=a))


def _best(
    tried: Array, change: Callable[[float], RigLog], left: Callable[[RigLog], float]
) -> float:
    """What a log is changed by where least is left of it; `tried` at even distances first."""

    def error(by: float) -> float:
        return left(change(by))

    near, step = min(tried, key=error), tried[1] - tried[0]
    return float(minimize_scalar(error, bounds=(near - step, near + step), method="bounded").x)
