"""Which of the varied conditions matter to an executed plan: rank correlations."""

from __future__ import annotations

from typing import Any

import numpy as np

from kemba.settings import CHOSEN, Settings, setting
from kemba.sweep.cases.case import Case, Record
from kemba.units import read_si


class InfluenceSettings(Settings):
    """Which rank correlations are reported."""

    fewest: int = setting(
        5,
        "1",
        "cases below which a correlation says nothing",
        CHOSEN,
    )
    chance: float = setting(
        0.05, "1", "p-value above which it may be chance", "convention: the usual 5 %"
    )


def influence(rows: list[tuple[Case, Record | None]]) -> dict[str, Any]:
    """Spearman's rank correlations of each varied number with apex and landing.

    A condition that varies about zero may matter equally on both sides, which ranks cannot show;
    its size is added as `|start.body/pitch|`. `costs_most`: the condition with the strongest one,
    landing first, apex where all or none landed; None when each may be due to chance.
    """
    done = [(case, record) for case, record in rows if record and "apex_m" in record]
    landed = np.array([float(record["good"]) for _, record in done])
    apex = np.array([record["apex_m"] for _, record in done], dtype=float)
    ranks = {
        key: {"landing": rank(values, landed), "apex": rank(values, apex)}
        for key, values in with_sizes(numbers([case for case, _ in done])).items()
    }
    return {"ranks": ranks, "costs_most": costliest(ranks)}


def costliest(ranks: dict[str, dict[str, Any]]) -> str | None:
    """The condition that matters most."""
    for answer in ("landing", "apex"):
        told = {
            key: abs(found[answer]["correlation"])
            for key, found in ranks.items()
            if found[answer] and found[answer]["p_value"] < InfluenceSettings.current().chance
        }
        if told:
            return max(told, key=lambda key: told[key])
    return None


def rank(x: np.ndarray, y: np.ndarray) -> dict[str, float] | None:
    """Spearman's correlation of `x` (n,) and `y` (n,) and its p-value; None where either is
    constant."""
    from scipy.stats import spearmanr

    if len(x) < InfluenceSettings.current().fewest or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    found = spearmanr(x, y)
    return {"correlation": float(found.statistic), "p_value": float(found.pvalue)}


def with_sizes(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns, each (cases,), and `|key|` for those with numbers on both sides of zero."""
    both = {key: values for key, values in columns.items() if values.min() < 0.0 < values.max()}
    return columns | {f"|{key}|": np.abs(values) for key, values in both.items()}


def numbers(cases: list[Case]) -> dict[str, np.ndarray]:
    """By key the column (cases,) of what varies in all of the cases and is a number, in SI
    units."""
    columns = {}
    for key in cases[0].values if cases else ():
        try:
            values = [read_si(case.values[key])[0] for case in cases]
        except (KeyError, ValueError):
            continue
        if key != "seed":
            columns[key] = np.array(values)
    return columns
