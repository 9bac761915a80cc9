"""A pattern in what an answer leaves is a reason to doubt it, unless it is negligible or chance."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.identify.compare.force_profiles import ForceProfile
from kemba.identify.infer import verdict
from kemba.identify.infer.selection import Selection


def left(monkeypatch: pytest.MonkeyPatch, gain: float, force: float, error: float = 1.2) -> str:
    """The pattern that is told of a missing `force` [N] on rods whose usual one is 10 N."""
    values = force * np.array([-1.0, 1.0])
    profile = ForceProfile(
        "rods", "N", "speed [m/s]", np.zeros(2), values, np.full(2, 1e-3), gain, 10.0
    )
    monkeypatch.setattr(verdict, "force_profiles", lambda problem, residual: [profile])
    fit = SimpleNamespace(theta={})
    found = SimpleNamespace(fitted_error=error, log_evidence=100.0, fit=fit)
    search = SimpleNamespace(
        points={("seal_friction",): found, (): SimpleNamespace(log_evidence=0.0)},
        problem=SimpleNamespace(residual=lambda theta: np.zeros(4)),
    )
    return verdict.pattern_left(search, ("seal_friction",))  # type: ignore[arg-type]


def test_a_force_that_goes_with_speed_is_a_pattern(monkeypatch: pytest.MonkeyPatch) -> None:
    assert left(monkeypatch, 200.0, 4.0).startswith("a force on the rods is missing")


def test_a_negligible_force_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """As 0.16 N beside a gas spring that was found right."""
    assert not left(monkeypatch, 200.0, 0.16)


def test_gains_count_by_the_scatter_that_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    assert left(monkeypatch, 90.0, 4.0, error=1.2)
    assert not left(monkeypatch, 90.0, 4.0, error=1.3)


@pytest.mark.parametrize(
    ("repeats", "error", "said"),
    [
        (3.0, (2.42, 1.66), "unknown"),
        (0.02, (2.42, 1.66), "partly"),
        (3.0, (2.6, 1.52), "partly"),
        (3.0, (1.7, 1.46), "partly"),
    ],
)
def test_half_is_asked_where_much_is_left_that_repeats_itself(
    monkeypatch: pytest.MonkeyPatch, repeats: float, error: tuple[float, float], said: str
) -> None:
    """The effect explains 40 %, 52 % or 23 % of the excess, and a pattern is left: of 5.9 that
    repeats itself half, or hardly anything."""
    best = ("both_mode_loss",)
    errors = dict(zip(((), best), error, strict=True))
    structure = {(): (7.0, 5.9), best: (1.0, repeats)}
    monkeypatch.setattr(verdict, "_structured", lambda search, hypothesis: structure[hypothesis])
    monkeypatch.setattr(verdict, "unfinished", lambda search, best: False)
    monkeypatch.setattr(verdict, "pattern_left", lambda search, best: "a force after extend")
    monkeypatch.setattr(verdict, "error", lambda search, hypothesis, kept: errors[hypothesis])
    caveats = verdict.caveats_of(SimpleNamespace(), Selection(best), None)  # type: ignore[arg-type]
    assert verdict.verdict_on(best, None, caveats) == said


@pytest.mark.parametrize(("after", "said"), [(0.996, "partly"), (0.994, "missing")])
def test_what_leaves_the_quoted_error_as_it_was_is_not_sure(
    after: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However significant: a force sensor 1.8 % off was missing, "1.00 and is 1.00"."""
    best, errors = ("kick",), {(): 1.004, ("kick",): after}
    monkeypatch.setattr(verdict, "unfinished", lambda search, best: False)
    monkeypatch.setattr(verdict, "pattern_left", lambda search, best: "")
    monkeypatch.setattr(verdict, "error", lambda search, hypothesis, kept: errors[hypothesis])
    search: Any = SimpleNamespace(late=False)
    caveats = verdict.caveats_of(search, Selection(best), None)
    assert verdict.verdict_on(best, None, caveats) == said
    assert caveats.unsure == (best if said == "partly" else ())


@pytest.mark.parametrize(("left", "said"), [(1.7, "nothing"), (2.9, "unknown")])
def test_an_error_far_beyond_the_noise_is_something(
    left: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if no single effect gains more than chance gives: nothing was missing, at 6.61 times the
    noise, where a rise time was wrong beside orifices."""
    monkeypatch.setattr(verdict, "unfinished", lambda search, best: False)
    monkeypatch.setattr(verdict, "pattern_left", lambda search, best: "")
    monkeypatch.setattr(verdict, "error", lambda search, hypothesis, kept: left)
    search: Any = SimpleNamespace(late=False)
    caveats = verdict.caveats_of(search, Selection(p_value=0.8), None)
    assert verdict.verdict_on((), None, caveats) == said
