"""Rows of the blind studies about three to five effects at once."""

from typing import Any

from blind.report import table

SIZES = {"seal_friction": ("F_c", 10.0), "payload": ("m", 0.3), "boom_inertia": ("m", 0.2)}


def record(named: tuple[str, ...], like: tuple[str, ...], left: float) -> dict[str, Any]:
    """Three hidden effects, of which the last is smaller than what can be seen; an answer with
    these `named`, each said to be `like` others, and this excess `left` of 2."""
    truth = [{"kind": kind, "parameters": {key: v}} for kind, (key, v) in SIZES.items()]
    seen = {kind: {key: 0.5 * v} for kind, (key, v) in SIZES.items()}
    seen["boom_inertia"] = {"m": 0.3}
    ranking = [
        {"effect": n, "probability": 0.7, "parameters": {}, "equivalent_to": like} for n in named
    ]
    answer = {"verdict": "missing", "added": named, "found": named, "ranking": ranking}
    answer |= {"smallest_detectable": seen, "excess_before": 2.0, "excess_after": left}
    answer |= {"error_before": 2.2, "error_after": 1.0}
    return {"truth": truth, "answer": answer, "seconds": 100.0}


def shares(*records: dict[str, Any]) -> dict[str, str]:
    """Share by label of the rows on several effects."""
    start = "| three to five at once: "
    rows = [r.split("|") for r in table(records).splitlines() if r.startswith(start)]
    return {row[1].split(": ", 1)[1].strip(): row[2].split(" %")[0].strip() for row in rows}


def test_effects_too_small_to_be_seen_are_counted_apart() -> None:
    found = shares(record(("payload", "seal_friction"), (), 0.3))
    assert found["hidden effects named"] == "67"
    assert found["those above their detectable size named"] == "100"
    assert found["of those named: wrong"] == "0"
    assert found["error beyond the noise falls 5 x"] == "100"


def test_a_wrong_name_counts_even_where_the_answer_says_what_it_is_like() -> None:
    names = ("boom_force", "payload", "seal_friction", "gas_spring")
    alike, apart = (record(names, like, 0.5) for like in (("boom_inertia",), ()))
    assert shares(alike)["of those named: wrong"] == "50" == shares(apart)["of those named: wrong"]
    assert shares(alike)["of those named: wrong, no hidden one like it"] == "0"
    assert shares(apart)["of those named: wrong, no hidden one like it"] == "50"
    assert shares(alike)["error beyond the noise falls 5 x"] == "0"
