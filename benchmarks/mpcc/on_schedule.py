"""The schedule of the plans, as benchmarks/nosbench.py compares it."""

from typing import Any

import numpy as np

from kemba.ocp.nlp.ipopt import Ipopt, Iterate, warm
from kemba.ocp.relaxation.schedule import exact, interior
from kemba.ocp.relaxation.settings import Ends, Relaxation, Starts
from mpcc.on_nosbench import GOOD, written


def schedule(given: dict[str, Any]) -> tuple[np.ndarray, int]:
    """What plans do after their valves are known: 1e-3, 1e-4, 8e-7, far inside the bounds first."""
    program = written(given)
    point = Iterate(program.program.start)
    relaxation, starts, ends = Relaxation, Starts, Ends
    steps = (
        (relaxation.loose, interior()),
        (relaxation.tight, warm(starts.changed_mu, starts.changed, tol=ends.tol)),
        (relaxation.margin * GOOD, exact(starts.tighten_mu)),
    )
    iterations = 0
    for sigma, options in steps:
        ipopt = Ipopt(program.relaxed(sigma), {"max_iter": 600})
        point = ipopt.solve(point, given["p"][1], options)
        iterations += point.iterations
    return point.Y, iterations


METHODS = {"schedule of the plans": schedule}
