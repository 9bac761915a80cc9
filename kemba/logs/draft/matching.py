"""Which foreign column is which of ours: the assignment that agrees best with all names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.logs.draft.ranges import two_levels
from kemba.logs.draft.targets import Target
from kemba.logs.draft.words import Meaning, Names, named_unit, unknown
from kemba.quantity import convert
from kemba.trajectory import Array

# Scores of a name are shares of what it must say; the rest only breaks ties between columns.
NOTHING = -1.0  # of a name that says something else
ENOUGH = 0.6  # two of three words are enough, half not
SAID_TOO = 0.1  # for a name that also says what it may
UNRELATED = 0.3  # doubt by a word about something else, as the `a` of `valve_a`
ASKED_FOR = 0.3  # of what was desired or commanded where a measured column is wanted
STRANGER = 0.03  # for each word that says nothing, up to three
SURE = 0.02  # a change of the whole assignment that costs less is as good


@dataclass(frozen=True)
class Assigned:
    """Our header -> foreign column, and headers for which several fit as well."""

    pairs: dict[str, str]
    ties: dict[str, tuple[str, ...]]


def assigned(names: Names, values: Mapping[str, Array], targets: Sequence[Target]) -> Assigned:
    """The assignment of the largest sum of scores; each column is used once.

    Columns with a unit of another dimension are no candidates. A target whose best column can be
    exchanged for another, of other values, at no cost is a tie, and is not assigned.
    """
    columns = list(values)
    scores = np.full((len(targets), len(columns)), NOTHING)
    for j, name in enumerate(columns):
        strangers = min(unknown(named_unit(names.labels.get(name, name))[0], names.legs), 3)
        for i, target in enumerate(targets):
            unit = names.unit(name)
            if name in names.switches and not target.is_valve:
                continue
            if fits(target, unit, values[name]):
                score = agreement(by_unit(names.says(name), target, unit), target)
                scores[i, j] = score - STRANGER * strangers if score > NOTHING else NOTHING
    scores[scores < ENOUGH] = NOTHING
    total, best = _best(scores)
    pairs: dict[str, str] = {}
    ties: dict[str, tuple[str, ...]] = {}
    for i, j in best.items():
        without = scores.copy()
        without[i, j] = NOTHING
        other, changed = _best(without)
        k = changed.get(i)
        same = k is not None and np.array_equal(
            values[columns[j]], values[columns[k]], equal_nan=True
        )
        if k is not None and total - other < SURE and not same:
            ties[targets[i].header] = (columns[j], columns[k])
        else:
            pairs[targets[i].header] = columns[j]
    return Assigned(pairs, ties)


def _best(scores: np.ndarray[Any, Any]) -> tuple[float, dict[int, int]]:
    """The largest sum of scores, and the column (value) of each row (key) in it."""
    from scipy.optimize import linear_sum_assignment

    rows, chosen = linear_sum_assignment(np.maximum(scores, 0.0), maximize=True)
    pairs = zip(rows.tolist(), chosen.tolist(), strict=True)
    found = {i: j for i, j in pairs if scores[i, j] > 0}
    return float(sum(scores[i, j] for i, j in found.items())), found


def fits(target: Target, unit: str | None, values: Array) -> bool:
    """Whether a column's unit and values (n,) can be those of a target."""
    if target.is_valve:
        return two_levels(values)
    if unit is None:
        return True
    try:
        convert(1.0, unit, target.unit)
    except ValueError:
        return False
    return True


def by_unit(says: Meaning, target: Target, unit: str | None) -> Meaning:
    """What a name says where its `unit` is that of `target`: no other kind of quantity than the
    unit's, as by the `F` of `cyl_F [mm]`; this kind also where the name says of what it is. A
    length is no pitch, as by the `R` of `cyl_R [mm]`."""
    kind = target.means.get("kind") or target.may.get("kind")
    if unit is None or kind is None or target.is_valve or says.get("kind") == {"other"}:
        return says
    left = {group: found for group, found in says.items() if group != "kind"}
    if target.unit != "rad" and left.get("direction") == {"pitch"}:
        del left["direction"]
    part = target.means.get("part")
    turns = part == "hip" and target.unit == "rad" and "leg" in says and "direction" not in says
    if turns and "part" not in says:  # of a leg, the hip alone has an angle
        left["part"] = {"hip"}
    told = kind in says.get("kind", ()) or part is None or part in left.get("part", ())
    return {**left, "kind": {kind}} if told else left


def agreement(says: Meaning, target: Target) -> float:
    """How well a name fits a target: at most about 1, `NOTHING` where it says something else or
    leaves unsaid what it must say."""
    score = 0.0
    for group, wanted in target.means.items():
        if group not in says:
            if group == "kind" and wanted == "position" and len(target.means) > 1:
                continue
            return NOTHING
        if wanted not in says[group]:
            return NOTHING
        score += len(says[group]) ** -0.5
    score /= len(target.means)
    for group, found in says.items():
        if group in target.may:
            if target.may[group] not in found:
                return NOTHING
            score += SAID_TOO
        elif group not in target.means:
            score -= UNRELATED * (group in ("kind", "leg", "part"))
    if "desired" in says.get("role", ()) and not target.is_valve:
        score -= ASKED_FOR
    return score
