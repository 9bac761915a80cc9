"""Tuning numbers of the kernel. All but `StepLength` are compiled in, so that `changed` acts on
processes that have not imported the kernel yet."""

from __future__ import annotations

from kemba.settings import CHOSEN, Settings, setting

GAMMA = 1.0 - 0.5**0.5  # of ROS2, which is L-stable with it; no tuning number
ROUNDING = "derived: far above rounding errors, far below what matters"


class StepLength(Settings):
    """How long steps of a simulation are, where none is asked for."""

    tolerance: float = setting(
        3e-5,
        "1",
        "largest difference between both stages, in `speed`, `spin` or an effect state's scale",
        "derived: apexes agree with steps of 12.5 us within 0.005 mm (docs/plant.md)",
    )
    speed: float = setting(1.0, "m.s-1", "usual speed of a jump", CHOSEN)
    spin: float = setting(5.0, "rad.s-1", "usual turning rate of a jump", CHOSEN)
    shortest: float = setting(2.5e-5, "s", "shortest step", CHOSEN)
    first: float = setting(1e-4, "s", "first step", CHOSEN)
    longest: float = setting(
        5e-4, "s", "longest step", "derived: 1 ms would step over a touch and release within it"
    )


class StepControl(Settings):
    """How the length of steps follows the difference between both stages."""

    growth: float = setting(2.0, "1", "largest growth from one step to the next", CHOSEN)
    shrinking: float = setting(0.3, "1", "smallest share of the last step", CHOSEN)
    safety: float = setting(
        0.9,
        "1",
        "share of the length at which the tolerance is just met",
        "literature: Hairer, Norsett and Wanner 1993, II.4: 0.8 to 0.9",
    )


class GapDrift(Settings):
    """How closed gaps that have drifted return: contacts are held by their speeds alone."""

    share: float = setting(0.2, "1", "share of the drift that one step removes", CHOSEN)
    shortest: float = setting(
        1e-5, "s", "shorter steps remove no more", "derived: rounding would become speed"
    )
    fastest: float = setting(
        0.05, "m.s-1", "largest speed of a foot that starts below the ground", CHOSEN
    )


class ContactEvents(Settings):
    """When gaps close, and what counts as a touch."""

    closed: float = setting(1e-6, "m", "a smaller gap touches", ROUNDING)
    missed: float = setting(
        1e-8, "m", "a touchdown that is located worse is searched again", ROUNDING
    )
    searches: int = setting(4, "1", "searches of one touchdown", CHOSEN)
    beyond: float = setting(
        1.5, "1", "steps: how far behind the end of a step a touchdown may be looked for", CHOSEN
    )
    many: int = setting(12, "1", "events of one step after which gaps close sooner", CHOSEN)
    reach: float = setting(2e-5, "m", "gap that touches from then on", CHOSEN)
    most: int = setting(120, "1", "events of one step", "derived: ten times `many`")
    soonest: float = setting(1e-12, "s", "a shorter time is none", ROUNDING)
    noticed: float = setting(1e-9, "N.s", "a smaller impulse is no impact", ROUNDING)
    compliant: float = setting(
        1e-3, "m", "compliant gaps this close take part, whether they push or not", CHOSEN
    )
    deep: float = setting(
        5e-3, "m", "what starts deeper in the ground or a stop is a mistake", CHOSEN
    )
    held: float = setting(1e-4, "s", "time over which recorded forces hold the pairs", CHOSEN)


class Complementarity(Settings):
    """The small problems of contact forces."""

    rounding: float = setting(1e-11, "1", "of a row's terms: a smaller violation is none", ROUNDING)
    swaps: int = setting(
        6, "1", "changes of the active set before Lemke's method takes over", CHOSEN
    )
    negligible: float = setting(
        1e-11, "1", "of a column's largest entry: a smaller one is no pivot", ROUNDING
    )
    tie: float = setting(1e-12, "1", "ratios that differ by less are equal", ROUNDING)
    pivots: int = setting(50, "1", "pivots per unknown", CHOSEN)
