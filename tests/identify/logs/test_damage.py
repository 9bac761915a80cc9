"""Broken logs: each kind of damage gets a clear refusal, or is borne; never a wrong answer."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.identify.answer import Answer
from kemba.identify.logs.gate import _frozen, check_logs
from kemba.identify.logs.reading import excerpts, read_log
from kemba.identify.workflow import discover_logs
from kemba.logs import load_map
from kemba.trajectory import Trajectory

Damage = Callable[[list[str]], list[str]]


def column(number: int, change: Callable[[float], float], first: int = 0) -> Damage:
    """Change one column from row `first` on."""

    def damage(lines: list[str]) -> list[str]:
        out = lines[: 1 + first]
        for line in lines[1 + first :]:
            cells = line.split(",")
            cells[number] = repr(change(float(cells[number])))
            out.append(",".join(cells))
        return out

    return damage


def swapped(one: int, other: int) -> Damage:
    def damage(lines: list[str]) -> list[str]:
        out = [lines[0]]
        for line in lines[1:]:
            cells = line.split(",")
            cells[one], cells[other] = cells[other], cells[one]
            out.append(",".join(cells))
        return out

    return damage


def late_force(lines: list[str], rows: int = 80) -> list[str]:
    cells = [line.split(",") for line in lines[1:]]
    force = [c[4] for c in cells]
    return [lines[0]] + [",".join([*c[:4], f]) for c, f in zip(cells[rows:], force, strict=False)]


def frozen(lines: list[str]) -> list[str]:
    value = lines[1200].split(",")[4]
    return lines[:1200] + [",".join([*line.split(",")[:4], value]) for line in lines[1200:]]


TIME, X, EXTEND, RETRACT, F = range(5)

# damage, and words of the refusal
REFUSED: dict[str, tuple[Damage, str]] = {
    "swapped columns": (swapped(X, F), r"log.csv:\d+:2.*cannot be.*millimetres"),
    "millimetres": (column(X, lambda x: 1e3 * x), r"log.csv:2:2.*cannot be.*millimetres"),
    "reversed sign": (column(F, lambda f: -f), "reversed sign"),
    "swapped valves": (swapped(EXTEND, RETRACT), "swapped"),
    "other end": (column(X, lambda x: 0.07 - x), "counts from the extended end"),
    "kilonewtons": (column(F, lambda f: f / 1e3), "kN"),
    "clock offset": (late_force, r"80 ms late"),
    "dead sensor": (column(F, lambda f: 0.0), r"log.csv:2:5.*never changes.*dead"),
    "stuck sensor": (frozen, r"log.csv:120[01]:5.*readings in a row are exactly"),
    "saturated": (column(F, lambda f: min(f, 150.0)), r"exactly 150 N.*saturated"),
    "duplicated rows": (lambda t: [*t[:500], t[499], *t[500:]], r"log.csv:501:1.*repeated"),
    "time goes back": (lambda t: [*t[:500], *t[300:]], r"log.csv:501:1.*goes back"),
    "time in ms": (column(TIME, lambda t: 1e3 * t), "milliseconds"),
    "valve in volts": (column(EXTEND, lambda u: 5 * u), r"the valve command is 5; 0 or 1"),
    "semicolons": (lambda t: [line.replace(",", ";") for line in t], "semicolons"),
    "empty": (lambda t: [], "is empty"),
    "header only": (lambda t: t[:1], "0 rows"),
    "too short": (lambda t: t[:40], "39 rows"),
    "text in a cell": (lambda t: [*t[:7], "abc" + t[7], *t[8:]], r"log.csv:8:1.*not a number"),
    "missing column": (
        lambda t: [",".join(line.split(",")[:4]) for line in t],
        "needs the column 'piston/F'",
    ),
    "ragged": (lambda t: [*t[:9], t[9] + ",1", *t[10:]], r"log.csv:10: 6 cells"),
    "wrong unit": (lambda t: [t[0].replace("[m]", "[mm]"), *t[1:]], "not in SI"),
    "mostly missing": (
        lambda t: [t[0]] + [line.rsplit(",", 1)[0] + "," for line in t[1:2000]] + t[2000:],
        "readings are missing",
    ),
    "two logs joined": (column(X, lambda x: 0.07 - x, first=1000), r"log.csv:1002:2.*leaps by"),
    "nothing happens": (
        lambda t: [t[0]] + [f"{i / 1e3},0.02,0,0,{i % 7}" for i in range(1000)],
        "nothing moves",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_damage_is_refused_in_words(kind: str, log_file: Path) -> None:
    damage, words = REFUSED[kind]
    log_file.write_text("\n".join(damage(log_file.read_text().splitlines())) + "\n")
    try:
        answer, found = discover_logs([log_file])
    except KembaError as error:
        text = str(error)
    else:
        assert answer.verdict == "bad-data" and found is None
        text = answer.sentence
    assert re.search(words, text.replace("\n", " ")), text


def test_another_encoding_is_no_matter_or_is_named(log_file: Path) -> None:
    clean, text = read_log(log_file), log_file.read_text()
    log_file.write_text(text, encoding="utf-8-sig")
    assert np.array_equal(read_log(log_file)["piston/F"], clean["piston/F"])
    log_file.write_text(text.replace("piston/F [N]", "piston/F [N],Öl [K]"), encoding="latin-1")
    with pytest.raises(KembaError, match="not a UTF-8 text"):
        read_log(log_file)


LEGS = {"front": "rear", "rear": "front"}
MIXED_UP: dict[str, Callable[[str, np.ndarray], tuple[str, np.ndarray]]] = {
    "swapped legs": lambda header, y: (
        "/".join(LEGS.get(part, part) for part in header.split("/")),
        y,
    ),
    "hips counted the other way": lambda header, y: (header, -y if "hip/q" in header else y),
    "hips in degrees": lambda header, y: (header, np.degrees(y) if "hip/q" in header else y),
}


@pytest.mark.parametrize("kind", MIXED_UP)
def test_mixed_up_columns_of_a_robot_are_refused(
    kind: str, tmp_path: Path, authors_plan: Path
) -> None:
    log = read_log(authors_plan, load_map("authors"))
    columns = [MIXED_UP[kind](h, log[n]) for h, n in zip(log.headers, log.names, strict=True)]
    meta = {"kind": "robot", "noise": log.meta["noise"]}
    Trajectory(log.time, dict(columns), meta).write(tmp_path / "jump.csv")
    answer, found = discover_logs([tmp_path / "jump.csv"])
    assert answer.verdict == "bad-data" and found is None
    assert re.search("columns swapped|reversed sign|in degrees", answer.sentence), answer.sentence


def test_binary_is_refused(log_file: Path) -> None:
    log_file.write_bytes(bytes(range(256)) * 20)
    with pytest.raises(KembaError):
        read_log(log_file)


BORNE: dict[str, Damage] = {
    "dropped samples": lambda t: [t[0]] + [r for i, r in enumerate(t[1:]) if i % 17],
    "short bursts of nothing": lambda t: [
        line.rsplit(",", 1)[0] + "," if 400 < i % 900 < 420 else line for i, line in enumerate(t)
    ],
    "position missing": lambda t: [
        ",".join([line.split(",")[0], "", *line.split(",")[2:]]) if 600 < i < 630 else line
        for i, line in enumerate(t)
    ],
    "a gap": lambda t: [*t[:900], *t[1000:]],
}


@pytest.mark.parametrize("kind", BORNE)
def test_small_damage_is_borne(kind: str, log_file: Path) -> None:
    log_file.write_text("\n".join(BORNE[kind](log_file.read_text().splitlines())) + "\n")
    answer = _answer(log_file)
    assert answer.verdict == "nothing", answer.sentence
    assert answer.error_after < 1.2
    assert answer.remarks or kind == "dropped samples"


def test_mixed_line_ends_change_nothing(log_file: Path) -> None:
    clean = read_log(log_file)
    lines = log_file.read_bytes().split(b"\n")
    log_file.write_bytes(
        b"".join(line + (b"\r\n" if i % 3 else b"\n") for i, line in enumerate(lines))
    )
    again = read_log(log_file)
    assert np.array_equal(clean["piston/F"], again["piston/F"])


def _answer(path: Path) -> Answer:
    return discover_logs([path])[0]


def test_degrees_of_a_robot_are_refused(robot_columns: dict[str, np.ndarray]) -> None:
    columns = {**robot_columns, "front/hip/q [rad]": np.degrees(robot_columns["front/hip/q [rad]"])}
    log = Trajectory(np.arange(500) / 1e3, columns, {"name": "jump", "kind": "robot"})
    with pytest.raises(KembaError, match="is it in degrees"):
        check_logs([log])


def test_a_fit_robot_log_passes(robot_columns: dict[str, np.ndarray]) -> None:
    log = Trajectory(np.arange(500) / 1e3, robot_columns, {"name": "jump", "kind": "robot"})
    assert check_logs([log]) == []


@pytest.fixture
def robot_columns() -> dict[str, np.ndarray]:
    """Columns of a robot log that moves a little, with noise."""
    t, rng = np.arange(500) / 1e3, np.random.default_rng(0)
    wave = np.sin(6 * t)
    columns = {
        "body/x [m]": 0.01 * wave,
        "body/z [m]": 0.25 + 0.05 * wave,
        "body/pitch [rad]": 0.05 * wave,
    }
    for leg in ("front", "rear"):
        columns[f"{leg}/hip/q [rad]"] = -1.2 + 0.1 * wave
        columns[f"{leg}/hip/tau [N.m]"] = wave
        columns[f"{leg}/piston/x [m]"] = 0.03 + 0.02 * wave
        columns[f"{leg}/valve/extend [1]"] = (t > 0.1) * 1.0
        columns[f"{leg}/valve/retract [1]"] = (t > 0.3) * 1.0
    return {
        name: y if "valve" in name else y + 1e-4 * rng.standard_normal(len(y))
        for name, y in columns.items()
    }


def test_a_huge_log_is_cut_down(bench_log: Callable[..., Trajectory]) -> None:
    log = bench_log(duration=2.0)
    headers = dict(zip(log.headers, (log[n] for n in log.names), strict=True))
    long = Trajectory(
        np.arange(400 * len(log)) / 1e4,
        {h: np.tile(y, 400) for h, y in headers.items()},
        log.meta,
    )
    pieces, remarks = excerpts([long])
    assert sum(len(p) for p in pieces) <= 60_000 and len(pieces) > 5
    assert len(remarks) == 2


@pytest.mark.parametrize("step", [2e-5, 1e-4])
def test_an_encoder_that_rests_before_the_motion_is_not_stuck(step: float, tmp_path: Path) -> None:
    """On a grid a sensor at rest repeats itself; it is left by a step or two."""
    time = np.arange(2000) / 1e3
    phase = 10 * np.pi * np.clip(time - 0.325, 0.0, None)
    x = step * np.round((0.010 + 0.025 * (1 - np.cos(phase))) / step)
    noise = np.random.default_rng(0).standard_normal(len(time))
    valve = (phase > 0) & (np.floor(phase) % 2 == 0)
    columns = {"piston/x [m]": x, "valve/extend [1]": valve.astype(float),
               "valve/retract [1]": 0 * time, "piston/F [N]": noise}  # fmt: skip
    log = Trajectory(time, columns, {"kind": "bench"})
    assert not list(_frozen(log, "piston/x", x))
    assert list(_frozen(log, "piston/x", np.minimum(x, 0.04))), "it is saturated"
