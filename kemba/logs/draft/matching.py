"""Which foreign column is which of ours: the assignment that agrees best with all names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kemba.logs.draft.ranges import two_levels
from kemba.logs.draft.targets import Target
from kemba.logs.draft.words import Meaning, Names
from kemba.quantity import convert
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Array

NOTHING = -1.0  # of a name that says something else


class MatchingSettings(Settings):
    """How far the words of a foreign name must agree with one of our columns."""

    enough: float = setting(
        0.6,
        "1",
        "share of what a name must say",
        "derived: two of three words are enough, half not",
    )
    said_too: float = setting(
        0.1, "1", "preference for a name that also says what it may", "convention: breaks ties only"
    )
    unrelated: float = setting(
        0.3, "1", "doubt by a word about something else, as the `a` of `valve_a`", CHOSEN
    )


def assigned(
    names: Names, values: Mapping[str, Array], targets: Sequence[Target]
) -> dict[str, str]:
    """Our header -> name of the foreign column.

    Each column is used once. Columns with a unit of another dimension are no candidates.
    """
    from scipy.optimize import linear_sum_assignment

    columns = list(values)
    scores = np.full((len(targets), len(columns)), NOTHING)
    for j, name in enumerate(columns):
        for i, target in enumerate(targets):
            unit = names.unit(name)
            if name in names.switches and not target.is_valve:
                continue
            if fits(target, unit, values[name]):
                scores[i, j] = agreement(by_unit(names.says(name), target, unit), target)
    rows, chosen = linear_sum_assignment(scores, maximize=True)
    pairs = zip(rows.tolist(), chosen.tolist(), strict=True)
    return {
        targets[i].header: columns[j]
        for i, j in pairs
        if scores[i, j] >= MatchingSettings.current().enough
    }


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
    if unit is None or kind is None or target.is_valve:
        return says
    left = {group: found for group, found in says.items() if group != "kind"}
    if target.unit != "rad" and left.get("direction") == {"pitch"}:
        del left["direction"]
    part = target.means.get("part")
    told = kind in says.get("kind", ()) or part is None or part in says.get("part", ())
    return {**left, "kind": {kind}} if told else left


def agreement(says: Meaning, target: Target) -> float:
    """How well a name fits a target: at most about 1, `NOTHING` where it says something else."""
    score, limits = 0.0, MatchingSettings.current()
    for group, wanted in target.means.items():
        if group in says and wanted not in says[group]:
            return NOTHING
        score += len(says[group]) ** -0.5 if group in says else 0.0
    score /= len(target.means)
    for group, found in says.items():
        if group in target.may:
            if target.may[group] not in found:
                return NOTHING
            score += limits.said_too
        elif group not in target.means:
            score -= limits.unrelated * (group in ("kind", "leg", "part"))
    return score
