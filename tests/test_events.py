"""Motions as events: synthetic bounds, flips and jumps, and what differs from them."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from kemba.events import (
    EXECUTED,
    LASTS,
    PLANNED,
    ContactCourse,
    EventComparison,
    Span,
    aligned,
    bend,
    bridged,
    compared,
    contacts,
    ends_standing,
    flights,
    peak,
    read,
    turned,
)
from kemba.trajectory import Trajectory

WEIGHT = 44.0  # N
Stances = dict[str, Sequence[tuple[float, float]]]

# two strides of a bound: rear and front stance in turn, flights between
BOUND: Stances = {
    "rear": [(-1.0, 0.1), (0.3, 0.4), (0.6, 0.7)],
    "front": [(0.15, 0.25), (0.45, 0.55)],
}
JUMP: Stances = {"rear": [(-1.0, 0.2), (0.5, 9.0)], "front": [(-1.0, 0.2), (0.5, 9.0)]}
DOUBLE: Stances = {
    "rear": [(-1.0, 0.1), (0.35, 0.5), (0.75, 9.0)],
    "front": [(-1.0, 0.1), (0.35, 0.5), (0.75, 9.0)],
}


def motion(
    stances: Stances, end: float = 0.8, turns: float = 0.0, ahead: float = 0.0, step: float = 1e-3
) -> Trajectory:
    """A body above feet that stand in `stances` [s]: in flight it rises and falls as thrown."""
    time = np.arange(round(end / step) + 1) * step
    air = np.ones(len(time), dtype=bool)
    columns: dict[str, np.ndarray] = {}
    for leg, spans in stances.items():
        down = np.any([(time >= a - 1e-9) & (time <= b + 1e-9) for a, b in spans], axis=0)
        columns[f"{leg}/foot/z [m]"] = np.where(down, 0.0, 0.03)
        columns[f"{leg}/foot/Fz [N]"] = np.where(down, WEIGHT, 0.0)
        air &= ~down
    z = np.full(len(time), 0.3)
    edges = np.flatnonzero(np.diff(air.astype(int), prepend=0, append=0)).reshape(-1, 2)
    for i, j in edges:
        since = time[i:j] - time[i]
        z[i:j] += 4.905 * since * (time[j - 1] - time[i] - since)
    columns |= {
        "body/x [m]": ahead * time / end,
        "body/z [m]": z,
        "body/pitch [rad]": 2 * np.pi * turns * np.clip((time - 0.2) / 0.3, 0.0, 1.0),
        "body/vx [m.s-1]": np.full(len(time), ahead / end),
        "body/vz [m.s-1]": np.gradient(z, time),
    }
    return Trajectory(time, columns)


def against(plan: Trajectory, real: Trajectory) -> EventComparison:
    return compared(read(plan, PLANNED, WEIGHT), read(real, EXECUTED, WEIGHT))


def told(found: EventComparison) -> list[tuple[str, str | None]]:
    return [(event.kind, event.leg) for event in found.events]


def test_a_bound_is_rear_and_front_in_turn() -> None:
    plan = motion(BOUND, ahead=0.8)
    found = against(plan, motion(BOUND, ahead=0.8))
    stride = [("liftoff", "rear"), ("apex", None), ("touchdown", "front"), ("liftoff", "front"),
              ("apex", None), ("touchdown", "rear")]  # fmt: skip
    # it ends in the air: its last apex is there, and no landing
    assert told(found) == [*stride, *stride, ("liftoff", "rear"), ("apex", None)]
    assert [one.legs for one in found.landings()] == [("front",), ("rear",), ("front",), ("rear",)]
    assert found.difference == "" and len(found.apexes) == 5
    assert all(abs(e.error_s or 0.0) <= 1e-3 for e in found.events)
    assert ends_standing(plan, ("rear", "front")) == []


def late(stances: Stances, leg: str, number: int, by: float) -> Stances:
    """One stance of a leg later by so much."""
    spans = [(a + by, b + by) if i == number else (a, b) for i, (a, b) in enumerate(stances[leg])]
    return {**stances, leg: spans}


def without(stances: Stances, leg: str, number: int) -> Stances:
    return {**stances, leg: [s for i, s in enumerate(stances[leg]) if i != number]}


def also(stances: Stances, leg: str, begin: float, end: float) -> Stances:
    return {**stances, leg: sorted([*stances[leg], (begin, end)])}


def test_a_foot_on_the_ground_is_no_stand_of_a_body_that_goes_on() -> None:
    slow, fast = motion(JUMP, ahead=0.2), motion(JUMP, ahead=0.8)  # 0.25 and 1 m/s
    assert ends_standing(slow, ("rear", "front")) == ["rear", "front"]
    assert ends_standing(fast, ("rear", "front")) == []


def test_every_landing_has_its_own_time() -> None:
    found = against(motion(BOUND), motion(late(BOUND, "front", 1, 0.012)))
    assert not found.difference
    assert [round(1e3 * one.late) for one in found.landings()] == [0, 0, 12, 0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: without(s, "front", 0),
         "never touches down with the front foot, planned at 0.150 s"),
        (lambda s: without(s, "rear", 2),
         "never touches down with the rear foot, planned at 0.600 s"),
        (lambda s: also(s, "rear", 0.48, 0.52),
         "touches the ground with the rear foot a second time, at 0.480 s, which is not planned"),
        (lambda s: {**s, "front": [(0.15, 0.55)]},
         "never touches down with the front foot, planned at 0.450 s"),
    ],
)  # fmt: skip
def test_another_order_is_noticed(change: Callable[[Stances], Stances], words: str) -> None:
    assert against(motion(BOUND), motion(change(BOUND))).difference == words


def test_feet_that_change_their_roles_are_noticed() -> None:
    plan: Stances = {"rear": [(-1.0, 0.1), (0.3, 0.4), (0.6, 0.7)], "front": [(0.15, 0.55)]}
    real: Stances = {"rear": [(-1.0, 0.1), (0.14, 0.26), (0.6, 0.7)], "front": [(0.3, 0.55)]}
    assert against(motion(plan), motion(real)).difference == (
        "touches down with the rear foot before it touches down with the front foot, not after"
    )


@pytest.mark.parametrize("seed", range(20))
def test_any_contact_left_out_or_added_is_noticed(seed: int) -> None:
    """Of a drawn gait with contacts and breaks of 30 to 120 ms."""
    rng = np.random.default_rng(seed)

    def spans() -> list[tuple[float, float]]:
        edges = 0.02 + np.cumsum(rng.uniform(0.03, 0.12, 12))
        return [(round(a, 3), round(b, 3)) for a, b in edges.reshape(-1, 2)]

    plan = {"rear": spans(), "front": spans()}
    leg = str(rng.choice(["rear", "front"]))
    number = int(rng.integers(len(plan[leg])))
    end = 2.0
    full, less = motion(plan, end), motion(without(plan, leg, number), end)
    assert against(full, full).difference == ""
    assert against(full, less).missed()
    assert against(less, full).unplanned


def test_feet_that_come_down_together_have_no_order() -> None:
    real = {"rear": [(-1.0, 0.2), (0.508, 9.0)], "front": [(-1.0, 0.2), (0.497, 9.0)]}
    plan = {"rear": [(-1.0, 0.2), (0.500, 9.0)], "front": [(-1.0, 0.2), (0.512, 9.0)]}
    found = against(motion(plan), motion(real))
    (landing,) = found.landings()
    assert not found.difference and landing.legs == ("rear", "front")
    assert landing.late == pytest.approx(-0.003)
    plan["front"] = [(-1.0, 0.2), (0.540, 9.0)]  # later than that they have, where times are exact
    found = against(motion(plan), motion(real))
    assert found.difference.startswith("touches down with the front foot before")
    assert not found.missed(0.05) and len(found.landings(0.05)) == 1
    assert [one.legs for one in found.landings(0.02)] == [("rear",), ("front",)]


def test_every_flight_of_a_double_jump_has_its_apex() -> None:
    plan = motion(DOUBLE)
    higher = {**DOUBLE, "rear": [(-1.0, 0.1), (0.35, 0.5), (0.77, 9.0)]}
    higher["front"] = higher["rear"]
    first, second = against(plan, motion(higher)).apexes
    assert first.height_error_m == pytest.approx(0.0, abs=1e-9)
    rises = [4.905 * (time / 2) ** 2 for time in (0.27, 0.25)]
    assert second.height_error_m == pytest.approx(rises[0] - rises[1], rel=0.02)
    assert (first.time, second.time) == (pytest.approx(0.225, abs=2e-3),
                                         pytest.approx(0.625, abs=2e-3))  # fmt: skip


def test_a_backflip_that_does_not_turn_is_another_motion() -> None:
    plan = motion(JUMP, turns=1.0)
    assert against(plan, plan).apexes[0].pitch_error_rad == pytest.approx(0.0)
    stays = against(plan, motion(JUMP))
    assert not stays.difference  # its feet do the same
    assert stays.apexes[0].pitch_error_rad == pytest.approx(-math.pi, abs=0.05)
    assert turned(2 * math.pi + 0.1, 0.0) == pytest.approx(0.1)
    assert turned(math.pi, 0.0) == pytest.approx(math.pi)
    assert ends_standing(plan, ("rear", "front")) == ["rear", "front"]


def test_a_motion_may_end_in_the_air_or_begin_there() -> None:
    thrown: Stances = {"rear": [(-1.0, 0.2)], "front": [(-1.0, 0.2)]}
    plan = motion(thrown, end=0.4)
    assert ends_standing(plan, ("rear", "front")) == []
    assert not against(plan, plan).difference and not against(plan, plan).landings()
    # an execution that goes on, and lands after the plan's end, differs in nothing
    assert not against(plan, motion(JUMP)).difference
    early: Stances = {"rear": [(-1.0, 0.2), (0.3, 9.0)], "front": [(-1.0, 0.2), (0.3, 9.0)]}
    assert against(plan, motion(early)).unplanned.startswith(
        "touches down with the rear foot at 0.3"
    )
    dropped: Stances = {"rear": [(0.2, 9.0)], "front": [(0.2, 9.0)]}
    assert told(against(motion(dropped), motion(dropped)))[1:] == [
        ("touchdown", "rear"), ("touchdown", "front"),
    ]  # fmt: skip


def test_a_touchdown_at_the_end_may_come_after_it() -> None:
    """Of a stride that ends with a foot on the ground: what comes then is the next one's."""
    plan = motion({"rear": [(-1.0, 0.1), (0.4, 9.0)], "front": [(0.15, 0.25)]}, end=0.4)
    later = motion({"rear": [(-1.0, 0.1), (0.403, 9.0)], "front": [(0.15, 0.25)]}, end=0.5)
    ended = motion({"rear": [(-1.0, 0.1), (0.403, 9.0)], "front": [(0.15, 0.25)]}, end=0.4)
    assert against(plan, later).landings()[-1].late == pytest.approx(0.003)
    assert not against(plan, later).difference and not against(plan, ended).difference


def test_a_graze_is_no_event() -> None:
    """Neither in both nor in one of them; where the other has a firm contact, it is one."""
    grazed = also(JUMP, "front", 0.3, 0.305)
    light = motion(grazed)
    light = light.with_columns({"front/foot/Fz [N]": light["front/foot/Fz"] * (light.time > 0.4)})
    for plan, real in ((motion(JUMP), light), (light, motion(JUMP)), (light, light)):
        found = against(plan, real)
        assert not found.difference and len(found.apexes) == 1
    longer = motion(also(JUMP, "front", 0.3, 0.33))
    assert against(motion(JUMP), longer).unplanned
    nearly = against(longer, light)
    assert not nearly.difference and len(nearly.landings()) == 2


def test_a_foot_that_hardly_rises_has_not_left_the_ground() -> None:
    t = motion(JUMP)
    low = t.with_columns({"front/foot/z [m]": np.minimum(t["front/foot/z"], 0.004)})
    assert told(against(low, low)) == [("liftoff", "rear"), ("touchdown", "rear")]


def foot(force: float, *spans: tuple[float, float]) -> ContactCourse:
    """A foot in the air but for contacts, in which it takes `force` [N]; 1 ms rows to 0.2 s."""
    time = np.arange(201) * 1e-3
    down = np.any([(time >= a) & (time < b) for a, b in spans], axis=0)
    columns = {"front/foot/z [m]": np.where(down, 0.0, 0.1), "front/foot/Fz [N]": force * down}
    return read(Trajectory(time, columns), PLANNED, WEIGHT)


@pytest.mark.parametrize(
    ("force", "spans", "expected"),
    [
        (1.0, ((0.05, 0.054), (0.15, 1.0)), 0.15),  # a graze, then the landing
        (400.0, ((0.05, 0.06), (0.15, 1.0)), 0.05),  # as short, but it stops the body
        (1.0, ((0.05, 0.08), (0.15, 1.0)), 0.05),  # light, but it stays
        (1.0, ((0.05, 0.054),), None),
        (1.0, ((0.19, 1.0),), 0.19),  # lasts to the end
        (1.0, ((0.0, 0.03), (0.15, 1.0)), 0.15),  # stood before
    ],
)
def test_a_touchdown_carries_the_body(
    force: float, spans: tuple[tuple[float, float], ...], expected: float | None
) -> None:
    found = min(foot(force, *spans).touchdowns(), default=None)
    assert found == (None if expected is None else pytest.approx(expected))


def test_touchdowns_are_told_between_rows() -> None:
    time = np.arange(0.0, 0.3, 5e-3)
    height = np.clip(0.1 - time, 0.0, None)
    exact = contacts(time, height, EXECUTED, hits=[0.0973])
    assert [span.begin for span in exact] == [0.0973]


@pytest.mark.parametrize("speed", [0.4, 1.5])
@pytest.mark.parametrize("level", [0.0, 8e-3])  # m; what a sensor's zero makes of the ground
def test_a_foot_comes_down_where_its_measured_height_bends(speed: float, level: float) -> None:
    time = np.arange(0.0, 0.3, 1e-3)
    height = level + np.clip(speed * (0.1533 - time), 0.0, None)
    noise = 3e-4 * np.random.default_rng(1).standard_normal(len(time))
    for near in (0.148, 0.170):
        assert bend(time, height, near) == pytest.approx(0.1533, abs=2e-4)
        assert bend(time, height + noise, near) == pytest.approx(0.1533, abs=1e-3)
    assert bend(time, np.zeros(len(time)), 0.15) == 0.15
    assert bend(time, np.full(len(time), np.nan), 0.15) == 0.15


def test_an_apex_lies_between_rows() -> None:
    time = np.arange(0.0, 0.4, 5e-3)
    z = 1.0 + 2.0 * time - 4.905 * time**2
    for around in (0.0, 0.02):
        assert peak(time, z, around) == pytest.approx((2 / 9.81, 1 + 4 / 19.62), abs=1e-9)
    assert peak(time, z, None) == (time[np.argmax(z)], z.max())
    assert peak(time, -time) == (0.0, 0.0)


def test_flights_are_between_the_contacts_of_all_legs() -> None:
    spans = [Span(-math.inf, 0.1), Span(0.05, 0.2), Span(0.3, 0.4)]
    assert flights(spans) == [Span(0.2, 0.3), Span(0.4, math.inf)]
    assert flights([Span(0.1, math.inf)]) == [Span(-math.inf, 0.1)]
    assert flights([]) == [Span(-math.inf, math.inf)]
    stands = [Span(-math.inf, 0.5), Span(0.1, 0.2), Span(0.6, math.inf)]  # one within another
    assert flights(stands) == [Span(0.5, 0.6)]


def test_as_few_spans_as_possible_stay_alone() -> None:
    was = [Span(0.0, 0.1), Span(0.5, 0.6)]
    bounce = [Span(0.0, 0.1), Span(0.51, 0.56), Span(0.58, 0.7)]
    assert aligned(was, bounce, 1.0) == [
        (was[0], bounce[0]), (was[1], bounce[1]), (None, bounce[2]),
    ]  # fmt: skip
    assert aligned(was, [], 1.0) == [(was[0], None), (was[1], None)]
    late = Span(0.8, 0.9)  # by three times what it lasts
    assert aligned(was[1:], [late], 1.0) == [(was[1], late)]


def test_breaks_are_filled_where_the_foot_stays_low() -> None:
    down = np.array([0, 0, 1, 0, 0, 1, 0, 1, 0], dtype=bool)
    low = np.array([1, 1, 1, 1, 1, 1, 0, 1, 1], dtype=bool)
    assert bridged(down, low).tolist() == [True] * 6 + [False] + [True] * 2
    never = np.zeros(4, dtype=bool)
    assert not bridged(never, ~never).any()


def test_a_contact_is_firm_by_time_or_by_force() -> None:
    assert Span(0.0, LASTS).firm and not Span(0.0, 0.9 * LASTS).firm
    assert Span(0.0, 1e-3, heavy=True).firm and Span(0.1, math.inf).firm


def test_where_no_force_is_known_none_makes_a_contact_firm() -> None:
    """A short touch of a robot however light: its force is taken as nothing."""
    time = np.arange(0.0, 0.1, 1e-3)
    height = np.where((time > 0.04) & (time < 0.05), 0.0, 0.1)
    (span,) = contacts(time, height, PLANNED, weight=1.0)
    assert not span.heavy and not span.firm
    (span,) = contacts(time, height, PLANNED, np.full(len(time), 10.0), weight=1.0)
    assert span.heavy


@pytest.mark.parametrize(
    ("speed", "rear", "legs"),
    [([0.0, 2.0, 0.0], 0.0, ["front", "rear"]), ([0.0, 2.0, 2.0], 0.0, []),
     ([0.0, 0.0, 0.0], 0.1, ["front"])],
)  # fmt: skip
def test_who_stands_at_the_end_is_told_by_the_end(
    speed: list[float], rear: float, legs: list[str]
) -> None:
    columns = {"body/vx [m.s-1]": np.array(speed), "front/foot/z [m]": np.zeros(3),
               "rear/foot/z [m]": np.array([0.0, 0.0, rear])}  # fmt: skip
    assert ends_standing(Trajectory(np.arange(3.0), columns), ("front", "rear")) == legs
