"""From an answer to a model: the base, and the effects that were found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from kemba.config import dump_yaml, parse
from kemba.effects import BY_KIND
from kemba.errors import KembaError, suggest
from kemba.identify.answer import read_answer
from kemba.identify.problem.candidates import where_field
from kemba.identify.problem.structure import ORIFICE, orifice_item
from kemba.model.spec import ModelSpec, load_spec


def write_model(
    path: Path, base: str, ranking: Iterable[Mapping[str, Any]], effects: Iterable[str]
) -> Path:
    """A model YAML at `path`: `base` with these effects of the ranking. Checked by loading it."""
    wanted = list(effects)
    rows = {row["effect"]: row for row in ranking}
    listed = [item(name, rows[name]["parameters"]) for name in wanted]
    data = {
        "name": f"{Path(base).stem}_{'_'.join(w.split(':')[0] for w in wanted)}"[:60],
        "base": reference(base),
        **({"chambers": "orifice"} if ORIFICE in wanted else {}),
        "effects": listed,
        "notes": "found by kemba-opt discover",
    }
    parse(data, ModelSpec)
    dump_yaml(data, path)
    load_spec(path)
    return path


def item(name: str, parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """One effect of a model's list from its row of the ranking.

    Raises KembaError for an effect that the catalogue lacks.
    """
    kind, _, place = name.partition(":")
    values = {p: float(f"{v['value']:.6g}") for p, v in parameters.items()}
    if name == ORIFICE:
        return orifice_item(values)
    if kind not in BY_KIND:
        raise KembaError(name, "is no effect of the catalogue", hint=suggest(kind, BY_KIND))
    where = {where_field(kind): place} if place else {}
    return {"kind": kind, **where, **values}


def reference(base: str) -> str:
    """How a model elsewhere names its base: shipped models by name, own ones by their path."""
    if not Path(base).is_file():
        return base
    return str(Path(base).resolve())


def adopt_effect(folder: str | Path, effect: str, out: Path) -> Path:
    """The model of another row of an answer's ranking. Raises KembaError."""
    file = Path(folder) / "answer.json"
    answer = read_answer(folder)
    names = [row["effect"] for row in answer["ranking"]]
    if effect not in names:
        raise KembaError(
            str(file), f"'{effect}' is not in the ranking", hint=suggest(effect, names)
        )
    # what was found beside another structure has a meaning beside that structure only
    structure = [name for name in answer["added"] if name == ORIFICE and name != effect]
    base = str(answer.get("base") or "planning")
    return write_model(out, base, answer["ranking"], [*structure, effect])
