"""Which effects an answer leaves in doubt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kemba.errors import KembaError
from kemba.identify.design.settings import ExperimentSettings

Values = dict[str, float]


@dataclass(frozen=True)
class Rivals:
    """Effects of which one is there: name -> its parameters, the likeliest first.

    `shared`: parameters of the effects that are there whichever of them it is.
    """

    effects: Mapping[str, Values]
    shared: Mapping[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """The rivals, the likeliest first."""
        return tuple(self.effects)

    def theta(self, name: str) -> Values:
        """Everything that is there if it is this one."""
        return {**self.shared, **self.effects[name]}


def contenders(answer: Mapping[str, Any]) -> Rivals:
    """The effect of an answer that is least sure to be that one, and what else it could be.

    That is the first one that has equivalents, else the first one. Effects that the answer holds
    beside it are taken to be there. Raises KembaError where the answer ranks no effect.
    """
    rows = {row["effect"]: row for row in answer["ranking"]}
    if not rows:
        raise KembaError("answer.json", "has no ranking", "nothing is left to be separated")
    doubtful = [name for name, row in rows.items() if row["equivalent_to"]]
    first = [*doubtful, *rows][0]
    beside = set(answer.get("added", ())) - {first}
    likely = [name for name in rows if name not in beside]
    order = dict.fromkeys([first, *rows[first]["equivalent_to"], *likely])
    chosen = [name for name in order if name in rows][: ExperimentSettings.rivals]
    shared = {k: v for e in beside - set(chosen) if e in rows for k, v in _values(rows[e]).items()}
    return Rivals({name: _values(rows[name]) for name in chosen}, shared)


def _values(row: Mapping[str, Any]) -> Values:
    """Parameters of a row of the ranking, by their names in theta."""
    return {f"{row['effect']}.{p}": v["value"] for p, v in row["parameters"].items()}
