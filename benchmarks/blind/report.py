"""Scores of a blind study: what was right, what was claimed wrongly, and how surely."""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from blind.comparison import comparison
from blind.kinds import SHAPES, Record, hidden, kind, likely, named
from kemba.files import atomic_text
from kemba.scenarios.share import wilson

SURE = 0.95
FALLS = 5.0  # times that the error beyond the noise has to fall where several effects are hidden


def read(path: Path) -> list[Record]:
    """Records so far."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


def append(path: Path, record: Record) -> None:
    """One more record; NumPy numbers become plain."""
    with path.open("a", encoding="utf-8") as stream:
        stream.write(_line(record))


def rewrite(path: Path, records: Iterable[Record]) -> None:
    """All records anew, in the place of those in the file."""
    with atomic_text(path) as stream:
        stream.writelines(map(_line, records))


def _line(record: Record) -> str:
    plain = json.dumps(record, default=lambda o: o.tolist() if hasattr(o, "tolist") else str(o))
    return plain + "\n"


def in_class(record: Record) -> bool:
    """Whether every hidden effect is named, or is one that a named one cannot be told from."""
    rows = [r for r in record["answer"]["ranking"] if r["effect"] in named(record)]
    known = {name for r in rows for name in (r["effect"], *r["equivalent_to"])}
    return bool(rows) and set(hidden(record)) <= known


def right(record: Record) -> bool:
    """Whether exactly the hidden effects are named; nothing, where nothing is hidden."""
    if not hidden(record):
        return bool(record["answer"]["verdict"] == "nothing")
    return set(named(record)) == set(hidden(record))


def among_first(record: Record, count: int) -> bool:
    """Whether something was found missing and a hidden effect is among the first so many."""
    first = [r["effect"] for r in record["answer"]["ranking"][:count]]
    found = record["answer"]["verdict"] in ("missing", "partly")
    return found and bool(set(first) & set(hidden(record)))


def sure_and_wrong(record: Record) -> bool:
    """Whether an effect that is not hidden was named with 95 % or more and no alternative."""
    rows = {r["effect"]: r for r in record["answer"]["ranking"]}
    return any(
        rows[e]["probability"] >= SURE
        and e not in hidden(record)
        and not set(rows[e]["equivalent_to"]) & set(hidden(record))
        for e in named(record)
    )


def overlooked(record: Record) -> bool:
    """Whether nothing was found of an effect larger than the size that the answer says it sees."""
    if record["answer"]["verdict"] != "nothing":
        return False
    (effect,) = record["truth"]
    return detectable(record, effect)


def detectable(record: Record, effect: Record) -> bool:
    """Whether a hidden effect is larger than the size of it that the answer says it sees."""
    lead, true = next(iter(effect["parameters"].items()))
    least = record["answer"]["smallest_detectable"].get(effect["kind"], {}).get(lead, 0.0)
    return least is not None and bool(abs(true - _off(lead, true)) > least)


def _off(name: str, true: float) -> float:
    """The value at which a parameter changes nothing: factors are one."""
    return 1.0 if name in ("k", "mu") and 0.3 < true < 3 and abs(true - 1) < 0.7 else 0.0


def parameters(records: Iterable[Record]) -> tuple[list[float], list[bool]]:
    """Relative errors of leading parameters that were identified, and whether intervals cover."""
    errors, covered = [], []
    for record in records:
        for effect in record["truth"]:
            row = next(
                (r for r in record["answer"]["ranking"] if r["effect"] == effect["kind"]), None
            )
            if row is None or effect["kind"] not in named(record):
                continue
            for i, (name, true) in enumerate(effect["parameters"].items()):
                if name not in row["parameters"]:
                    continue
                value = row["parameters"][name]
                if i == 0:
                    size = max(abs(true - _off(name, true)), 1e-12)
                    errors.append(abs(value["value"] - true) / size)
                covered.append(value["low"] <= true <= value["high"])
    return errors, covered


def table(records: Sequence[Record]) -> str:
    """The whole report as Markdown."""
    groups = {
        name: [r for r in records if kind(r) == name]
        for name in ("single", "sensor", "shape", "pair", "many", "outside", "null")
    }
    known = [*groups["single"], *groups["sensor"]]
    seen = [r for r in known if detectable(r, r["truth"][0])]
    white = [r for r in known if not r["case"]["colour"]]
    coloured = [r for r in known if r["case"]["colour"]]
    errors, covered = parameters([*known, *groups["shape"], *groups["pair"], *groups["many"]])
    rows = [
        _row("right effect first", known, lambda r: among_first(r, 1)),
        _row("right effect first, physics", groups["single"], lambda r: among_first(r, 1)),
        _row("right effect first, sensors", groups["sensor"], lambda r: among_first(r, 1)),
        _row("right effect first, white noise", white, lambda r: among_first(r, 1)),
        _row("right effect first, other noise", coloured, lambda r: among_first(r, 1)),
        _row(
            "right effect first, where larger than the smallest size that the answer says it sees",
            seen,
            lambda r: among_first(r, 1),
        ),
        _row("right effect first or second", known, lambda r: among_first(r, 2)),
        _row("exactly the right effect named", known, right),
        _row("in the named class, physics and sensors", known, in_class),
        _row(
            "overlooked: larger than the smallest size that the answer says it sees",
            known,
            overlooked,
        ),
        *_shapes(groups["shape"]),
        *_many(groups["many"]),
        _row("both effects of a pair", groups["pair"], right),
        _row(
            "at least one of a pair, none wrong",
            groups["pair"],
            lambda r: bool(named(r)) and set(named(r)) <= set(hidden(r)),
        ),
        _row(
            "outside the catalogue: nothing sure and wrong",
            groups["outside"],
            lambda r: not sure_and_wrong(r),
        ),
        _row(
            "outside the catalogue: flagged unknown",
            groups["outside"],
            lambda r: r["answer"]["verdict"] == "unknown",
        ),
        _row(
            "false alarms on nulls", groups["null"], lambda r: r["answer"]["verdict"] != "nothing"
        ),
        _row("sure and wrong, all cases", records, sure_and_wrong),
        _share("95 % intervals that cover", sum(covered), len(covered)),
        f"| median parameter error | {100 * _median(errors):.1f} % | {len(errors)} |",
        _row(
            "error falls 3 x or to 1.3 x noise, where right", [r for r in known if right(r)], _falls
        ),
        f"| median CPU seconds of discover | {_median([r['seconds'] for r in records]):.0f} "
        f"| {len(records)} |",
    ]
    head = ["| | share (95 % Wilson) | of |", "|---|---|---|"]
    shown = [row for row in rows if not row.endswith(("| none | 0 |", "nan % | 0 |"))]
    others = comparison(records)
    return "\n".join([*head, *shown, "", *others, *([""] if others else []), *misses(records)])


def _shapes(records: Sequence[Record]) -> list[str]:
    """Rows about lengths, lever and split, where there are such cases."""
    if not records:
        return []

    def as_shape(record: Record) -> bool:
        return any(name.split(":")[0] in SHAPES for name in named(record))

    lengths = [r for r in records if hidden(r)[0].startswith("geometry:") and right(r)]
    shown = [r for r in records if hidden(r) != ["geometry:piston/mount"]]
    return [
        _row("geometry and assembly: named as such", records, as_shape),
        _row(
            "the same where larger than the smallest size that the answer says it sees",
            [r for r in records if detectable(r, r["truth"][0])],
            as_shape,
        ),
        _row("geometry and assembly: exactly the right one", records, right),
        _row("geometry and assembly: in the named class", records, in_class),
        _row("the same without the mount, which hardly shows", shown, in_class),
        _row("of the lengths named: within 1 mm", lengths, lambda r: _length_error(r) < 1e-3),
    ]


def _length_error(record: Record) -> float:
    (effect,) = record["truth"]
    row = next(r for r in record["answer"]["ranking"] if r["effect"] == effect["kind"])
    return float(abs(row["parameters"]["d"]["value"] - effect["parameters"]["d"]))


def _many(records: Sequence[Record]) -> list[str]:
    """Rows about three to five effects at once, where there are such cases."""
    if not records:
        return []
    pairs = [(r, effect) for r in records for effect in r["truth"]]
    start = "three to five at once: "
    rows = []
    for label, names in (("named", named), ("named, likely ones included", likely)):
        hits = [(e["kind"] in names(r), detectable(r, e)) for r, e in pairs]
        large = [hit for hit, seen in hits if seen]
        wrong = [(r, name) for r in records for name in names(r) if name not in hidden(r)]
        count, far = sum(len(names(r)) for r in records), [not _like_hidden(*w) for w in wrong]
        rows += [
            _share(f"{start}hidden effects {label}", sum(hit for hit, _ in hits), len(hits)),
            _share(f"{start}those above their detectable size {label}", sum(large), len(large)),
            _share(f"{start}of those {label}: wrong", len(wrong), count),
            _share(f"{start}of those {label}: wrong, no hidden one like it", sum(far), count),
        ]
    return [*rows, _row(f"{start}error beyond the noise falls 5 x", records, _excess_falls)]


def _like_hidden(record: Record, name: str) -> bool:
    """Whether the answer says that it cannot tell this effect from a hidden one."""
    rows = [r for r in record["answer"]["ranking"] if r["effect"] == name]
    return any(set(r["equivalent_to"]) & set(hidden(record)) for r in rows)


def _excess_falls(record: Record) -> bool:
    answer = record["answer"]
    return bool(answer["excess_before"] >= FALLS * answer["excess_after"])


def write(page: Path, name: str, text: str) -> None:
    """Replace the generated section `name` of a page."""
    old = page.read_text(encoding="utf-8")
    begin = old.index("-->", old.index(f"<!-- {name}:")) + 3
    end = old.index(f"<!-- end of {name} -->")
    page.write_text(f"{old[:begin]}\n{text}\n{old[end:]}", encoding="utf-8")


def misses(records: Iterable[Record]) -> list[str]:
    """Hidden and answered, by pair, most frequent first."""
    wrong = Counter(
        (" + ".join(hidden(r)) or "nothing", " + ".join(named(r)) or r["answer"]["verdict"])
        for r in records
        if not (right(r) or (kind(r) == "outside" and r["answer"]["verdict"] == "unknown"))
    )
    if not wrong:
        return ["No misses."]
    lines = ["| hidden | answered | times |", "|---|---|---|"]
    return lines + [f"| {a} | {b} | {n} |" for (a, b), n in wrong.most_common()]


def line(record: Record) -> str:
    """One case on one line."""
    answer = record["answer"]
    flagged = kind(record) == "outside" and answer["verdict"] == "unknown"
    mark = "ok " if right(record) or flagged else "cls" if in_class(record) else "-- "
    said = " + ".join(named(record)) or answer["verdict"]
    return (
        f"{mark} {' + '.join(hidden(record)) or 'nothing':32s} -> {said:40s} "
        f"p {answer['p_value_nothing']:.3f} error {answer['error_before']:.2f} -> "
        f"{answer['error_after']:.2f}  {record['seconds']:.0f} s"
    )


def _falls(record: Record) -> bool:
    before, after = record["answer"]["error_before"], record["answer"]["error_after"]
    return bool(after <= 1.3 or before / after >= 3.0)


def _row(label: str, records: Sequence[Record], test: Any) -> str:
    return _share(label, sum(bool(test(r)) for r in records), len(records))


def _share(label: str, hits: int, count: int) -> str:
    if not count:
        return f"| {label} | none | 0 |"
    low, high = (100 * end for end in wilson(hits, count))
    return f"| {label} | {100 * hits / count:.0f} % ({low:.0f} to {high:.0f}) | {count} |"


def _median(values: Sequence[float]) -> float:
    ordered = sorted(values)
    return ordered[len(ordered) // 2] if ordered else float("nan")
