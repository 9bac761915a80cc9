"""Kemba and other methods on the same cases, counted alike."""

from collections.abc import Callable, Sequence

from blind.kinds import Record, hidden, kind, named
from kemba.scenarios.share import wilson

Names = Callable[[Record], list[str]]
HEAD = (
    "method",
    "one hidden: named first",
    "one hidden: it alone named",
    "nothing hidden: something named",
    "several hidden: of these named",
    "several hidden: of the named wrong",
)


def kemba(record: Record) -> list[str]:
    """Effects that `discover` names, the most important first."""
    ranked = [row["effect"] for row in record["answer"]["ranking"]]
    return sorted(named(record), key=lambda n: ranked.index(n) if n in ranked else len(ranked))


def comparison(records: Sequence[Record]) -> list[str]:
    """Lines of the table, of cases that all methods have answered; none where there are none."""
    asked = [record for record in records if record.get("others")]
    methods = sorted({name for record in asked for name in record["others"]})
    both = [record for record in asked if all(name in record["others"] for name in methods)]
    if not both:
        return []
    rows = [("kemba", kemba), *((name, _answers(name)) for name in methods)]
    return [
        f"Other methods, on the {len(both)} cases that they have been asked about:",
        "",
        "| " + " | ".join(HEAD) + " |",
        "|" + "---|" * len(HEAD),
        *(f"| {name} | {' | '.join(_cells(both, names))} |" for name, names in rows),
    ]


def _answers(method: str) -> Names:
    return lambda record: list(record["others"][method])


def _cells(records: Sequence[Record], names: Names) -> list[str]:
    one = [r for r in records if kind(r) in ("single", "sensor", "shape")]
    nothing = [r for r in records if kind(r) == "null"]
    several = [r for r in records if kind(r) in ("pair", "many")]
    every = [(name, r) for r in several for name in names(r)]
    return [
        _share([names(r)[:1] == hidden(r) for r in one]),
        _share([names(r) == hidden(r) for r in one]),
        _share([bool(names(r)) for r in nothing]),
        _share([name in names(r) for r in several for name in hidden(r)]),
        _share([name not in hidden(r) for name, r in every]),
    ]


def _share(hits: Sequence[bool]) -> str:
    if not hits:
        return "-"
    low, high = wilson(sum(hits), len(hits))
    share = f"{100 * sum(hits) / len(hits):.0f} %"
    return f"{share} ({100 * low:.0f} to {100 * high:.0f}) of {len(hits)}"
