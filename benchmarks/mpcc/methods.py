"""Ways to solve a program with pairs, all by kemba's wrapper of IPOPT and MUMPS."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np

from kemba.ocp.mpcc.solve import solve_mpcc
from kemba.ocp.nlp.ipopt import Ipopt, Iterate, warm
from kemba.ocp.relaxation.schedule import exact, interior
from kemba.ocp.relaxation.settings import Ends, Relaxation, Starts
from mpcc.problem import Mpcc

FINAL = 1e-6  # of the products
MOST = 600  # iterations of one solve


def schedule(program: Mpcc, start: np.ndarray) -> Iterate:
    """kemba's schedule of a plan without valves: relaxed far inside the bounds, tighter, tight.

    Options and figures are those of kemba/ocp/relaxation, with the Newton steps of whole robots.
    """
    relaxation, starts, ends = Relaxation, Starts, Ends
    ipopt = Ipopt(program, {"max_iter": MOST})
    first = ipopt.solve(Iterate(start), [relaxation.loose], interior(), regularised=True)
    options = warm(starts.changed_mu, starts.changed, tol=ends.tol)
    second = ipopt.solve(first, [relaxation.tight], options, regularised=True)
    eps, last = relaxation.margin * FINAL, exact(starts.tighten_mu)
    third = ipopt.solve(second, [eps], last, proximal=relaxation.proximal, regularised=True)
    return replace(third, iterations=sum(p.iterations for p in (first, second, third)))


def on_branch(program: Mpcc, start: np.ndarray) -> Iterate:
    """The same, and the smooth program in which the smaller side of every pair is zero: what
    refining does to a plan, whose modes are fixed."""
    found = schedule(program, start)
    branch = program.branch(program.nearest(found.Y))
    options = warm(Starts.tighten_mu, max_iter=MOST)
    last = Ipopt(branch, options).solve(Iterate(found.Y), [0.0])
    better = last if last.solved else found
    return replace(better, iterations=found.iterations + last.iterations)


def fixed(program: Mpcc, start: np.ndarray) -> Iterate:
    """One solve at the final relaxation, with IPOPT's defaults."""
    margin = Relaxation.margin
    ipopt = Ipopt(program, {"max_iter": 3 * MOST, "nlp_scaling_method": "gradient-based"})
    return ipopt.solve(Iterate(start), [margin * FINAL])


def products(program: Mpcc, start: np.ndarray) -> Iterate:
    """One solve with the products at most zero, with IPOPT's defaults."""
    ipopt = Ipopt(program, {"max_iter": 3 * MOST, "nlp_scaling_method": "gradient-based"})
    return ipopt.solve(Iterate(start), [0.0])


def heart(program: Mpcc, start: np.ndarray) -> Iterate:
    """kemba.solve_mpcc."""
    parts = program.parts
    rows = ca.vertcat(parts.zero, parts.positive)
    high = np.repeat([0.0, np.inf], [parts.zero.numel(), parts.positive.numel()])
    bounds = {"lbx": program.lower, "ubx": program.upper, "lbg": 0.0, "ubg": high}
    found = solve_mpcc(parts.x, parts.f, rows, parts.a, parts.b, bounds, start)
    return Iterate(found.x, iterations=found.iterations)


METHODS: dict[str, Callable[[Mpcc, np.ndarray], Iterate]] = {
    "kemba's schedule": schedule,
    "the same, then its branch exactly": on_branch,
    "kemba.solve_mpcc": heart,
    "one solve, products at most 8e-7": fixed,
    "one solve, products at most 0": products,
}
