"""One robot log as five other programs would write it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kemba.trajectory import Trajectory

EPOCH = 1_790_000_000_000  # ms since 1970
GERMAN = {"m": (1e3, "mm"), "rad": (np.degrees(1), "deg"), "N.m": (1, "Nm"), "1": (24, "V")}
LEG = ("hip/q", "hip/tau", "piston/x", "valve/extend", "valve/retract")
SNAKE = dict(zip(LEG, ("hip_angle", "hip_torque", "cyl_pos", "sol_ext", "sol_ret"), strict=True))
SHORT = dict(zip(LEG, ("qm", "tm", "xp", "ue", "ur"), strict=True))


def robot_log(rows: int = 400) -> Trajectory:
    """Smooth made-up motions with the ranges of a jump, valves included; 1 kHz."""
    t = np.arange(rows) * 1e-3
    columns = {
        "body/x [m]": 0.1 * t,
        "body/z [m]": 0.35 + 0.12 * np.sin(9 * t),
        "body/pitch [rad]": 0.05 * np.sin(20 * t),
    }
    for i, leg in enumerate(("front", "rear")):
        columns |= {
            f"{leg}/hip/q [rad]": (-1) ** i * (0.6 + 0.3 * np.sin(7 * t + i)),
            f"{leg}/hip/tau [N.m]": 4 * np.cos(11 * t + i),
            f"{leg}/piston/x [m]": 0.035 + 0.03 * np.sin(13 * t - i),
            f"{leg}/valve/extend [1]": (t * 1000 % 100 < 40 + 10 * i).astype(float),
            f"{leg}/valve/retract [1]": (t * 1000 % 100 > 60 + 10 * i).astype(float),
        }
    return Trajectory(t, columns, {"kind": "robot"})


def german(log: Trajectory, path: Path) -> Path:
    """Stamps in ms since 1970, degrees, millimetres, 24 V valves, semicolons, decimal commas."""
    table = {
        "Zeitstempel [ms]": (EPOCH + np.round(log.time * 1e3)).astype(np.int64),
        "Status": "ok",
    }
    for name in log.names:
        unit = log.unit(name)
        scale, written = {
            "m": (1e3, "mm"),
            "rad": (np.degrees(1), "deg"),
            "N.m": (1, "Nm"),
            "1": (24, "V"),
        }[unit]
        table[f"{name.replace('/', ' ')} [{written}]"] = log[name] * scale
    table["Bemerkung"] = "Sprung; Versuch 3"
    pd.DataFrame(table).to_csv(path, sep=";", decimal=",", index=False)
    return path


def snake(log: Trajectory, path: Path) -> Path:
    """Parquet with names such as `hip_angle_front_deg` and a clock in ns."""
    table = {"timestamp_ns": (np.round(log.time * 1e9) + EPOCH * 10**6).astype(np.int64)}
    for name in log.names:
        leg, _, rest = name.partition("/")
        label = f"{SNAKE[rest]}_{leg}" if rest in SNAKE else f"torso_{rest}"
        angle = log.unit(name) == "rad"
        table[label + ("_deg" if angle else "")] = np.degrees(log[name]) if angle else log[name]
    pd.DataFrame(table).to_parquet(path)
    return path


def abbreviated(log: Trajectory, path: Path) -> Path:
    """The paper authors' short names: `qm_f`, `ue_b`."""
    table = {"time": log.time, "x": log["body/x"], "y": log["body/z"], "r": log["body/pitch"]}
    for leg, mark in (("front", "f"), ("rear", "b")):
        table |= {f"{SHORT[k]}_{mark}": log[f"{leg}/{k}"] for k in SHORT}
    pd.DataFrame(table).to_csv(path, index=False)
    return path


def player(log: Trajectory, path: Path) -> Path:
    """What PlotJuggler exports of ROS topics: split stamps, slashes, booleans; a title above."""
    table = {
        "/robot/header/stamp/sec": (EPOCH // 1000 + log.time // 1).astype(np.int64),
        "/robot/header/stamp/nanosec": np.round(log.time % 1 * 1e9).astype(np.int64),
        "/robot/base/position/x": log["body/x"],
        "/robot/base/position/z": log["body/z"],
        "/robot/base/pitch": log["body/pitch"],
    }
    for leg in ("front", "rear"):
        table |= {
            f"/robot/{leg}_hip/position": log[f"{leg}/hip/q"],
            f"/robot/{leg}_hip/effort": log[f"{leg}/hip/tau"],
            f"/robot/{leg}_knee_cylinder/position": log[f"{leg}/piston/x"],
            f"/robot/{leg}_valve_extend": log[f"{leg}/valve/extend"] > 0.5,
            f"/robot/{leg}_valve_retract": log[f"{leg}/valve/retract"] > 0.5,
        }
    text = pd.DataFrame(table).to_csv(index=False, sep="\t")
    path.write_text(f"# export of a bag\n\n{text}")
    return path


def joint_state(log: Trajectory, path: Path) -> Path:
    """`ros2 topic echo --csv` of a JointState with hips and pistons: no header at all."""
    joints = ["front_hip", "rear_hip", "front_piston", "rear_piston"]
    columns = [f"{j.replace('_', '/')}/{'q' if 'hip' in j else 'x'}" for j in joints]
    table = [
        (EPOCH // 1000 + log.time // 1).astype(np.int64),
        np.round(log.time % 1 * 1e9).astype(np.int64),
    ]
    frame = pd.DataFrame(dict(enumerate(table)))
    frame["frame"] = "base_link"
    for joint in joints:
        frame[f"n{joint}"] = joint
    for column in columns:
        frame[f"p{column}"] = log[column]
    for column in columns:
        frame[f"v{column}"] = np.gradient(log[column], log.time)
    for leg in ("front", "rear"):
        frame[f"e{leg}"] = log[f"{leg}/hip/tau"]
    frame["e3"] = 0.0
    frame["e4"] = 0.0
    frame.to_csv(path, index=False, header=False)
    return path


def workshop(log: Trajectory, path: Path) -> Path:
    """German names throughout, units behind them, and a few tenths of a volt on closed valves."""
    words = {
        "body/x": "Vorschub", "body/z": "Hoehe", "body/pitch": "Nick", "hip/q": "Huefte",
        "hip/tau": "Moment_Huefte", "piston/x": "Kolben", "valve/extend": "Ventil_ausfahren",
        "valve/retract": "Ventil_einfahren", "front/": "vorne", "rear/": "hinten",
    }  # fmt: skip
    units = {"m": (1e3, "mm"), "rad": (np.degrees(1), "Grad"), "N.m": (1, "Nm"), "1": (24, "V")}
    table = {"Zeitstempel_ms": (EPOCH + np.round(log.time * 1e3)).astype(np.int64), "Modus": "AUTO"}
    for name in log.names:
        said = [
            word for part, word in words.items() if name.endswith(part) or name.startswith(part)
        ]
        scale, unit = units[log.unit(name)]
        table["_".join([*said, unit])] = log[name] * scale + (0.3 if unit == "V" else 0.0)
    pd.DataFrame(table).to_csv(path, sep=";", decimal=",", index=False)
    return path


def camel(log: Trajectory, path: Path) -> Path:
    """Words run together, one letter for a leg, units behind; valves say `on` and `off`."""
    words = {
        "body/x": "xBody_mm", "body/z": "zBody_mm", "body/pitch": "theta_deg",
        "hip/q": "qHip{}_deg", "hip/tau": "tauHip{}_Nm", "piston/x": "cyl{}_mm",
        "valve/extend": "u_ext_{}", "valve/retract": "u_ret_{}",
    }  # fmt: skip
    scales = {"m": 1e3, "rad": np.degrees(1), "N.m": 1.0}
    table: dict[str, object] = {"t_ms": 1e3 * log.time}
    for name in log.names:
        word = next(word for part, word in words.items() if name.endswith(part))
        header, unit = word.format("F" if name.startswith("front") else "R"), log.unit(name)
        table[header] = (
            np.where(log[name] > 0, "on", "off") if unit == "1" else log[name] * scales[unit]
        )
    pd.DataFrame(table).to_csv(path, index=False)
    return path


def units_below(log: Trajectory, path: Path) -> Path:
    """German short forms between tabs, a remark above and the units in a row of their own."""
    words = {
        "body/x": "Vorschub", "body/z": "Hoehe", "body/pitch": "Nickwinkel", "hip/q": "Huefte",
        "hip/tau": "Moment_Huefte", "piston/x": "Zyl", "valve/extend": "Ventil_aus",
        "valve/retract": "Ventil_ein",
    }  # fmt: skip
    units = {"m": (1e3, "mm"), "rad": (np.degrees(1), "Grad"), "N.m": (1.0, "Nm"), "1": (1.0, "")}
    head, below, table = ["Zeit"], ["ms"], [1e3 * log.time]
    for name in log.names:
        word = next(word for part, word in words.items() if name.endswith(part))
        leg = {"front": "_vo", "rear": "_hi"}.get(name.split("/")[0], "")
        scale, unit = units[log.unit(name)]
        head, below, table = [*head, word + leg], [*below, unit], [*table, scale * log[name]]
    with path.open("w", encoding="utf-8") as stream:
        stream.write("# Messung 12\n" + "\t".join(head) + "\n" + "\t".join(below) + "\n")
        np.savetxt(stream, np.column_stack(table), fmt="%.17g", delimiter="\t")
    return path


def dataset(log: Trajectory) -> dict[str, dict[str, np.ndarray]]:
    """Signals and fields of the paper's authors' logsOut."""
    found = {"body": {"x": log["body/x"], "y": log["body/z"], "r": log["body/pitch"],
                      "dx": np.gradient(log["body/x"], log.time),
                      "dy": np.gradient(log["body/z"], log.time)}}  # fmt: skip
    for leg, side in (("front", "R"), ("rear", "L")):
        found[f"motor state ({side})"] = {"q": log[f"{leg}/hip/q"] - np.pi / 2}
        found[f"piston state ({side})"] = {"p": log[f"{leg}/piston/x"]}
        valves = {u: log[f"{leg}/valve/{v}"] for u, v in (("ue", "extend"), ("ur", "retract"))}
        found[f"piston command ({side})"] = valves
    return found


def logs_out(log: Trajectory, path: Path, version: str = "v7") -> Path:
    """The authors' logsOut: a Dataset of signals, each a struct of timeseries, as Simulink
    logs buses; by mat-io in imitation of MATLAB."""
    matio = pytest.importorskip("matio", reason="mat-io needs Python 3.11")
    from matio.utils.matclass import MatlabOpaque

    def series(name: str, values: np.ndarray) -> MatlabOpaque:
        given = {"Name": name, "Data": values[:, None], "Time": log.time[:, None]}
        return MatlabOpaque(properties=given, classname="timeseries")

    elements = []
    for name, fields in dataset(log).items():
        kind = np.dtype([(field, object) for field in fields])
        bus = np.empty((1, 1), dtype=kind)
        for field, values in fields.items():
            bus[field][0, 0] = series(field, values)
        given = {"Name": name, "Values": bus}
        elements.append(MatlabOpaque(properties=given, classname="Simulink.SimulationData.Signal"))
    cell = np.empty((len(elements), 1), dtype=object)
    for i, element in enumerate(elements):
        cell[i, 0] = element
    given = {"Name": "logsOut", "Elements": cell}
    whole = MatlabOpaque(properties=given, classname="Simulink.SimulationData.Dataset")
    matio.save_to_mat(path, {"logsOut": whole}, version=version)
    return path
