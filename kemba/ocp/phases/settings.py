"""Settings of the refinement: how modes are read, solved and repaired. See docs/solving.md."""

from kemba.settings import Settings, setting

TRIALS = "tuned: trials that docs/solving.md describes"
HAND = "convention: chosen by hand on the cases of benchmarks/refine.py, no comparison kept"
STEPS = "derived: implicit Euler smears an impact over two steps"


class Reading(Settings):
    """How modes are read off an implicit Euler plan."""

    stiff: float = setting(
        1e-3, "m", "body weight over this length separates a force from a gap of the relaxation",
        "derived: the product of both is at most the relaxation, 1e-6", decides=True,
    )  # fmt: skip
    closed: float = setting(
        1e-6, "m", "a smaller gap at the start touches", "derived: the certificate's tolerance"
    )
    slides: float = setting(0.05, "m.s-1", "a faster slip is sliding", HAND, decides=True)
    light: float = setting(
        0.1, "1", "of body weight: a foot that bears less for a step or two does not stand",
        HAND, decides=True,
    )  # fmt: skip
    shudder: float = setting(
        5e-5, "m", "what opens less for a step or two stays closed", HAND, decides=True
    )
    hop: float = setting(
        5e-3, "m", "a foot that rises less for a step or two stays down", HAND, decides=True
    )
    brief: int = setting(2, "1", "steps that are few", STEPS, decides=True)


class ModeConstraints(Settings):
    """What modes ask beyond touching and staying apart."""

    clear: float = setting(
        2e-4, "m", "least gap of what stays open; a smaller one closes when executed", TRIALS,
        decides=True,
    )  # fmt: skip
    away: int = setting(
        3, "1", "elements before and after a touch in which gaps may be smaller", TRIALS,
        decides=True,
    )  # fmt: skip
    away_share: float = setting(
        0.03, "1", "of all elements, where that is more: what must stay apart is then the same on "
        "finer grids", "derived: 3 of 100 elements, where the trials were made", decides=True,
    )  # fmt: skip
    lands: float = setting(
        0.3, "m.s-1", "least speed at which a foot comes down, or half of the most that the task "
        "allows; at 0.1 m/s a pulse of a valve stops it on its way, and it touches 3 ms later",
        "tuned: jumps of 0.55 to 0.77 m; at 0.1 m/s that of 0.77 m came down 2.8 ms late",
        decides=True,
    )  # fmt: skip
    independent: float = setting(
        1e-6, "1", "part of an equality's gradient that must be new beside the others",
        "derived: far above rounding errors, far below any real direction",
    )  # fmt: skip


class Elements(Settings):
    """Bounds of element durations and of mode constraints that may be violated."""

    shortest: float = setting(
        0.03, "1", "times the nominal step: shortest element", TRIALS, decides=True
    )
    longest: float = setting(
        2.0, "1", "times the nominal step: longest element; on longer ones two stages err, for "
        "lower costs", TRIALS, decides=True,
    )  # fmt: skip
    collapsed: float = setting(
        3.0, "1", "times the shortest duration: a phase that short has collapsed", TRIALS,
        decides=True,
    )  # fmt: skip
    vented: float = setting(
        0.01, "1", "of a state's range: room below its lower bound, since a vented chamber stays "
        "exactly there", "tuned: without it IPOPT did not converge (docs/solving.md)",
    )  # fmt: skip
    leeway: float = setting(
        1e-4, "1", "scaled slack beyond what a start needs", "convention: off the bounds"
    )


class Refining(Settings):
    """How a refinement is solved."""

    mirrored: float = setting(
        1e-6, "1", "scaled: a plan nearer to its mirror image is solved by half",
        "derived: the certificate's tolerance",
    )  # fmt: skip
    price: float = setting(
        1000.0, "1", "of a mode violated by its scale; at a lower price modes that can hold are "
        "violated too", HAND, decides=True,
    )  # fmt: skip
    near: float = setting(
        10.0, "1", "proximal weight of the first solve; without, short steps wander off", HAND,
        decides=True,
    )  # fmt: skip
    near_elastic: float = setting(
        0.01, "1", "proximal weight of elastic solves; modes that can hold are violated where it "
        "is large beside the price", HAND, decides=True,
    )  # fmt: skip
    iterations: int = setting(800, "1", "of all solves together", HAND, decides=True)
    rough_iterations: int = setting(
        60, "1", "iterations of other solves by either scheme", HAND, decides=True
    )
    elastic_iterations: int = setting(
        200, "1", "iterations of an elastic solve", HAND, decides=True
    )
    mu: float = setting(1e-4, "1", "barrier parameter of a warm start", HAND, decides=True)
    elastic_mu: float = setting(
        0.1, "1", "barrier parameter of an elastic solve", "convention: IPOPT's default"
    )
    push: float = setting(
        1e-6, "1", "distance from the bounds of a warm start",
        "convention: small beside every scaled variable",
    )  # fmt: skip
    rough_tol: float = setting(
        1e-3, "1", "IPOPT's tolerance of the coarser scheme, which is solved on", HAND
    )
    rough_rows: float = setting(
        1e-6, "1", "tolerance of the rows by the coarser scheme, which is solved on", HAND
    )
    tol: float = setting(1e-4, "1", "IPOPT's tolerance of the finer scheme", HAND, decides=True)
    rows: float = setting(
        1e-8, "1", "tolerance of the rows by the finer scheme",
        "derived: 100 times below the certificate's tolerance of 1e-6",
    )  # fmt: skip
    pivot: float = setting(
        1e-3, "1", "mumps_pivtol; IPOPT's 1e-6 counts wrong signs on three stages, and steps "
        "shrink", HAND,
    )  # fmt: skip
    permuting: int = setting(
        0, "1", "mumps_permuting_scaling, none; with it a solve that does not converge took 0.3 to "
        "4 s an iteration, for pivots that are put off, instead of 0.02 s",
        "tuned: by hand, jumps of 0.6 and 0.65 m continued from 0.5 m; others take as long as "
        "before",
    )  # fmt: skip
    hessian: float = setting(
        1e6, "1", "max_hessian_perturbation; beyond, tries cost a second an iteration and lead "
        "nowhere", HAND,
    )  # fmt: skip
    stagnation_iterations: int = setting(
        30, "1", "iterations without a smaller violation, after which a solve is given up", HAND,
        decides=True,
    )  # fmt: skip
    stagnation_near: float = setting(
        1e-4, "1", "scaled violation from which the next solve may begin", HAND, decides=True
    )
    slow: float = setting(
        40.0, "1", "usual iterations whose time long ones may cost together", "tuned: solves that "
        "converged lost 21 at most, those that took a minute 50 to 300", decides=True,
    )  # fmt: skip
