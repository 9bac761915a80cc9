"""The paper's way (eq. 8, 9): every complementarity in the cost, at one weight or a ramp."""

from __future__ import annotations

from kemba.ocp.nlp.ipopt import Iterate, Parameters
from kemba.ocp.relaxation.schedule import Schedule, warm
from kemba.ocp.transcription.stage import COST_SCALE

# rho of eq. 9: the paper's one weight, and a ramp that ends there
WEIGHTS = {"penalty": (1e4,), "penalty_ramped": (1e1, 1e2, 1e3, 1e4)}
UNRELAXED = 1e6  # a relaxation so wide that the pairs' rows never bind


def penalise(search: Schedule, start: Iterate, method: str) -> Iterate:
    """Solve with penalised pairs and valves; each step of a ramp starts from the last."""
    task, point = search.transcription.task, start
    for number, rho in enumerate(WEIGHTS[method]):
        weight = rho * task.step / COST_SCALE
        parameters = Parameters(eps=UNRELAXED, valve=weight * task.nodes, pairs=weight)
        options = warm(1e-2) if number else {}
        point = search.solve(f"penalty, rho = {rho:g}", point, parameters, options=options)
    return point
