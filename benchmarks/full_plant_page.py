"""The table of benchmarks/full_plant.py: what was found in logs of the full plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.identify.problem.structure import ORIFICE
from kemba.model import Model, load_model

Record = Mapping[str, Any]
WHOLE = 1.5  # times the noise that an answer may leave
UNITS = {"m2": ("mm2", 1e6), "m3": ("mL", 1e6)}


def page(records: Sequence[Record], names: Mapping[int, Sequence[str]]) -> str:
    """The table as Markdown; `names`: of each set the plans, the last two not learnt from."""
    within = sum(r["answer"]["error_after"] <= WHOLE for r in records)
    lines = [
        f"{len(records)} of {len(names)} sets have run; {within} answers leave {WHOLE:g} times the "
        "noise or less.",
        "",
        "| learnt from | verdict | error before | after | compare: planning model "
        "| the plant's own | the model found | CPU s |",
        "|---|---|---|---|---|---|---|---|",
        *(_row(r, names[r["set"]]) for r in records),
        "",
        "| figure | truth | " + " | ".join(f"set {r['set'] + 1}" for r in records) + " |",
        "|---|---|" + "---|" * len(records),
        *_figures(records),
    ]
    return "\n".join(lines)


def _row(record: Record, names: Sequence[str]) -> str:
    answer, compared = record["answer"], record["compare"]
    said = [f"{compared[k]:.2f}" if k in compared else "-" for k in ("planning", "plant", "found")]
    cells = [
        ", ".join(names[:-2]),
        answer["verdict"],
        f"{answer['error_before']:.2f}",
        f"{answer['error_after']:.2f}",
        *said,
        f"{record['seconds']:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def _figures(records: Sequence[Record]) -> list[str]:
    """One row per figure that any answer names: its true value, then values with intervals."""
    found = [_named(record) for record in records]
    keys = sorted({key for values in found for key in values}, key=lambda k: (k[0] != ORIFICE, k))
    plant = load_model("plant")
    lines = []
    for effect, name in keys:
        cells = [values.get((effect, name), "not named") for values in found]
        lines.append(f"| `{effect}` {name} | {_truth(plant, effect, name)} | {' | '.join(cells)} |")
    return lines


def _named(record: Record) -> dict[tuple[str, str], str]:
    answer = record["answer"]
    return {
        (row["effect"], name): f"{_shown(v['value'], v['unit'])} ({_shown(v['low'], v['unit'])} to "
        f"{_shown(v['high'], v['unit'])}) {_unit(v['unit'])}".rstrip()
        for row in answer["ranking"]
        if row["effect"] in answer["found"]
        for name, v in row["parameters"].items()
    }


def _shown(value: float, unit: str) -> str:
    return f"{value * UNITS.get(unit, ('', 1.0))[1]:.3g}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else UNITS.get(unit, (unit, 1.0))[0]


def _truth(plant: Model, effect: str, name: str) -> str:
    """The plant's own figure; `level` is the pressure at its valves over the usual one."""
    kind = "orifice_chamber" if effect == ORIFICE else effect
    known = {e.name: e for e in plant.effects}
    if kind not in known:
        return "not in the plant"
    if name == "level":
        return f"{known[kind].gauge[1] / OrificeChamber().gauge[1]:.3g}"  # type: ignore[attr-defined]
    units = known[kind].parameters()
    unit = units[name].unit if name in units else "1"
    return f"{_shown(float(known[kind].value(name)), unit)} {_unit(unit)}".rstrip()
