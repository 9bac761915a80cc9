"""From an answer to a model: the base, what was found at its joint estimate, and its evidence."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import dump_yaml, parse
from kemba.effects import BY_KIND
from kemba.errors import KembaError, enumerated, suggest
from kemba.identify.answer import read_answer
from kemba.identify.problem.candidates import ORIFICE, orifice_item, where_field
from kemba.model.evidence import EvidenceLog, write_covariance
from kemba.model.spec import ModelSpec, build_model, load_spec

COVARIANCE = "covariance.csv"


def write_model(
    path: Path, base: str, answer: Mapping[str, Any], effects: Iterable[str] | None = None
) -> Path:
    """A model YAML at `path`: `base` with what an answer.json has added, at its joint estimate, and
    its figures, covariance and evidence; or with these `effects` of its ranking alone. Checked by
    loading it."""
    rows, wanted = {row["effect"]: row for row in answer["ranking"]}, list(effects or ())
    if effects is None:
        wanted = list(answer["added"])
    else:
        answer = {}
    sure = answer.get("sure", ())
    support = {e: {"support": "sure" if e in sure else "likely"} for e in wanted if answer}
    listed = [item(name, rows[name]["parameters"]) | support.get(name, {}) for name in wanted]
    data = {
        "name": "_".join([Path(base).stem, *(w.split(":")[0] for w in wanted)])[:60],
        "base": reference(base),
        **({"chambers": "orifice"} if ORIFICE in wanted else {}),
        "effects": [*_refitted(base, answer.get("figures") or {}), *listed],
        **_evidence(path, answer),
        "notes": "found by kemba-opt discover",
    }
    parse(data, ModelSpec)
    dump_yaml(data, path)
    load_spec(path)
    return path


def _refitted(base: str, figures: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The effects of the base whose figures were fitted as well, as items of a model's list."""
    found = []
    for effect in build_model(load_spec(base)).effects if figures else ():
        own: dict[str, Any] = {}
        for name, value in figures.items():
            owner, _, figure = name.rpartition(".")
            if owner == effect.name:
                figure, _, entry = figure.partition("[")
                if entry:
                    table = list(own.get(figure, effect.value(figure)))
                    table[int(entry[:-1])] = value
                    value = table
                own[figure] = _short(value)
        if own:
            found.append(effect.bind(own).listed())
    return found


def _short(value: Any) -> Any:
    """A number, or those of a table, with six digits."""
    if isinstance(value, list | tuple):
        return tuple(_short(x) for x in value)
    return float(f"{value:.6g}")


def _evidence(path: Path, answer: Mapping[str, Any]) -> dict[str, Any]:
    """The key `evidence` of a model at `path`, its covariance written beside it."""
    evidence, covariance = answer.get("evidence"), answer.get("covariance")
    if not evidence:
        return {}
    found = {k: v for k, v in evidence.items() if k != "logs" and v not in (None, {})}
    found["logs"] = [
        EvidenceLog.of(log["file"], path.parent, log["use"]).model_dump()
        | {"sha256": log["sha256"]}
        for log in evidence["logs"]
    ]
    if covariance:
        name = COVARIANCE if path.stem == "model" else f"{path.stem}_{COVARIANCE}"
        write_covariance(path.parent / name, covariance["names"], np.array(covariance["matrix"]))
        found["covariance"] = name
    return {"evidence": found}


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


def adopted(folder: str | Path, only_sure: bool) -> str:
    """Why an answer gives no model, in words; empty where it gives one. Raises KembaError where
    there is no answer."""
    answer = read_answer(folder)
    if not answer.get("added"):
        fitted = answer.get("figures") or answer.get("machine")
        return "" if fitted else f"{folder} found nothing that a model could be written with"
    if only_sure and not answer.get("sure"):
        likely = enumerated(answer["added"])
        return f"{folder} is sure of no effect; likely are {likely}: adopt without --only-sure"
    return ""


def adopt_answer(folder: str | Path, out: Path, only_sure: bool = False) -> tuple[str, ...]:
    """Write the model of all that an answer found at its joint estimate; `only_sure`: without what
    is only likely. The effects that it has. Raises KembaError where there are none."""
    if nothing := adopted(folder, only_sure):
        raise KembaError(str(folder), nothing)
    answer = read_answer(folder)
    if only_sure:
        answer = _without(answer, [e for e in answer["added"] if e not in answer["sure"]])
    write_model(out, str(answer.get("base") or "planning"), answer)
    return tuple(answer["added"])


def _without(answer: Mapping[str, Any], dropped: list[str]) -> dict[str, Any]:
    """An answer without some of its effects: what the others are then, by its joint covariance."""
    found = {**answer, "added": [e for e in answer["added"] if e not in dropped]}
    joint = answer.get("covariance")
    if not dropped or not joint:
        return found
    names, c = list(joint["names"]), np.array(joint["matrix"])
    rows = {row["effect"]: row for row in answer["ranking"]}
    off = {f"{e}.{p}": value for e in dropped for p, value in BY_KIND[e.split(":")[0]].off.items()}
    gone = [i for i, name in enumerate(names) if name in off]
    kept = [i for i, name in enumerate(names) if name.rsplit(".", 1)[0] not in dropped]
    parts = [names[i].rpartition(".") for i in gone]
    step = [off[names[i]] - rows[effect]["parameters"][parameter]["value"]
            for i, (effect, _, parameter) in zip(gone, parts, strict=True)]  # fmt: skip
    gain = c[np.ix_(kept, gone)] @ np.linalg.pinv(c[np.ix_(gone, gone)])
    moved = dict(zip([names[i] for i in kept], gain @ np.array(step), strict=True))
    left = c[np.ix_(kept, kept)] - gain @ c[np.ix_(gone, kept)]
    found["ranking"] = [
        {**row, "parameters": {
            p: {**v, "value": v["value"] + float(moved.get(f"{row['effect']}.{p}", 0.0))}
            for p, v in row["parameters"].items()
        }}
        for row in answer["ranking"]
    ]  # fmt: skip
    found["figures"] = {
        n: v + float(moved[n]) if n in moved else v
        for n, v in (answer.get("figures") or {}).items()
    }
    matrix = (0.5 * (left + left.T)).tolist()
    found["covariance"] = {"names": [names[i] for i in kept], "matrix": matrix}
    evidence = answer.get("evidence") or {}
    found["evidence"] = {k: v for k, v in evidence.items() if k != "error_held_out"}
    return found


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
    return write_model(out, base, answer, [*structure, effect])
