"""Figures of the refinement: how modes are read, solved and repaired. See docs/solving.md.

Where no other reason is given, they were chosen by hand on the cases of benchmarks/refine.py.
"""


class Reading:
    """How modes are read off an implicit Euler plan."""

    # m; body weight over this length separates a force from a gap of the relaxation: the product
    # of both is at most the relaxation, 1e-6
    stiff = 1e-3
    closed = 1e-6  # m; a smaller gap at the start touches: the certificate's tolerance
    slides = 0.05  # m/s; a faster slip is sliding
    light = 0.1  # of body weight: a foot that bears less for a step or two does not stand
    shudder = 5e-5  # m; what opens less for a step or two stays closed
    hop = 5e-3  # m; a foot that rises less for a step or two stays down
    brief = 2  # steps that are few: implicit Euler smears an impact over two


class ModeConstraints:
    """What modes ask beyond touching and staying apart, by trials that docs/solving.md tells."""

    clear = 2e-4  # m; least gap of what stays open; a smaller one closes when executed
    away = 3  # elements before and after a touch in which gaps may be smaller
    # of all elements, where that is more: what must stay apart is then the same on finer grids;
    # 3 of 100 elements, where the trials were made
    away_share = 0.03
    # m/s; least speed at which a foot comes down, or half of the most that the task allows; at
    # 0.1 m/s a pulse of a valve stopped it on its way, and a jump of 0.77 m came down 2.8 ms late
    lands = 0.3
    # part of an equality's gradient that must be new beside the others: far above rounding errors,
    # far below any real direction
    independent = 1e-6


class Elements:
    """Bounds of element durations, by trials that docs/solving.md describes, and of slacks."""

    shortest = 0.03  # times the nominal step: shortest element
    longest = 2.0  # the same of the longest; on longer ones two stages err, for lower costs
    # of a state's range: room below its lower bound, since a vented chamber stays exactly there;
    # without it IPOPT did not converge
    vented = 0.01
    leeway = 1e-4  # scaled slack beyond what a start needs: off the bounds


class Refining:
    """How a refinement is solved."""

    iterations = 1200  # of all solves together
    long_iterations = 200  # of a solve
    pulse_iterations = 60  # of one with another pulse
    # scaled: a plan nearer to its mirror image is solved by half; the certificate's tolerance
    mirrored = 1e-6
    # of a mode violated by its scale; at a lower price modes that can hold are violated too: rates
    # in elements of 0.2 ms have multipliers above 1e4
    price = 1e5
    # of solves near a start, in which modes are not judged: from far off IPOPT does not converge at
    # the price above (bound of hound: 200 iterations, 96 at this one)
    first_price = 1e3
    # proximal weight of solves near a start; where it is large beside the price, modes that can
    # hold are violated
    near = 0.01
    # m; a foot this near to what it keeps off between nodes cuts its corner without a row there (a
    # hurdle of 0.2 m with five stages an element: by 36 mm, and no solution with rows added after)
    near_rows = 5e-3
    mu = 1e-4  # barrier parameter of a warm start
    elastic_mu = 0.1  # barrier parameter of an elastic solve: IPOPT's default
    push = 1e-6  # distance from the bounds of a warm start: small beside every scaled variable
    rough_tol = 1e-3  # IPOPT's tolerance of the coarser scheme, which is solved on
    rough_rows = 1e-6  # tolerance of the rows by the coarser scheme
    tol = 1e-4  # IPOPT's tolerance of the finer scheme
    rows = 1e-8  # tolerance of the rows by the finer scheme: 100 times below the certificate's
    # mumps_pivtol; IPOPT's 1e-6 counts wrong signs on three stages, and steps shrink
    pivot = 1e-3
    # mumps_permuting_scaling, none; with it a solve that did not converge took 0.3 to 4 s an
    # iteration, for pivots that are put off, instead of 0.02 s (jumps of 0.6 and 0.65 m continued
    # from 0.5 m); others take as long as before
    permuting = 0
    # max_hessian_perturbation; beyond, tries cost a second an iteration and lead nowhere
    hessian = 1e6
    # usual iterations whose time long ones may cost together: solves that converged lost 21 at
    # most, those that took a minute 50 to 300
    slow = 40.0
