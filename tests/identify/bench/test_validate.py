"""Mistakes in the columns of bench logs: alone, of several columns, and with a zero that moved."""

import re
from collections.abc import Callable

import numpy as np
import pytest

from kemba.effects.pneumatics.switching import pulses
from kemba.identify.bench.bench_log import SmoothedMotion
from kemba.identify.bench.prediction import RigModel
from kemba.identify.bench.problem import bench_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]
STROKE = 0.07
UNITS = {"m": "piston/x", "N": "piston/F"}
# what is right in the place of what was read
SWAPPED = {"valve/extend": ("valve/retract", 1.0, 0.0), "valve/retract": ("valve/extend", 1.0, 0.0)}
OFF = {name: (name, -1.0, 1.0) for name in SWAPPED}
TURNED, END = {"piston/F": ("piston/F", -1.0, 0.0)}, {"piston/x": ("piston/x", -1.0, STROKE)}
TENTH = {"piston/x": ("piston/x", 0.1, 0.0)}
# mistakes: column -> the one it is read from, sign and zero; and words of each
MISTAKES: dict[str, tuple[dict[str, tuple[str, float, float]], str]] = {
    "force": (TURNED, r"piston/F has the reversed sign \(pushing is positive\); the"),
    "force and zero": ({"piston/F": ("piston/F", -1.0, 40.0)}, r"sign: -1, offset: \+(39|40)"),
    "position": (END, r"extended end \(0 is retracted\); the"),
    "position and zero": (
        {"piston/x": ("piston/x", -1.0, STROKE + 5e-3)},
        r"extended end .* another zero \(`sign: -1, offset: (74|75)\.\d mm",
    ),
    "valves": (SWAPPED, "are swapped; the"),
    "off": (OFF, r"are inverted \(1 is on\); the"),
    "swapped and off": (
        {a: (b, -1.0, 1.0) for a, (b, _, _) in SWAPPED.items()},
        r"are swapped and .* are inverted \(1 is on\); the",
    ),
    "one off": ({"valve/retract": OFF["valve/retract"]}, r"run_0: valve/retract is inverted"),
    "force and position": (
        TURNED | END,
        "extended end .* and piston/F has the reversed sign .*; t",
    ),
    "force and valves": (TURNED | SWAPPED, "are swapped and piston/F has the reversed sign .*; t"),
    "from the other side": (
        TURNED | END | SWAPPED,
        "are swapped and .* extended end .* and piston/F has the reversed sign",
    ),
    "off, and a zero": (
        OFF | {"piston/F": ("piston/F", 1.0, 60.0)},
        r"are inverted \(1 is on\) and piston/F counts from another zero \(`offset: -(59|60)",
    ),
    "valves and a zero": (
        SWAPPED | {"piston/F": ("piston/F", 1.0, 60.0)},
        r"are swapped and piston/F counts from another zero \(`offset: -(59|60)",
    ),
    "decimetres, valves and force": (
        SWAPPED | TURNED | TENTH,
        r"are swapped and piston/x is 10 times too small .* and piston/F has the reversed sign",
    ),
    "decimetres": (TENTH, r"run_0: piston/x is 10 times too small \(its unit is wrong\); the"),
    "kilonewtons": (
        {"piston/F": ("piston/F", -1e-3, 0.0)},
        r"run_0: piston/F has the reversed sign .* and piston/F seems to be in kN; the force",
    ),
}


def taken(log: Trajectory, change: dict[str, tuple[str, float, float]]) -> Trajectory:
    """A log with columns as a logger reads them."""
    columns = {
        f"{a} [{log.unit(a)}]": gain * log[b] + zero for a, (b, gain, zero) in change.items()
    }
    return log.with_columns(columns)


def corrected(log: Trajectory, said: str) -> Trajectory:
    """A log as the advice says that it should be read."""
    change = {}
    if "are swapped" in said:
        change |= SWAPPED
    for names in re.findall(r"([\w/ ]+) (?:is|are) inverted", said):
        off = {name for name in SWAPPED if name in names}
        change |= {a: (change.get(a, OFF[a])[0], -1.0, 1.0) for a in off}
    if "piston/x is 10 times too small" in said:
        change |= {"piston/x": ("piston/x", 10.0, 0.0)}
    if "extended end" in said:
        change |= END
    if "piston/F has the reversed sign" in said:
        change |= {"piston/F": ("piston/F", -1e3 if "in kN" in said else -1.0, 0.0)}
    moved = r"(\S+) counts .{0,25}?(sign: -1, )?offset: (\S+) (m?m|N)`"
    for name, turned, number, unit in re.findall(moved, said):
        zero = float(number) / (1e3 if unit == "mm" else 1.0)
        change[name] = (name, -1.0 if turned else 1.0, zero)
    return taken(log, change)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_advice_once_followed_leaves_nothing(mistake: str, bench_log: BenchLog) -> None:
    change, words = MISTAKES[mistake]
    log, model = taken(bench_log(), change), load_model(rig=True)
    (fault,) = bench_problem([log], model).contradictions
    assert re.search(words, str(fault)) and "; or " not in str(fault), str(fault)
    again = bench_problem([corrected(log, str(fault))], model)
    again.validate()
    assert np.sqrt(np.mean(again.residual({}) ** 2)) < 1.2  # of the noise


@pytest.mark.parametrize(
    ("slower", "words"),
    [(False, "correct it with `delay`"), (True, "is the unit of the time wrong")],
)
def test_a_delay_is_advised_only_where_it_explains_the_force(
    slower: bool, words: str, bench_log: BenchLog
) -> None:
    """Of a log whose seconds are too long, chambers fill late and slowly."""
    log, model = bench_log(), load_model(rig=True)
    late = {"piston/F [N]": np.interp(log.time - 0.06, log.time, log["piston/F"])}
    read = Trajectory(10.0 * log.time, log.columns, log.meta) if slower else log.with_columns(late)
    (fault,) = bench_problem([read], model).contradictions
    assert "ms late" in str(fault) and re.search(words, str(fault)), str(fault)


def test_an_effect_is_no_mistake(bench_log: BenchLog) -> None:
    """Zeros that sensors may have are for `discover` to find."""
    change = {"piston/x": ("piston/x", 1.0, 8e-3), "piston/F": ("piston/F", 1.0, 20.0)}
    assert not bench_problem([taken(bench_log(), change)], load_model(rig=True)).contradictions


@pytest.mark.parametrize("mistake", ["", "valves", "force", "position"])
def test_another_supply_is_no_mistake_and_hides_none(mistake: str) -> None:
    """One chamber of a locked rod, at less pressure, looks like the smaller one."""
    time = np.arange(0.0, 1.0, 1e-3)
    on, zero = ((time > 0.2) & (time < 0.6)).astype(float), np.zeros(len(time))
    rig, still = RigModel(load_model(rig=True), (), ()), SmoothedMotion(time, *[zero] * 4, 0.0)
    force = rig.predict(still, (pulses(time, on), pulses(time, zero)), {}).force
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    columns = {
        "piston/x [m]": 1e-5 * noise[0],
        "valve/extend [1]": on,
        "valve/retract [1]": zero,
        "piston/F [N]": 0.85 * force + 0.3 * noise[1],
    }
    change, words = MISTAKES[mistake] if mistake else ({}, "")
    log = taken(Trajectory(time, columns, {"name": "run", "kind": "bench"}), change)
    faults = bench_problem([log], load_model(rig=True)).contradictions
    assert [bool(re.search(words, str(fault))) for fault in faults] == [True] * bool(mistake)
