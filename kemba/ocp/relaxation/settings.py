"""Figures of the schedule: what each solve asks, and when one gives up. See docs/solving.md.

Those without a reason of their own were chosen by hand, or by the trials of docs/solving.md on the
jumps of configs/sweeps/reliability.yaml, whose code was not kept.
"""


class Relaxation:
    """How far the pairs are relaxed, and what the cost holds beside the task's own."""

    loose = 1e-3  # body weights times m (or m/s), relaxation of the pairs while valves are sought
    tight = 1e-4  # relaxation of the pairs once valves are fixed
    margin = 0.8  # the last one, as a part of what is certified: room for IPOPT's own tolerance
    valve = 0.1  # weight of u (1 - u), per valve and node of the grid's mean
    switching = 0.05  # weight of squared changes of a valve, without which it chatters in flight
    switching_moved = 0.01  # the same where switches are moved
    forces = 3e-5  # weight of squared scaled forces, without which legs that share are flat
    proximal = 3e-4  # weight of half the squared distance from the start in the last solve


class Starts:
    """Where each solve starts: barrier parameters and distances from the bounds."""

    interior_push = 0.3  # bound_push and bound_frac of the first solve; 0.5 is the middle
    interior_mu = 0.1  # barrier parameter of the first solve, IPOPT's default
    rounded = 1e-2  # distance from the bounds after rounding, which leaves plans far from feasible
    rounded_mu = 1e-2  # barrier parameter after rounding
    # distance from the bounds after valves were released or the grid refined, by
    # benchmarks/variants.py
    changed = 1e-3
    changed_mu = 1e-3  # barrier parameter after that
    tighten_mu = 1e-5  # barrier parameter of the last solve


class Ends:
    """When a solve of the schedule is done, and when it is given up."""

    tol = 1e-3  # IPOPT's tolerance while valves are sought; these plans are changed again
    exact_tol = 1e-2  # IPOPT's tolerance of the last solve: a few digits of the cost
    relax_iterations = 600  # limit of the first solve; where there is a plan it takes 30 to 200
    # limit of each later one while valves are sought: beside walls those that lead to a plan take
    # up to 700
    valve_iterations = 800
    misfit_iterations = 200  # the same on a finer grid; valves that fit take 20 to 100
    # iterations without a smaller violation, after which a finer grid's valves do not fit
    stagnation_iterations = 40
    stagnation_near = 0.05  # scaled violation from which the next solve may begin


class Grids:
    """On which grids valves are sought, and how far their switches move where a plan of half a
    robot becomes one of the whole; chosen by hand, no comparison kept."""

    reach = 4  # nodes by which a switch may move
    coarsest = 24  # nodes of the coarsest grid
    finest = 80  # nodes of the finest grid on which valves are sought, unless its steps are long
    # s; the longest step on which valves are sought: chambers fill in up to 40 ms (with steps of
    # 38 ms a run of 2.7 s had no plan, with 19 ms it has one on nodes)
    longest = 0.03
