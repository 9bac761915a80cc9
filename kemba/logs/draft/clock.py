"""Which column is the time: all candidates, scored, the best with its reason."""

import re
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kemba.logs import times
from kemba.logs.columns import Number
from kemba.logs.draft import matching
from kemba.logs.draft.words import Names, named_unit, says_time, words
from kemba.logs.foreign import held
from kemba.logs.recording import Raw, some
from kemba.logs.text import OFF, ON, as_numbers, without
from kemba.quantity import convert
from kemba.trajectory import Array

FIELDS = ("position", "velocity", "effort")
REPEATED = 0.15  # share of rising steps where up to six topics have rows of one stamp
RISING = 0.99  # share of steps that must rise: a few repeats are for the gate to tell
ODD = 0.05  # share of the cells of a column that may be of another kind than the others
SEVERAL = 6  # different values make a channel, no switch; so many words may say `no reading`
FAR = 5.0  # times the largest other reading; a number of nines beyond it is none
NINES = re.compile(r"-?9{2,}(?:\.9+)?")
# the last numbers of 15, 16, 31 and 32 bit, which converters give where they have no reading
LAST = frozenset(float(s * 2**n - 1 + (s < 0)) for s in (1, -1) for n in (15, 16, 31, 32))
STAMPED = 1e8  # s; larger first stamps count from 1970 (three years) or from the start of a clock
ALIKE = 0.02  # share by which two clocks of one log may differ
SURE = (5e-5, 0.05)  # s between rows that leave no doubt about a time in s
SURE_OF_TICKS = (4e-4, 6e-3)  # and about one in ms, us or ns: 0.1 ms and 100 ns are usual ticks too
NEAR = 15.0  # scores that differ by less do not decide between clocks that contradict each other

# Scores: what a column is called decides, how it is written breaks ties.
PLOTTER, NAMED, MENTIONED, BY_UNIT, UNNAMED, COUNTER = 100.0, 80.0, 60.0, 50.0, 10.0, 5.0
SECONDS = frozenset("sec secs second seconds tv_sec s".split())
PARTS = {
    "ns": "nsec nsecs nanosec nanosecs nanosecond nanoseconds ns nano nanos".split(),
    "us": "usec usecs microsec microsecs microsecond microseconds us micro micros".split(),
    "ms": "msec msecs millisec millisecs millisecond milliseconds ms milli millis".split(),
}
LARGEST = {"ns": 1e9, "us": 1e6, "ms": 1e3}
COUNTERS = frozenset(
    "index idx row rows sample samples frame frames count counter seq number nr id no".split()
)


@dataclass(frozen=True)
class Clock:
    """A way to read the time: how the map reads it, from which columns, `seconds` (n,) from its
    first row, why, and what speaks against it."""

    score: float
    source: dict[str, Any]
    names: tuple[str, ...]
    seconds: Array
    from_first: bool
    reason: str
    question: str = ""


def numbers(raw: Raw, decimal: str, missing: Collection[Number] = ()) -> dict[str, Array]:
    """The columns (n,) that hold numbers; those of texts are left out."""
    found = {}
    for name, cells in raw.items():
        if cells.dtype == object:
            values, wrong = as_numbers(cells, decimal, missing)
        else:
            values, wrong = without(cells.astype(float), missing), np.zeros(1)
        if np.isfinite(values).any() and wrong.mean() < ODD:
            found[name] = values
    return found


def no_readings(raw: Raw, decimal: str) -> list[Number]:
    """What stands in columns of numbers where there is no reading: a word that is there again and
    again, the infinite, and a number of nines, or the last of 16 or 32 bit, far from all others."""
    found: dict[Number, None] = {}
    for cells in raw.values():
        if cells.dtype == object:
            values, wrong = as_numbers(cells, decimal)
            texts = Counter(str(cell).strip() for cell in cells[wrong])
            known = len(np.unique(values[np.isfinite(values)]))
            if wrong.mean() < 0.5 and known > SEVERAL >= len(texts):
                found |= dict.fromkeys(t for t, n in texts.items() if n > 1 and _is_word(t))
        else:
            values = cells.astype(float)
        infinite = values[np.isinf(values)]
        found |= dict.fromkeys(map(str, infinite[:1]))
        values = values[np.isfinite(values)]
        for value in {float(values.min()), float(values.max())} if len(values) else ():
            rest = values[values != value]
            if value in LAST or NINES.fullmatch(f"{value:g}"):
                far = abs(value) > FAR * np.abs(rest).max(initial=0.0)
                if far and len(rest) < len(values) - 1 and len(np.unique(rest)) > SEVERAL:
                    found[int(value) if value % 1 == 0 else value] = None
    return list(found)


def _is_word(text: str) -> bool:
    return not any(map(str.isdigit, text)) and times.seconds(np.array([text] * 2)) is None


def no_time(raw: Raw, values: Mapping[str, Array], decimal: str) -> tuple[str, str, int]:
    """Why none of the columns (n,) is a time, what to do, and the row from 0 in which it shows; -1
    where it shows in none."""
    rows = len(next(iter(raw.values()), ()))
    if len(raw) > max(5 * rows, SEVERAL):
        turned = "pandas.read_csv(FILE, header=None, index_col=0).T.to_csv(FILE, index=False)"
        return "it lies on its side: its channels are rows", turned, -1
    for name, cells in raw.items():
        if cells.dtype != object:
            continue
        stamps = [times.seconds(np.array([cell, cell], dtype=object)) is None for cell in cells]
        kinds = {"numbers": as_numbers(cells, decimal)[1], "times": np.array(stamps)}
        for kind, wrong in kinds.items():
            if 0.0 < wrong.mean() < ODD:
                row = int(np.argmax(wrong))
                what = f"'{cells[row]}' stands in the column '{name}', whose other cells are {kind}"
                return what, "is this line a remark, or a second header? Then take it out", row
    for name, cells in raw.items():
        if not says_time(name):
            continue
        read = values.get(name, times.seconds(cells) if cells.dtype == object else None)
        if read is None:
            return f"'{name}' holds '{cells[0]}', which is no time that is known", STEPS, -1
        steps = np.diff(read[np.isfinite(read)])
        if np.mean(steps < 0) > 0.5:
            what = f"'{name}' falls from row to row: its last row stands first"
            return what, "turn the order of the rows around", -1
        still = f"'{name}' stays the same in {np.mean(steps == 0):.0%} of the steps between rows"
        why = "it has too few digits, is coarser than the rows, or these are of many channels"
        return f"{still}: {why}", STEPS, -1
    return f"no column rises from row to row like a time; it holds {held(raw)}", STEPS, -1


STEPS = (
    "write the time with more digits; or, where rows are equally far apart, add a column that "
    "counts them, and map it with their distance as its unit: `unit: 2 ms`"
)


def switches(raw: Raw) -> set[str]:
    """The columns that say `on` and `off`, `true` and `false` or the like."""
    said = {*ON.split(), *OFF.split()}
    found = {name for name, cells in raw.items() if cells.dtype == bool}
    texts = [(name, cells) for name, cells in raw.items() if cells.dtype == object]
    return found | {n for n, cells in texts if {str(c).strip().lower() for c in cells} <= said}


def stamp_of(raw: Raw, values: Mapping[str, Array], names: Names) -> Clock | None:
    """The best of all candidates (n,); None where no column rises that may be a time.

    A question is put where another one, as good by its name, runs at another rate.
    """
    found = sorted(_candidates(raw, values, names), key=lambda c: -c.score)
    if not found:
        return None
    best = found[0]
    against = [c for c in found[1:] if best.score - c.score < NEAR and not _agree(best, c)]
    alike = [c for c in found[1:] if c.score > UNNAMED and _agree(best, c)]
    reason, question = best.reason, best.question
    if alike:
        reason += f"; as fast as {some(['+'.join(c.names) for c in alike], 3)}"
    if COUNTER < best.score <= UNNAMED:
        asked = f"no column is called a time; is '{best.names[0]}', which rises, one?"
        question = f"{asked} {question}".strip()
    if against and best.score > UNNAMED:
        other = against[0]
        question = (
            f"is the time {'+'.join(best.names)}, {np.nanmax(best.seconds):.4g} s long, or "
            f"{'+'.join(other.names)}, {np.nanmax(other.seconds):.4g} s long?"
        )
    return replace(best, reason=reason, question=question)


def joint_state_labels(raw: Raw) -> dict[str, str]:
    """Names for the columns of `ros2 topic echo --csv` of a JointState: stamp, frame, the joints'
    names, then their positions, velocities and efforts. Empty where the columns are others."""
    texts = {name: cells for name, cells in raw.items() if cells.dtype == object and len(cells)}
    alike = [(name, str(cells[0])) for name, cells in texts.items() if len(set(cells)) == 1]
    constant = [name for name, cell in alike if any(map(str.isalpha, cell))]
    joints = [str(raw[name][0]) for name in constant if name.isdigit() and int(name) > 3]
    after = [name for name in raw if name.isdigit() and int(name) > 3 + len(joints)]
    if not joints or len(after) < len(joints):
        return {}
    return {
        column: f"{joints[i % len(joints)]}_{FIELDS[i // len(joints)]}"
        for i, column in enumerate(after[: len(FIELDS) * len(joints)])
    }


def _candidates(raw: Raw, values: Mapping[str, Array], names: Names) -> list[Clock]:
    texts = {n: times.seconds(c) for n, c in raw.items() if n not in values and c.dtype == object}
    found = _pairs(values, {name: read for name, read in texts.items() if read is not None})
    parts = {name for pair in found for name in pair.names}
    rest = [name for name in raw if name not in parts]
    found += [c for name in rest if (c := _single(name, raw, values, names)) is not None]
    if list(raw)[:2] == ["1", "2"] and _is_split(values):
        found.append(_pair(values, "1", "2", "ns", NAMED + 1))
    return found


def _single(name: str, raw: Raw, values: Mapping[str, Array], names: Names) -> Clock | None:
    """A column that rises: of numbers, or of texts that are times."""
    stated = names.unit(name)
    if name not in values:
        cells = raw[name]
        read = times.seconds(cells) if cells.dtype == object else None
        if read is None or not _rises(read):
            return None
        score = NAMED if says_time(name) else MENTIONED
        return Clock(score, {"source": name}, (name,), read, False, f"'{name}' holds clock times")
    rows = values[name]
    sure = says_time(name) or stated is not None
    if not _rises(rows, sure) or not matching.converts(stated, "s"):
        return None
    called = _called(name, rows, stated, names)
    if called is None:
        return None
    score, reason = called
    unit = stated or matching.time_unit(rows[np.isfinite(rows)])
    exact = times.joined(raw[name] if raw[name].dtype.kind in "iu" else rows)[0]
    seconds = exact - exact[np.argmax(np.isfinite(rows))]
    seconds = convert(np.asarray(seconds, dtype=float), unit, "s")
    began = convert(float(rows[np.isfinite(rows)][0]), unit, "s")
    source = {"source": name, **({} if unit == "s" else {"unit": unit})}
    question = ""
    if stated is None:
        reason += f"; no unit is told: taken as {unit}, by the step between rows"
        step = float(np.median(np.diff(np.unique(seconds[np.isfinite(seconds)]))))
        first, last = SURE if unit == "s" else SURE_OF_TICKS
        if _is_sexagesimal(rows[np.isfinite(rows)]):
            question = f"does '{name}' write a clock as hhmmss? Then write it as hh:mm:ss"
        stamped = 6e8 < began < 4.1e9  # since 1970: between 1990 and 2100
        if not (first <= step <= last or stamped or unit == "day"):
            apart = f"are the rows {1e3 * step:.3g} ms apart?"
            question = f"{apart} '{name}' has no unit: taken as {unit}"
    return Clock(score, source, (name,), seconds, abs(began) > STAMPED, reason, question)


def _is_sexagesimal(rows: Array) -> bool:
    """Whether a time (n,) of numbers leaps from 59 to 100, as one that is written hhmmss."""
    steps, seconds, minutes = np.diff(rows), rows % 100, rows // 100 % 100
    leaps = steps[steps > 1.0]
    full = bool(rows.max() < 24e4 and seconds.max() < 60 and minutes.max() < 60)
    return full and len(leaps) > 0 and bool(np.all((leaps % 4000 > 39) & (leaps % 4000 < 42)))


def _called(name: str, rows: Array, stated: str | None, names: Names) -> tuple[float, str] | None:
    """The score of a rising column by its name, and why; None where it is something else."""
    said = words(names.bare(name))
    if name == "__time":
        return PLOTTER, "'__time' is the clock that PlotJuggler puts before all topics"
    if says_time(name):
        others = [w for w in said if not says_time(w)]
        score = MENTIONED - len(others) if others else NAMED
        return score, f"'{name}' is called a time and rises"
    if stated is not None:
        return BY_UNIT, f"'{name}' rises and has the unit {stated}"
    steps = np.diff(rows[np.isfinite(rows)])
    says = {} if name.isdigit() else names.says(name)
    if set(said) & COUNTERS or (np.all(steps == 1.0) and not says):
        return COUNTER, f"no column is a time: '{name}' counts rows, so check the rate"
    if says:
        return None
    return UNNAMED, f"no column is called a time: '{name}' is the one that rises"


def _pairs(values: Mapping[str, Array], texts: Mapping[str, Array]) -> list[Clock]:
    """Whole seconds and what is below them, in columns of one path; also of `texts` that were read
    as times (n,)."""
    found = []
    every = {**values, **texts}
    for name in every:
        head, tail = _split(name)
        if tail not in SECONDS and name not in texts:
            continue
        for other in values:
            path, part = _split(other)
            unit = next((u for u, known in PARTS.items() if part in known), None)
            near = not path or says_time(path) if name in texts else path == head
            if near and unit is not None and _whole(every[name], values[other], unit):
                score = NAMED + 1 if not head or head.count("/") < 2 else NAMED - 1
                found.append(_pair(every, name, other, unit, score))
    return found


def _split(name: str) -> tuple[str, str]:
    """The path of a name and its last word: `stamp/nanosec`, `tv_nsec`, `time.sec`, `stamp_ns`."""
    match = re.fullmatch(r"(.*?)([A-Za-z]+)", name.strip())
    if match is None:
        return name, ""
    head, tail = match.groups()
    inner = re.fullmatch(r"(.*?[a-z])(Sec|Nsec|NanoSec|Nanosec|Usec)", name.strip())
    head, tail = inner.groups() if inner else (head, tail)
    return re.sub(r"[\W_]+$", "", head).lower(), tail.lower()


def _pair(values: Mapping[str, Array], whole: str, rest: str, unit: str, score: float) -> Clock:
    source = {"source": whole, "add": {"source": rest, "unit": unit}}
    if named_unit(whole)[1] is None:
        source["unit"] = "s"
    seconds = values[whole] - values[whole][0] + convert(values[rest], unit, "s")
    reason = f"'{whole}' and '{rest}' are the seconds and {unit} of one stamp"
    return Clock(score, source, (whole, rest), seconds - seconds[0], True, reason)


def _whole(seconds: Array, rest: Array, unit: str) -> bool:
    """Whether two columns are whole seconds and what is below one, which rise together."""
    good = np.isfinite(seconds) & np.isfinite(rest)
    if good.sum() < 2 or not np.all(seconds[good] % 1 == 0):
        return False
    if rest[good].min() < 0 or rest[good].max() >= LARGEST[unit]:
        return False
    return _rises((seconds - seconds[good][0]) + convert(rest, unit, "s"))


def _is_split(values: Mapping[str, Array]) -> bool:
    """Whether columns 1 and 2 are whole seconds since 1970 and nanoseconds."""
    if "1" not in values or "2" not in values:
        return False
    whole, rest = values["1"], values["2"]
    return bool(np.all(whole % 1 == 0) and whole[0] > STAMPED and 1e4 < rest.max(initial=0.0) < 1e9)


def _agree(a: Clock, b: Clock) -> bool:
    """Whether two clocks run at one rate, where they are as long."""
    if len(a.seconds) != len(b.seconds):
        return True  # of channels of another rate
    spans = np.nanmax(a.seconds), np.nanmax(b.seconds)
    return bool(abs(spans[0] - spans[1]) <= ALIKE * max(spans))


def _rises(values: Array, named: bool = True) -> bool:
    """Whether a column rises; one that is called a time may repeat, as where each topic has rows of
    its own."""
    steps = np.diff(values[np.isfinite(values)])
    if not len(steps):
        return False
    rising = np.mean(steps > 0)
    often = named and rising > REPEATED and np.mean(steps < 0) < 1 - RISING
    return bool(rising > RISING or often)
