"""Draft a column map for a log of another program, from names, units and ranges."""

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs.columns import ColumnMap, shipped_maps
from kemba.logs.draft import matching
from kemba.logs.draft.clock import (
    joint_state_labels,
    no_readings,
    no_time,
    numbers,
    stamp_of,
    switches,
)
from kemba.logs.draft.matching import (
    Assigned,
    Target,
    assigned,
    bench_targets,
    drive_targets,
    rig_targets,
    robot_targets,
)
from kemba.logs.draft.sizes import guessed_units
from kemba.logs.draft.words import (
    FACTOR,
    NEGATED,
    WORDS,
    Names,
    is_unit,
    quaternions,
    spelt,
    strange_unit,
    upright,
    words,
)
from kemba.logs.foreign import TEXTS, is_recorded, no_log, raw_columns, wraps
from kemba.logs.formats import check_read
from kemba.logs.text import COMMENT, cells_of, joined, line_of, lines_of
from kemba.trajectory import TIME, Array

LINES = 300  # as many are looked at; a table that changes later is told when it is read
NEARLY = 0.8  # share of the most numbers that a way to read a table must give
SEPARATORS = (";", "tab", ",", "|", "whitespace")
WAYS = [(mark, sign) for mark in SEPARATORS for sign in (".", ",") if mark != sign]
NUMBER = {
    ".": re.compile(r"[+\u2212-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?"),
    ",": re.compile(r"[+\u2212-]?(\d+,?\d*|,\d+)([eEdD][+-]?\d+)?"),
}
PISTONS = frozenset(WORDS["part"]["piston"].split()) - {"knee"}
Layout = dict[str, Any]
USUAL = {"separator": ",", "decimal": ".", "skip_rows": 0, "skip_below": 0, "header": 1}  # unsaid


def layout_of(path: Path) -> Layout:
    """Keys of a column map that say how to read the table; those with their default are left out.

    Of all separators and decimal signs that give about the most numbers, one that gives a name to
    each column too, then one that is no blank, which stands in dates and names as well, and then
    the one that gives most. Raises KembaError where none gives a table of at least two columns.
    """
    lines = _lines(path)
    found = [(_numbers(lines, *way), way) for way in WAYS]
    most = max(score for (score, _, _), _ in found)
    (score, begin, width), (separator, decimal) = max(
        (way for way in found if way[0][0] >= NEARLY * most),
        key=lambda way: (
            _header(lines[: way[0][1]], way[1][0], way[0][2])[1] > 0,
            way[1][0] != "whitespace",
            way[0][0],
        ),
    )
    if not score or width < 2 or _named_cells(lines):
        raise KembaError(str(path), *_no_table(lines))
    header, rows = _header(lines[:begin], separator, width)
    below = sum(bool(line.strip()) for line in lines[header + rows : begin]) if rows else 0
    keys: Layout = {"separator": separator, "decimal": decimal, "skip_below": below}
    keys |= {"skip_rows": header if rows else begin, "header": rows or False}
    return {key: value for key, value in keys.items() if value != USUAL[key]}


def _no_table(lines: Sequence[str]) -> tuple[str, str, str]:
    """What a text is that is no table, what was expected, and the way out."""
    expected = "rows of at least two numbers were expected"
    last = _last(lines)
    if len(re.findall(r'"[+-]?\d+,\d+"', last)) > 1:
        what = "has commas both between its cells and in its numbers"
        return what, expected, "write it with `;` between the cells, or with decimal points"
    if _named_cells(lines):
        what = "names each number in each row"
        return what, expected, "write the names once, in a header, and only numbers below it"
    return "is no table that kemba recognises", expected, ""


def _named_cells(lines: Sequence[str]) -> bool:
    """Whether each row says what its numbers are: `x: 0.1, y: 2`."""
    return len(re.findall(r"(?:^|[\s,;])[^\W\d]\w* *[:=] *[+-]?[\d.]", _last(lines))) > 1


def _last(lines: Sequence[str]) -> str:
    return next((line for line in reversed(lines) if line.strip()), "")


def units_below(path: Path, layout: Layout) -> list[str]:
    """The cells of the row below the header, if it is no data: often the columns' units."""
    if not layout.get("skip_below"):
        return []
    below = _lines(path)[layout.get("skip_rows", 0) + int(layout.get("header", 1)) :]
    lines = [line for line in below if line.strip()][: layout["skip_below"]]
    rows = [
        [cell.strip("[]() ") for cell in cells_of(line, layout.get("separator", ","))]
        for line in lines
    ]
    return max(rows, key=lambda row: sum(is_unit(spelt(cell)) for cell in row), default=[])


def _lines(path: Path) -> list[str]:
    return [line.rstrip("\n") for _, line in islice(lines_of(path), LINES)]


def _numbers(lines: list[str], separator: str, decimal: str) -> tuple[int, int, int]:
    """How many numbers the rows of the table hold, its first line, and its columns."""
    rows = []
    for number, line in enumerate(lines):
        if line.strip():
            cells = cells_of(line, separator)
            rows.append((number, len(cells), _count(cells, decimal)))
    numeric = [(number, width, count) for number, width, count in rows if count >= 2]
    if not numeric:  # of a long table: a date, the name of a channel and its reading
        long = [row for row in rows if row[1] >= 3 and row[2] == 1]
        numeric = long if len(long) > 0.5 * len(rows) else []
    if not numeric:
        return 0, 0, 0
    width = Counter(width for _, width, _ in numeric).most_common(1)[0][0]
    table = [(number, count) for number, other, count in numeric if other == width]
    return sum(count for _, count in table), table[0][0], width


def _count(cells: Iterable[str], decimal: str) -> int:
    return sum(bool(NUMBER[decimal].fullmatch(cell)) for cell in cells)


def _header(above: list[str], separator: str, width: int) -> tuple[int, int]:
    """The line that names the columns, and how many rows it has; 0 of a table without header.

    Of the lines above the numbers that are as wide: the one of most different names, the first of
    equal ones; with the lines above it where names repeat and these tell them apart.
    """
    rows = {i: cells_of(line, separator) for i, line in enumerate(above) if line.strip()}
    wide = [
        i
        for i, cells in rows.items()
        if (len(cells) == width or (len(cells) == width - 1 and all(cells)))
    ]
    if not wide:
        return 0, 0
    best = max(wide, key=lambda i: (_different(rows[i]), -i))
    marked = {i for i in wide if above[i].lstrip().startswith(COMMENT)}
    for first in reversed([i for i in wide if i < best and i not in marked]):
        together = joined([rows[i] for i in wide if first <= i <= best])
        if _different(together) > _different(rows[best]) and best - first < len(wide):
            return first, best - first + 1
    return best, 1


def _different(cells: Sequence[str]) -> int:
    return len({cell for cell in cells if cell})


@dataclass(frozen=True)
class Draft:
    """A drafted map: its `layout`, its `columns`, and what is `missing` or `ignored`; `questions`
    that names and values leave open, and `notes` on what was decided and why."""

    kind: str
    layout: Layout
    columns: dict[str, dict[str, Any]]
    missing: tuple[str, ...]
    ignored: tuple[str, ...]
    questions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def text(self, name: str) -> str:
        """The map as YAML, with what is missing as comments."""
        head = {"kind": self.kind, **self.layout}
        lines = [f"# Column map for {name}, drafted from its names, units and values: check it."]
        lines += ["# Signs, and where an angle is zero, cannot be seen in a table."]
        lines += [f"# {_line(note)}" for note in self.notes]
        lines += [f"# Open: {_line(question)}" for question in self.questions]
        lines += ["", *(f"{key}: {json.dumps(value)}" for key, value in head.items())]
        lines += ["columns:"]
        for header, source in self.columns.items():
            inner = ", ".join(f"{k}: {_flow(v)}" for k, v in source.items())
            lines.append(f"  {header}: {{{inner}}}")
        lines += [f"  # {header}: {{source: ...}}  # needed, not found" for header in self.missing]
        if self.ignored:
            lines += ["", f"# Ignored: {_line(', '.join(self.ignored))}"]
        return "\n".join(lines) + "\n"


def draft_map(
    path: Path,
    legs: Sequence[str],
    stroke: float | None = None,
    rig: str = "",
    logged: Mapping[str, str] | None = None,
) -> Draft:
    """A map for the log `path` of a robot with these `legs` and pistons of this `stroke` [m], or of
    a `rig` of this kind whose logs must have the columns `logged` (units by name).

    Raises KembaError where the file is no table or has no time.
    """
    text = path.suffix.lower() in TEXTS and not path.is_dir()
    check_read(path)
    if (text and not path.is_file()) or (path.is_dir() and not is_recorded(path)):
        raise no_log(path)
    layout = layout_of(path) if text else {}
    trial = ColumnMap.model_construct(**layout)
    raw = raw_columns(path, trial)
    if gone := no_readings(raw.columns, trial.decimal):
        layout["missing"] = gone
    labels = {} if trial.header else joint_state_labels(raw.columns)
    below = zip(raw.columns, units_below(path, layout), strict=False)
    stated = {name: spelt(text) for name, text in (*below, *raw.units.items()) if text}
    names = Names(legs, labels, stated, switches(raw.columns), tuple(raw.columns), raw.angles)
    values = numbers(raw.columns, trial.decimal, gone)
    stamp = stamp_of(raw.columns, values, names)
    if stamp is None:
        what, hint, row = no_time(raw.columns, values, trial.decimal)
        where = f"{path}:{line_of(path, trial, row)}" if text and row >= 0 else str(path)
        raise KembaError(where, what, "a time that rises was expected" * (row < 0), hint)
    rest = {n: v for n, v in values.items() if n not in {*stamp.names, *raw.clocks.values()}}
    rest, names, turned = quaternions(rest, names)
    names, said = upright(rest, names)
    kind, targets = _kind(names, rest, rig, logged or {})
    found = assigned(names, rest, targets)
    columns, asked = _sources(found, targets, names, rest, stroke, turned)
    said += _share_gauge(columns, found.pairs)
    said += _no_gauge(columns, found.pairs, names)
    number = {name: i for i, name in enumerate(raw.columns, start=1)}
    columns = {TIME: stamp.source, **columns}
    columns = {header: _by_number(source, number) for header, source in columns.items()}
    read = {*found.pairs.values(), *stamp.names, *(c for four in turned.values() for c in four)}
    missing = tuple(
        t.header for t in targets if t.needed and t.header not in {*found.pairs, *found.ties}
    )
    ties = [
        f"{header} may be {' or '.join(map(repr, names_))}" for header, names_ in found.ties.items()
    ]
    odd = [n for n in raw.columns if missing and n not in values and n not in stamp.names]
    told = {
        n: next((str(c) for c in raw.columns[n] if any(map(str.isdigit, str(c)))), "") for n in odd
    }
    said += [f"'{n}' holds no numbers, but '{text}'" for n, text in told.items() if text]
    unwrapped = [
        f"{h} begins anew after each turn: joined" for h, s in columns.items() if "unwrap" in s
    ]
    maps = shipped_maps(raw.columns)
    if gone:
        unwrapped.append(f"no reading where these stand: {', '.join(map(str, gone))}")
    fitting = [f"the shipped map '{name}' fits these columns: --map {name}" for name in maps]
    return Draft(
        kind,
        layout | ({"origin": "first"} if stamp.from_first else {}),
        columns,
        missing,
        tuple(name for name in raw.columns if name not in read),
        tuple(filter(None, [stamp.question, *ties, *asked])),
        (f"Time: {stamp.reason}.", *said, *raw.remarks, *unwrapped, *fitting),
    )


def _kind(
    names: Names, values: Mapping[str, Array], rig: str, logged: Mapping[str, str]
) -> tuple[str, list[Target]]:
    """What machine the columns are of, and the columns that such a log may have: those of the
    model's rig, if it is one."""
    if rig:
        return rig, rig_targets(logged)

    def says(group: str, *words: str) -> bool:
        return any(names.says(name).get(group, set()) & set(words) for name in values)

    upright = says("direction", "pitch") and says("direction", "x") and says("direction", "z")
    if says("part", "hip", "body", "foot") or upright:
        return "robot", robot_targets(names.legs)
    if says("part", "valve"):
        return "bench", bench_targets()
    if says("kind", "pressure"):
        return "cylinder", [target for target in bench_targets() if not target.is_valve]
    return "drive", drive_targets(rotary=says("kind", "torque"))


def _sources(
    found: Assigned,
    targets: Sequence[Target],
    names: Names,
    values: Mapping[str, Array],
    stroke: float | None,
    turned: Mapping[str, tuple[str, ...]],
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """The source of each of our columns, and what has to be asked about them."""
    measured = {h: n for h, n in found.pairs.items() if n not in turned}
    guessed, asked = guessed_units(names, measured, values, stroke)
    columns: dict[str, dict[str, Any]] = {}
    for target in targets:
        name = found.pairs.get(target.header)
        if name is None:
            continue
        unit = names.unit(name) or guessed.get(target.header)
        if name in turned:
            columns[target.header] = {"source": list(turned[name])}
        else:
            columns[target.header] = _source(target, name, unit, values[name], names.from_air(name))
        asked += _asked(target, name, names)
    _share_level(columns, found.pairs, values)
    return columns, asked


def _asked(target: Target, name: str, names: Names) -> list[str]:
    """What a person has to say about a column that was found."""
    found = []
    written = names.labels.get(name, name)
    stated = f"[{names.below[name]}]" if name in names.below else ""
    strange = strange_unit(written, names.legs) or strange_unit(stated, names.legs)
    if strange and names.unit(name) is None and not target.is_valve:
        found.append(f"{target.header}: '{name}' is in '{strange}', which is no unit that is known")
    if (factor := FACTOR.search(written + stated)) and not target.is_valve:
        asked = f"were the readings of '{name}' multiplied by {factor[0].strip('*x×· ')}?"
        found.append(f"{target.header}: {asked} Then give their unit and `scale`")
    if target.is_valve and NEGATED & {*words(names.bare(name))}:
        asked = f"is '{name}' 1 where nothing is asked for? Then `threshold: 0.5, sign: -1`"
        found.append(f"{target.header}: {asked}")
    if target.header.endswith("piston/x [m]") and names.unit(name) is None:
        said = set(words(names.bare(name)))
        if "knee" in said and not said & PISTONS:
            found.append(f"{target.header}: is '{name}' the piston's way, or the knee's angle?")
    if "desired" in names.says(name).get("role", ()) and not target.is_command:
        found.append(f"{target.header}: '{name}' is what was asked for; which column is measured?")
    return found


def _share_level(
    columns: dict[str, dict[str, Any]], pairs: Mapping[str, str], values: Mapping[str, Array]
) -> None:
    """A valve that never switches in this log has the threshold of the others."""
    level = next(({"threshold": s["threshold"]} for s in columns.values() if "threshold" in s), {})
    for header, name in pairs.items():
        if "valve/" in header and np.nanmax(values[name]) == np.nanmin(values[name]):
            columns[header] |= level


def _share_gauge(columns: dict[str, dict[str, Any]], pairs: Mapping[str, str]) -> list[str]:
    """All pressures count from the atmosphere where one of them falls to zero; what is said of the
    others."""
    pressures = [header for header in columns if header.endswith("[Pa]")]
    gauge = [header for header in pressures if "offset" in columns[header]]
    rest = [header for header in pressures if header not in gauge]
    if not gauge or not rest:
        return []
    for header in rest:
        columns[header]["offset"] = matching.ATMOSPHERE
    listed = ", ".join(f"'{pairs[header]}'" for header in rest)
    return [f"Pressures: {listed}: from the atmosphere, as '{pairs[gauge[0]]}', which falls to it"]


def _no_gauge(
    columns: dict[str, dict[str, Any]], pairs: Mapping[str, str], names: Names
) -> list[str]:
    """What is said of pressures of which neither name nor size tells where they count from."""
    open_ = [
        f"'{pairs[header]}'"
        for header, source in columns.items()
        if header.endswith("[Pa]")
        and "offset" not in source
        and names.from_air(pairs[header]) is None
    ]
    if not open_:
        return []
    return [
        f"Pressures: {', '.join(open_)}: taken as absolute; where they count from that of the air, "
        f"add `offset: {matching.ATMOSPHERE}`"
    ]


def _source(
    target: Target, name: str, unit: str | None, values: Array, air: bool | None
) -> dict[str, Any]:
    source: dict[str, Any] = {"source": name}
    if target.is_valve:
        level = matching.valve_level(values)
        return source if level is None else {**source, "threshold": level}
    if unit and unit != target.unit:
        source["unit"] = unit
    if target.unit == "rad" and wraps(matching.in_ours(values, unit, "rad")):
        source["unwrap"] = True
    return source | (matching.gauge(values, unit, air) if target.unit == "Pa" else {})


def _by_number(source: dict[str, Any], number: Mapping[str, int]) -> dict[str, Any]:
    """A column that has no name of its own is given by its number."""
    name = source["source"]
    twice = any(re.fullmatch(rf"{re.escape(str(name))}#\d+", other) for other in number)
    if isinstance(name, str) and (name.isdigit() or twice or re.search(r"#\d+$", name)):
        return {**source, "source": number.get(name, name)}
    return source


def _line(text: str) -> str:
    """A text that stays one line of a comment, whatever a name has in it."""
    return " ".join(text.split())


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {_flow(v)}" for k, v in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)
