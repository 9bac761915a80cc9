"""Settings of the schedule: what each solve asks, and when one gives up. See docs/solving.md."""

from kemba.settings import CHOSEN, Settings, setting

# Both on the jumps of configs/sweeps/reliability.yaml; the code of the trials was not kept.
TRIALS = "tuned: trials that docs/solving.md describes"

VARIANTS = "tuned: benchmarks/variants.py"
PAIR = "body weights x m (or m/s)"


class Relaxation(Settings):
    """How far the pairs are relaxed, and what the cost holds beside the task's own."""

    loose: float = setting(
        1e-3, PAIR, "relaxation of the pairs while valves are sought", CHOSEN, decides=True
    )
    tight: float = setting(
        1e-4, PAIR, "relaxation of the pairs once valves are fixed", CHOSEN, decides=True
    )
    margin: float = setting(
        0.8, "1", "the last relaxation, as a part of what the certificate asks",
        "convention: room for IPOPT's own tolerance on the rows", decides=True, at_most=1.0,
    )  # fmt: skip
    valve: float = setting(
        0.1, "1", "weight of u(1 - u), per valve and node of the grid's mean", CHOSEN, decides=True
    )
    switching: float = setting(
        0.05, "1", "weight of squared changes of a valve; without it valves chatter in flight",
        TRIALS, decides=True,
    )  # fmt: skip
    switching_moved: float = setting(
        0.01, "1", "the same weight where switches are moved", TRIALS, decides=True
    )
    forces: float = setting(
        3e-5, "1", "weight of squared scaled forces while valves are sought; without it the cost "
        "is flat where legs share a load", TRIALS, decides=True,
    )  # fmt: skip
    proximal: float = setting(
        3e-4, "1", "weight of half the squared distance from the start in the last solve",
        TRIALS, decides=True,
    )  # fmt: skip


class Starts(Settings):
    """Where each solve starts: barrier parameters and distances from the bounds."""

    interior_push: float = setting(
        0.3, "1", "bound_push and bound_frac of the first solve: far inside the bounds; 0.5 is the "
        "middle", TRIALS, decides=True, at_most=0.5,
    )  # fmt: skip
    interior_mu: float = setting(
        0.1, "1", "barrier parameter of the first solve",
        "convention: IPOPT's default", decides=True,
    )  # fmt: skip
    rounded: float = setting(
        1e-2, "1", "distance from the bounds after valves were rounded, which leaves the plan far "
        "from feasible", TRIALS, decides=True,
    )  # fmt: skip
    changed: float = setting(
        1e-3, "1", "distance from the bounds after valves were released or the grid refined",
        VARIANTS, decides=True,
    )  # fmt: skip
    rounded_mu: float = setting(1e-2, "1", "barrier parameter after rounding", TRIALS, decides=True)
    changed_mu: float = setting(
        1e-3, "1", "barrier parameter after releasing valves or refining the grid", CHOSEN,
        decides=True,
    )  # fmt: skip
    tighten_mu: float = setting(
        1e-5, "1", "barrier parameter of the last solve", CHOSEN, decides=True
    )


class Ends(Settings):
    """When a solve of the schedule is done, and when it is given up."""

    tol: float = setting(
        1e-3, "1", "IPOPT's tolerance while valves are sought; these plans are changed again",
        CHOSEN, decides=True,
    )  # fmt: skip
    exact_tol: float = setting(
        1e-2, "1", "IPOPT's tolerance of the last solve: optimal to a few digits of the cost",
        CHOSEN, decides=True,
    )  # fmt: skip
    relax_iterations: int = setting(
        600, "1", "limit of the first solve; where there is a plan it takes 30 to 200",
        "derived: three times the longest seen", decides=True,
    )  # fmt: skip
    misfit_iterations: int = setting(
        200, "1", "limit of the first solve on a finer grid; valves that fit take 20 to 100",
        "derived: twice the longest seen", decides=True,
    )  # fmt: skip
    stagnation_iterations: int = setting(
        40, "1", "iterations without a smaller violation, after which a finer grid's valves do not "
        "fit", CHOSEN, decides=True,
    )  # fmt: skip
    stagnation_near: float = setting(
        0.05, "1", "scaled violation from which the next solve may begin", CHOSEN, decides=True
    )


class Grids:
    """On which grids valves are sought, and how far their switches move where a plan of half a
    robot becomes one of the whole; chosen by hand, no comparison kept."""

    reach = 4  # nodes by which a switch may move
    coarsest = 24  # nodes of the coarsest grid
    finest = 80  # nodes of the finest grid on which valves are sought
