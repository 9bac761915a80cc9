"""Checks of logs of the user's own rigs: columns, units, clock, readings, excitation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kemba.errors import KembaError, suggest
from kemba.identify.logs.fault import UNMAPPED, log_fault
from kemba.trajectory import TIME, Trajectory


class OwnRigGateSettings:
    """When a log of a rig of the user's own is refused."""

    fewest = 60  # rows that the log of a moving rig needs
    fewest_still = 8  # readings per channel that a vessel's log needs
    missing = 0.3  # share of readings of a needed column that may be missing
    vacuum = 2e4  # no rig's pressure is below this [Pa]: gauge or bar read so as pascals
    unmoved = 3.0  # a position with less travel than so many of its steps rests


def own_faults(log: Trajectory) -> list[KembaError]:
    """Faults of the log of a rig; a later check runs only where the earlier ones found nothing."""
    for stage in (_columns, _time, _readings, _excitation):
        found = list(stage(log))
        if found:
            return found
    return []


def _columns(log: Trajectory) -> Iterator[KembaError]:
    logged: dict[str, str] = log.meta.get("logged", {})
    known = [name for name in logged if name in log]
    vessel = log.meta["kind"] == "vessel"
    for name, unit in logged.items():
        if name not in log:
            if vessel and known:
                continue  # one of pressure and temperature is enough
            hint = "; ".join(filter(None, (suggest(name, log.names), UNMAPPED)))
            what = f"needs the column '{name} [{unit}]', which is missing"
            yield log_fault(log, what, "the model's rig asks for it", hint)
        elif log.unit(name) != unit:
            what = f"the column's unit is [{log.unit(name)}]"
            hint = "convert it with --map; is the axis of the rig linear or rotary?"
            yield log_fault(log, what, f"'{name} [{unit}]' was expected", hint, column=name)


def _time(log: Trajectory) -> Iterator[KembaError]:
    limits, t = OwnRigGateSettings, log.time
    fewest = limits.fewest_still if log.meta["kind"] == "vessel" else limits.fewest
    if len(t) < fewest:
        yield log_fault(log, f"has {len(t)} rows", f"at least {fewest} were expected")
        return
    wrong = ~np.isfinite(t)
    wrong[1:] |= ~(np.diff(t) > 0)
    if wrong.any():
        i = int(np.argmax(wrong))
        what = f"the time is {t[i]:.6g} s after {t[max(i - 1, 0)]:.6g} s"
        yield log_fault(log, what, "times must increase from row to row", row=i, column=TIME)


def _readings(log: Trajectory) -> Iterator[KembaError]:
    limits, vessel = OwnRigGateSettings, log.meta["kind"] == "vessel"
    for name in log.meta.get("logged", {}):
        if name not in log:
            continue
        y = log[name]
        good = np.isfinite(y)
        if vessel and good.sum() < limits.fewest_still:
            what = f"has {int(good.sum())} readings"
            yield log_fault(log, what, f"at least {limits.fewest_still} were expected", column=name)
        elif not vessel and 1.0 - good.mean() > limits.missing:
            what = f"{100 * (1.0 - good.mean()):.0f} % of its readings are missing"
            yield log_fault(log, what, column=name, row=int(np.argmin(good)))
        elif name.endswith("/P") and np.median(y[good]) < limits.vacuum:
            what = f"reads {np.median(y[good]):.4g} Pa, less than any air pressure"
            hint = "is it in bar or kPa, or above the atmosphere? Convert it with --map"
            yield log_fault(log, what, "pascals, absolute, were expected", hint, column=name)


def _excitation(log: Trajectory) -> Iterator[KembaError]:
    for name in log.meta.get("logged", {}):
        if name not in log:
            continue
        y = log[name][np.isfinite(log[name])]
        steps = np.diff(np.unique(y))
        if not len(steps):
            hint = "is the sensor dead, or the rig at rest?"
            yield log_fault(log, "never changes", "a log of a rig that works", hint, 0, name)
        elif name.endswith(("/x", "/q")) and np.ptp(y) < OwnRigGateSettings.unmoved * (steps.min()):
            yield log_fault(log, "hardly moves", "a log with motion was expected", column=name)
