"""The table of benchmarks/full_plant.py: what was found in logs of the full plant."""

from collections.abc import Mapping, Sequence
from typing import Any

from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.identify.problem.candidates import ORIFICE
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
    found, plant = [_named(record) for record in records], load_model("plant")
    keys = sorted({key for values in found for key in values}, key=lambda k: (k[0] != ORIFICE, k))
    lines, covered, count = [], 0, 0
    for effect, name in keys:
        own = [values.get((effect, name)) for values in found]
        unit = next(v["unit"] for v in own if v)
        truth = _truth(plant, effect, name)
        known = [v for v in own if v and truth is not None]
        covered += sum(v["low"] <= truth <= v["high"] for v in known)
        count += len(known)
        cells = [_with_interval(v) if v else "not named" for v in own]
        said = "not in the plant" if truth is None else f"{_shown(truth, unit)} {_unit(unit)}"
        lines.append(f"| `{effect}` {name} | {said.rstrip()} | {' | '.join(cells)} |")
    return [*lines, "", f"{covered} of {count} intervals contain the plant's figure."]


def _named(record: Record) -> dict[tuple[str, str], Mapping[str, Any]]:
    """Every figure of the effects that an answer names, as its JSON has it."""
    answer = record["answer"]
    return {
        (row["effect"], name): value
        for row in answer["ranking"]
        if row["effect"] in answer["found"]
        for name, value in row["parameters"].items()
    }


def _with_interval(value: Mapping[str, Any]) -> str:
    centre, low, high = (_shown(value[k], value["unit"]) for k in ("value", "low", "high"))
    return f"{centre} ({low} to {high}) {_unit(value['unit'])}".rstrip()


def _shown(value: float, unit: str) -> str:
    return f"{value * UNITS.get(unit, ('', 1.0))[1]:.3g}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else UNITS.get(unit, (unit, 1.0))[0]


def _truth(plant: Model, effect: str, name: str) -> float | None:
    """The plant's own figure, None where it has none; `level` is the pressure at its valves over
    the usual one."""
    kind = "orifice_chamber" if effect == ORIFICE else effect
    own = {e.name: e for e in plant.effects}.get(kind)
    if own is None:
        return None
    if name == "level":
        return float(own.gauge[1] / OrificeChamber().gauge[1])  # type: ignore[attr-defined]
    return float(own.value(name))
