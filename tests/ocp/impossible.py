"""Ten tasks that cannot be met, and what the answer must name."""

from dataclasses import dataclass

SLICK = "name: slick\nbase: planning\neffects:\n  - {kind: contact, mu: 0}\n"
WEAK = "name: weak\nbase: planning\neffects:\n  - {kind: motor, tau_peak: 0.1 N.m}\n"
SWING = (
    "goals.front={quantity: front/hip/q, at: middle, equals: 45 deg}",
    "goals.rear={quantity: rear/hip/q, at: middle, equals: -45 deg}",
)


@dataclass(frozen=True)
class Impossible:
    """A shipped task changed by `--set` options, perhaps on another model; `named` are words of
    the sentence, `relax` the requirement to relax (None: it lies elsewhere)."""

    name: str
    task: str
    options: tuple[str, ...]
    named: tuple[str, ...]
    relax: str | None
    model: str | None = None


REFUSED = [
    Impossible(
        "too high for the time", "jump", ("height=3 m",), ("`duration`", "3 m"), "goals.apex"
    ),
    Impossible("under the ground", "jump", ("end.*/foot/z=-0.1 m",), ("ground",), "end.*/foot/z"),
    Impossible(
        "contradiction",
        "jump",
        ("goals.low={quantity: body/z, at: middle, at_most: 0.4 m}",),
        ("contradiction", "`goals.apex`", "`goals.low`", "0.4 m"),
        "goals.low",
    ),
    Impossible("start pose", "max_jump", ("start.body/z=1 m",), ("pose", "1 m"), "start.body/z"),
    Impossible("no grip", "jump_forward", (), ("`end.body/x`", "mu is 0", "slick"), None, SLICK),
    Impossible("few nodes", "jump", ("nodes=5",), ("`nodes`", "140 ms", "at least 14"), None),
]

SEARCHED = [
    Impossible("too high", "jump", ("height=1.45 m", "nodes=24"), ("1.45 m asked",), "goals.apex"),
    Impossible(
        "too short",
        "jump",
        ("duration=0.15 s", "nodes=24"),
        ("`duration`", "0.15 s in all leave at most 0.09 s"),
        "goals.apex",
    ),
    Impossible(
        "pistons off",
        "jump",
        ("bounds.*/valve/*=0", "nodes=24"),
        ("`bounds.*/valve/*`", "without air"),
        "goals.apex",
    ),
    Impossible(
        "heavy", "jump", ("payload=20 kg", "nodes=24"), ("`payload`", "adds 20 kg"), "goals.apex"
    ),
    Impossible(
        "weak hips", "jump", (*SWING, "nodes=24"), ("hip torque", "tau_peak"), "goals.front", WEAK
    ),
]
