"""What the way in which logs were taken costs: slow or uneven rows, odd clocks, coarse sensors,
unused columns."""

from collections.abc import Iterable, Sequence

import numpy as np

from kemba.identify.problem.noise import difference_sigma, is_coarse, step_of
from kemba.trajectory import Trajectory

# When the way in which logs were taken is worth a remark.
ROW = 1.25e-3  # step between rows from which it is said [s]: logs have 1 ms
UNEVEN = 0.1  # spread of the steps, as a share of the usual one, from which it is said
# rates to which recorders are set, without their power of ten: round numbers and powers of two
USUAL = (1.0, 1.024, 1.2, 1.25, 2.0, 2.048, 2.5, 2.56, 4.0, 5.0, 5.12, 8.0)
# share by which a rate is off the nearest usual one where the clock is doubted: clocks are good
# to less than 1 %; farther off, it is another rate
ODD = (0.01, 0.08)
COARSE = 5e-3  # steps of a channel, as a share of its range, that are worth a remark


def limits_of(logs: Sequence[Trajectory]) -> list[str]:
    """Remarks on what these logs cannot show, or show worse than others would."""
    return [*_slow(logs), *_uneven(logs), *_odd(logs), *_coarse(logs), *_unused(logs)]


def _slow(logs: Sequence[Trajectory]) -> Iterable[str]:
    step = max(float(np.median(np.diff(log.time))) for log in logs)
    if step > ROW:
        yield (
            f"{1 / step:.0f} Hz blurs valve edges to {1e3 * step:.2g} ms: valve delays are known "
            f"worse than from 1 kHz, and time constants below {1e3 * step:.2g} ms do not show"
        )
        if logs[0].meta.get("kind") == "bench":
            yield (
                "the moments of the valve commands are known to a row only: shorter delays and "
                "formulas are not looked for"
            )


def _uneven(logs: Sequence[Trajectory]) -> Iterable[str]:
    worst, usual = 0.0, 1e-3
    for log in logs:
        steps = np.diff(log.time)
        low, middle, high = np.quantile(steps, (0.16, 0.5, 0.84))
        if high - low > 2.0 * worst:
            worst, usual = 0.5 * float(high - low), float(middle)
    if worst > UNEVEN * usual:
        yield (
            f"rows come unevenly, {1e3 * usual:.2g} ms +- {1e3 * worst:.2g} ms apart: commands are "
            "known to act at the written times only as well as that"
        )


def _odd(logs: Sequence[Trajectory]) -> Iterable[str]:
    """A rate that nobody sets is a usual one by a clock that is wrong."""
    rate = 1.0 / float(np.median([np.median(np.diff(log.time)) for log in logs]))
    size = 10.0 ** np.floor(np.log10(rate))
    usual = np.array([*USUAL, 10.0]) * size
    nearest = float(usual[np.argmin(np.abs(np.log(usual / rate)))])
    off = nearest / rate - 1.0
    if ODD[0] < abs(off) < ODD[1]:
        word = "long" if off > 0 else "short"
        yield (
            f"{rate:.4g} rows a second is an odd rate: if the recorder was set to "
            f"{nearest:.4g} Hz, its seconds are {100 * abs(off):.1f} % too {word}, and so are the "
            f"delays and rise times that are found. `scale: {rate / nearest:.4g}` for the time in "
            "a map puts it right"
        )


def _coarse(logs: Sequence[Trajectory]) -> Iterable[str]:
    """Channels whose steps are larger than their noise."""
    steps: dict[str, float] = {}
    for log in logs:
        for name in log.names:
            y = log[name][np.isfinite(log[name])]
            if "valve/" in name or name.endswith("/tau") or len(y) < 2:
                continue
            step = step_of(y)
            if step > COARSE * np.ptp(y) and is_coarse(step, difference_sigma(y)):
                steps[f"{name} [{log.unit(name)}]"] = step
    for channel, step in steps.items():
        name, _, unit = channel.partition(" [")
        yield (
            f"{name} comes in steps of {step:.3g} {unit.removesuffix(']')}, which are larger than "
            f"its noise: they count as noise of {step / np.sqrt(12.0):.2g} (a step over sqrt(12))"
        )


def _unused(logs: Sequence[Trajectory]) -> Iterable[str]:
    if logs[0].meta.get("kind") == "robot" and any("/chamber/" in n for g in logs for n in g.names):
        yield (
            "chamber pressures are in these logs and are not used: of a robot the motion alone is "
            "explained. Take a bench log of this cylinder to use its pressures"
        )
