"""One robot log as any other program might write it: names, units, clocks, extras, rates, formats.

`way(seed)` draws a way to write it, `written(way, folder)` writes it by `strange_forms`;
`judged(path, log)` says what a drafted map makes of it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from foreign_files import robot_log
from strange_forms import BARE, FORMS, START, Table

from kemba.errors import KembaError
from kemba.identify.logs.reading import needed, read_log
from kemba.logs import load_map
from kemba.logs.draft.draft import draft_map
from kemba.trajectory import Trajectory

LEGS = ("front", "rear")
STROKE = 0.07
Rng = np.random.Generator

NAMES: dict[str, dict[str, str]] = {
    "snake": {"body/x": "body_x", "body/z": "body_z", "body/pitch": "body_pitch",
              "hip/q": "{leg}_hip_pos", "hip/tau": "{leg}_hip_torque",
              "piston/x": "{leg}_piston_pos", "valve/extend": "{leg}_valve_extend",
              "valve/retract": "{leg}_valve_retract"},
    "topics": {"body/x": "/mocap/base/position/x", "body/z": "/mocap/base/position/z",
               "body/pitch": "/mocap/base/pitch", "hip/q": "/robot/{leg}_hip/position",
               "hip/tau": "/robot/{leg}_hip/effort",
               "piston/x": "/robot/{leg}_knee_cylinder/position",
               "valve/extend": "/robot/{leg}_valve/extend",
               "valve/retract": "/robot/{leg}_valve/retract"},
    "words": {"body/x": "Body Horizontal Position", "body/z": "Body Height",
              "body/pitch": "Body Pitch",
              "hip/q": "{Leg} Hip Angle", "hip/tau": "{Leg} Hip Torque",
              "piston/x": "{Leg} Piston Stroke", "valve/extend": "{Leg} Valve Extend",
              "valve/retract": "{Leg} Valve Retract"},
    "camel": {"body/x": "xBody", "body/z": "zBody", "body/pitch": "pitchBody",
              "hip/q": "hipAngle{Leg}", "hip/tau": "hipTorque{Leg}", "piston/x": "cylPos{Leg}",
              "valve/extend": "valveExt{Leg}", "valve/retract": "valveRet{Leg}"},
    "german": {"body/x": "Vorschub", "body/z": "Hoehe", "body/pitch": "Nickwinkel",
               "hip/q": "Huefte_{bein}_Winkel", "hip/tau": "Huefte_{bein}_Drehmoment",
               "piston/x": "Zylinder_{bein}_Weg", "valve/extend": "Ventil_{bein}_ausfahren",
               "valve/retract": "Ventil_{bein}_einfahren"},
    "dotted": {"body/x": "base.pos.x", "body/z": "base.pos.z", "body/pitch": "base.rpy.pitch",
               "hip/q": "{leg}.hip.q", "hip/tau": "{leg}.hip.tau", "piston/x": "{leg}.piston.x",
               "valve/extend": "{leg}.valve.extend", "valve/retract": "{leg}.valve.retract"},
    "abbrev": {"body/x": "POS_X", "body/z": "POS_Z", "body/pitch": "PITCH",
               "hip/q": "HIP_ANG_{l}", "hip/tau": "HIP_TRQ_{l}", "piston/x": "CYL_POS_{l}",
               "valve/extend": "VLV_EXT_{l}", "valve/retract": "VLV_RET_{l}"},
    "joints": {"body/x": "floating_base/pos_x", "body/z": "floating_base/pos_z",
               "body/pitch": "floating_base/rot_pitch",
               "hip/q": "joint_states/{leg}_hip_joint/position",
               "hip/tau": "joint_states/{leg}_hip_joint/effort",
               "piston/x": "joint_states/{leg}_knee_rod/position",
               "valve/extend": "cmd/{leg}_valve/extend",
               "valve/retract": "cmd/{leg}_valve/retract"},
    "parts first": {"body/x": "trunk_x", "body/z": "trunk_height", "body/pitch": "trunk_tilt",
                    "hip/q": "q_hip_{leg}", "hip/tau": "tau_hip_{leg}",
                    "piston/x": "x_cyl_{leg}", "valve/extend": "valve_{leg}_1",
                    "valve/retract": "valve_{leg}_2"},
    "planar": {"body/x": "x", "body/z": "y", "body/pitch": "theta", "hip/q": "hip_q_{l}",
               "hip/tau": "hip_tau_{l}", "piston/x": "cyl_x_{l}", "valve/extend": "u_ext_{l}",
               "valve/retract": "u_ret_{l}"},
    "actual": {"body/x": "Actual Position Body X", "body/z": "Actual Position Body Z",
               "body/pitch": "Actual Angle Body Pitch", "hip/q": "Actual Angle Hip {Leg}",
               "hip/tau": "Commanded Torque Hip {Leg}", "piston/x": "Actual Stroke Piston {Leg}",
               "valve/extend": "Solenoid {Leg} Out", "valve/retract": "Solenoid {Leg} In"},
    "simulink": {"body/x": "body.x", "body/z": "body.z", "body/pitch": "body.r",
                 "hip/q": "motor state ({L}).q", "hip/tau": "motor command ({L}).tau",
                 "piston/x": "piston state ({L}).p", "valve/extend": "piston command ({L}).ue",
                 "valve/retract": "piston command ({L}).ur"},
    "french": {"body/x": "Corps position x", "body/z": "Hauteur du corps",
               "body/pitch": "Tangage", "hip/q": "Angle hanche {avant}",
               "hip/tau": "Couple hanche {avant}", "piston/x": "Course vérin {avant}",
               "valve/extend": "Électrovanne {avant} sortie",
               "valve/retract": "Électrovanne {avant} rentrée"},
    "japanese": {"body/x": "胴体_x", "body/z": "胴体_高さ", "body/pitch": "胴体_ピッチ",
                 "hip/q": "{mae}股関節_角度", "hip/tau": "{mae}股関節_トルク",
                 "piston/x": "{mae}シリンダ_位置", "valve/extend": "{mae}電磁弁_伸",
                 "valve/retract": "{mae}電磁弁_縮"},
    "joined": {"body/x": "BODYX", "body/z": "BODYHEIGHT", "body/pitch": "BODYPITCH",
               "hip/q": "HIPANGLE{LEG}", "hip/tau": "HIPTORQUE{LEG}",
               "piston/x": "PISTONPOS{LEG}", "valve/extend": "VALVEEXT{LEG}",
               "valve/retract": "VALVERET{LEG}"},
    "compounds": {"body/x": "Rumpfweg_x", "body/z": "Rumpfhöhe", "body/pitch": "Rumpfneigung",
                  "hip/q": "Hüftwinkel_{bein}", "hip/tau": "Hüftmoment_{bein}",
                  "piston/x": "Kolbenweg_{bein}", "valve/extend": "Ventil_ausfahren_{bein}",
                  "valve/retract": "Ventil_einfahren_{bein}"},
    "numbered": {"body/x": "ch_a", "body/z": "ch_b", "body/pitch": "ch_c", "hip/q": "ch_d{n}",
                 "hip/tau": "ch_e{n}", "piston/x": "ch_f{n}", "valve/extend": "ch_g{n}",
                 "valve/retract": "ch_h{n}"},
}  # fmt: skip
BEIN = {"front": "vorne", "rear": "hinten"}
AVANT = {"front": "avant", "rear": "arrière"}
MAE = {"front": "前", "rear": "後"}
UNITS = {  # ours -> how it is written, and how many of it one of ours is
    "m": [("m", 1.0), ("mm", 1e3), ("cm", 1e2), ("mm/10", 1e4), ("1e-4 m", 1e4), ("um", 1e6)],
    "rad": [("rad", 1.0), ("deg", np.degrees(1)), ("deg/100", np.degrees(100)), ("mrad", 1e3)],
    "N.m": [("Nm", 1.0), ("N.m", 1.0), ("Nm/10", 10.0), ("mNm", 1e3), ("N m", 1.0)],
}
DOTTED = ("words", "dotted", "topics", "french")  # names that take no unit as another word
SAID = {"said": " in ", "norm": " / ", "word": " "}  # between a name and its unit
PLAIN = {"m": UNITS["m"][:2], "rad": UNITS["rad"][:2], "N.m": [("Nm", 1.0)]}


@dataclass
class Way:
    """How a log is written."""

    seed: int
    names: str
    units: str
    clock: str
    extras: tuple[str, ...]
    form: str


def way(seed: int) -> Way:
    """A way to write a log, drawn anew per seed."""
    rng = np.random.default_rng(seed)
    some = rng.choice(list(EXTRAS), size=rng.integers(0, 5), replace=False)
    found = Way(
        seed,
        str(rng.choice(list(NAMES))),
        str(rng.choice(["none", "square", "round", "tail", "below", "said", "norm", "word"])),
        str(rng.choice(list(CLOCKS))),
        tuple(map(str, some)),
        str(rng.choice(list(FORMS))),
    )
    if found.names == "japanese" and found.form == "mat vectors":
        found.names = "snake"  # MATLAB's variables have names of Latin letters
    return found


def written(found: Way, folder: Path) -> tuple[Path, Trajectory]:
    """The file, and the log that is in it."""
    rng = np.random.default_rng([found.seed, 1])
    log = noisy(rng)
    columns: dict[str, np.ndarray] = {}
    below: dict[str, str] = {}
    slow = set()
    plain = found.units in ("none", "tail", "word") or found.form in BARE
    chosen = {
        unit: ways[rng.integers(len(ways))] for unit, ways in (PLAIN if plain else UNITS).items()
    }
    for name in log.names:
        label, unit = _name(found.names, name), log.unit(name)
        text, size = chosen.get(unit, ("", 1.0))
        if text and found.units == "square":
            label = f"{label} [{text}]"
        elif text and found.units == "round":
            label = f"{label} ({text})"
        elif text and found.units in SAID and found.form not in BARE:
            label = f"{label}{SAID[found.units]}{text}"
        elif text and (found.units == "tail" and found.names not in DOTTED) | (
            found.units == "below" and found.form in BARE
        ):
            label = f"{label}_{text}"
        elif text and found.units == "below":
            below[label] = text
        columns[label] = log[name] * size
        slow |= {label} if name.startswith("body") else set()
    for extra in found.extras:
        columns |= EXTRAS[extra](log, found.names, rng)
    clock = CLOCKS[found.clock](log)
    items = [*columns.items()]
    rng.shuffle(items)  # type: ignore[arg-type]
    order = dict(items)
    columns = {**clock, **order} if rng.random() < 0.7 else {**order, **clock}
    table = Table(columns, log.time, set(clock), slow, chosen["rad"][0] == "deg", below)
    return FORMS[found.form](table, folder / f"log{found.seed}"), log


def noisy(rng: Rng, rows: int = 420) -> Trajectory:
    """A log with the noise of its sensors, at times that jitter."""
    log = robot_log(rows)
    noise = {"m": 1e-4, "rad": 1e-3, "N.m": 0.0, "1": 0.0}
    columns = {
        f"{n} [{log.unit(n)}]": log[n] + noise[log.unit(n)] * rng.standard_normal(rows)
        for n in log.names
    }
    time = np.round(log.time + 2e-5 * rng.standard_normal(rows), 6)
    return Trajectory(time - time[0], columns, {"kind": "robot"})


def _name(scheme: str, name: str) -> str:
    leg = next((leg for leg in LEGS if name.startswith(leg)), "")
    form = NAMES[scheme][name.removeprefix(f"{leg}/")]
    return form.format(leg=leg, Leg=leg.title(), LEG=leg.upper(), avant=AVANT.get(leg, ""),
                       mae=MAE.get(leg, ""), bein=BEIN.get(leg, ""), l=leg[:1].upper(),
                       L=leg[:1].upper(), n=LEGS.index(leg) if leg else "")  # fmt: skip


def _ns(log: Trajectory) -> np.ndarray:
    return START + np.round(log.time * 1e9).astype(np.int64)


def _strings(log: Trajectory, form: str) -> np.ndarray:
    dates = pd.to_datetime(_ns(log))
    return np.array([date.strftime(form) for date in dates], dtype=object)


CLOCKS: dict[str, Callable[[Trajectory], dict[str, np.ndarray]]] = {
    "seconds": lambda log: {"time": log.time},
    "t": lambda log: {"t": log.time - 0.3},
    "unit": lambda log: {"time [ms]": 1e3 * log.time},
    "no unit": lambda log: {"t [-]": log.time},
    "utc": lambda log: {"time (UTC)": _ns(log) / 1e9},
    "microseconds": lambda log: {"timestamp_us": _ns(log) // 1000},
    "nanoseconds": lambda log: {"stamp": _ns(log)},
    "player": lambda log: {
        "__time": _ns(log) / 1e9,
        "/robot/header/stamp/sec": _ns(log) // 10**9,
        "/robot/header/stamp/nanosec": _ns(log) % 10**9,
    },
    "pair": lambda log: {
        "header.stamp.nanosec": _ns(log) % 10**9,
        "header.stamp.sec": _ns(log) // 10**9,
    },
    "tv": lambda log: {"tv_sec": _ns(log) // 10**9, "tv_usec": _ns(log) % 10**9 // 1000},
    "pair_secs": lambda log: {"stamp_secs": _ns(log) // 10**9, "stamp_nsecs": _ns(log) % 10**9},
    "iso": lambda log: {"Timestamp": _strings(log, "%Y-%m-%dT%H:%M:%S.%fZ")},
    "german date": lambda log: {"Datum": _strings(log, "%d.%m.%Y %H:%M:%S.%f")},
    "american": lambda log: {"Date/Time": _strings(log, "%m/%d/%Y %I:%M:%S.%f %p")},
    "clock": lambda log: {"Uhrzeit": _strings(log, "%H:%M:%S.%f")},
    "minutes": lambda log: {"elapsed": _strings(log, "%M:%S.%f")},
    "duration": lambda log: {
        "Time": np.array([str(pd.Timedelta(int(1e9 * t), "ns")) for t in log.time], dtype=object)
    },
    "compact": lambda log: {"stamp": _strings(log, "%Y%m%d_%H%M%S.%f")},
    "days": lambda log: {"datenum [day]": log.time / 86_400.0},
    "days since": lambda log: {"Date [d]": 46_010.0 + log.time / 86_400.0},
    "excel": lambda log: {"Date": 46_010.5 + log.time / 86_400.0},
    "ctime": lambda log: {"Time": _strings(log, "%a %b %d %H:%M:%S.%f %Y")},
    "named zone": lambda log: {"Time": _strings(log, "%Y-%m-%d %H:%M:%S.%f CET")},
    "kanji": lambda log: {"時刻": _strings(log, "%Y年%m月%d日 %H:%M:%S.%f")},
    "rolled": lambda log: {"micros": (2**32 - 200_000 + (1e6 * log.time).astype(int)) % 2**32},
    "milliseconds": lambda log: {"epoch_ms": _ns(log) / 1e6},
    "zone": lambda log: {"timestamp": _strings(log, "%Y-%m-%d %H:%M:%S.%f+01:00")},
    "month": lambda log: {"Date": _strings(log, "%b %d, %Y %H:%M:%S.%f")},
    "date and clock": lambda log: {
        "Date": _strings(log, "%d/%m/%Y"),
        "Time": _strings(log, "%H:%M:%S.%f"),
    },
    "units in cells": lambda log: {
        "Time": np.array([f"{1e3 * t:.3f} ms" for t in log.time], dtype=object)
    },
    "two clocks": lambda log: {
        "ros_time": _ns(log) / 1e9,
        "elapsed_time [s]": log.time,
    },
    "unit in words": lambda log: {"Time (seconds)": log.time},
    "counter beside": lambda log: {"sample": np.arange(len(log)), "time_s": log.time},
}


def _desired(log: Trajectory, scheme: str, rng: Rng) -> dict[str, np.ndarray]:
    word = {"snake": "{}_des", "topics": "{}_desired", "words": "{} Setpoint", "camel": "{}Ref",
            "german": "{}_soll", "dotted": "{}.target", "planar": "{}_cmd"}  # fmt: skip
    form = word.get(scheme, "{}_demand")
    names = ["body/z", "front/hip/q", "rear/piston/x"]
    return {form.format(_name(scheme, n)): log[n] + 0.01 for n in names}


EXTRAS: dict[str, Callable[[Trajectory, str, Rng], dict[str, np.ndarray]]] = {
    "laser": lambda log, s, rng: {"laser [mm]": 1e3 * log["body/z"] + 5},
    "temperature": lambda log, s, rng: {"front_hip_temp": 30 + rng.random(len(log))},
    "current": lambda log, s, rng: {"rear_hip_current": 2 * log["rear/hip/tau"]},
    "desired": _desired,
    "status": lambda log, s, rng: {"status": np.array(["ok"] * len(log), dtype=object)},
    "quaternion": lambda log, s, rng: {
        "imu_orientation_x": 0 * log.time,
        "imu_orientation_y": np.sin(log["body/pitch"] / 2),
        "imu_orientation_z": 0 * log.time,
        "imu_orientation_w": np.cos(log["body/pitch"] / 2),
    },
    "roll and yaw": lambda log, s, rng: {
        "body_roll": 0.01 * rng.standard_normal(len(log)),
        "body_yaw": 0.02 * rng.standard_normal(len(log)),
    },
    "odometer": lambda log, s, rng: {"distance": np.cumsum(rng.random(len(log)))},
    "counter": lambda log, s, rng: {"seq": np.arange(len(log)) + 17},
    "battery": lambda log, s, rng: {"battery_voltage": 48 + rng.random(len(log))},
    "rates": lambda log, s, rng: {
        "front_hip_velocity": np.gradient(log["front/hip/q"], log.time),
        "front_piston_velocity": np.gradient(log["front/piston/x"], log.time),
    },
    "error": lambda log, s, rng: {"rear_hip_pos_error": 0.01 * rng.standard_normal(len(log))},
    "pressures": lambda log, s, rng: {
        "front_extend_pressure [bar]": 5 + rng.random(len(log)),
        "supply_pressure [bar]": 8 + 0.1 * rng.random(len(log)),
    },
    "forces": lambda log, s, rng: {"front_foot_Fz [N]": 40 * rng.random(len(log))},
    "accelerations": lambda log, s, rng: {
        "imu_acc_x [m/s^2]": rng.standard_normal(len(log)),
        "imu_acc_z [m/s^2]": rng.standard_normal(len(log)),
    },
    "text": lambda log, s, rng: {"note": np.array(["a, b"] + [""] * (len(log) - 1), dtype=object)},
    "nothing": lambda log, s, rng: {"unused": np.full(len(log), np.nan)},
    "rising angle": lambda log, s, rng: {"wheel": 10 * log.time + 0.1},
}


@dataclass
class Verdict:
    """`read` right without a hand-written line, `asked` a person, `refused` with a message, or a
    fault of kemba: `wrong` with exit 0, `crash`."""

    what: str
    why: str = ""


def judged(path: Path, log: Trajectory) -> Verdict:
    """What a drafted map makes of a log."""
    target = path.with_suffix(".map.yaml")
    try:
        draft = draft_map(path, LEGS, STROKE)
        target.write_text(draft.text(path.name), encoding="utf-8")
        if draft.missing or draft.questions:
            return Verdict("asked", "; ".join([*draft.missing, *draft.questions]))
        back = read_log(path, load_map(target))
    except KembaError as error:
        return Verdict("refused", str(error))
    except Exception as error:
        return Verdict("crash", repr(error))
    return _compared(back, log)


def _compared(back: Trajectory, log: Trajectory) -> Verdict:
    span = float(back.time[-1] - back.time[0]), float(log.time[-1])
    if abs(span[0] - span[1]) > 0.01 * span[1]:
        return Verdict("wrong", f"lasts {span[0]:.4g} s, not {span[1]:.4g} s")
    time = back.time - back.time[0]
    for name in needed(log):
        good = np.isfinite(back[name])
        if good.sum() < 0.08 * len(time):  # the slowest is read at a tenth of the rate
            return Verdict("wrong", f"{name} has few readings")
        expected = np.interp(time[good], log.time, log[name])
        slack = {"m": 2e-3, "rad": 1e-2, "N.m": 0.3, "1": 0.5}[log.unit(name)]
        off = float(np.quantile(np.abs(back[name][good] - expected), 0.95))
        if off > slack:
            return Verdict("wrong", f"{name} is off by {off:.3g}")
    return Verdict("read")
