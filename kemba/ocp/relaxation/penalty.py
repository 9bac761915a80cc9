"""The paper's way (eq. 8, 9): every complementarity in the cost, at one weight or a ramp."""

from __future__ import annotations

from kemba.ocp.nlp.ipopt import Iterate, warm
from kemba.ocp.relaxation.session import Schedule
from kemba.ocp.relaxation.settings import Penalty
from kemba.ocp.transcription.parameters import Parameters
from kemba.ocp.transcription.stage import COST_SCALE

METHODS = {"penalty": "single", "penalty_ramped": "ramp"}  # and the setting with their weights


def penalise(schedule: Schedule, start: Iterate, method: str) -> Iterate:
    """Solve with penalised pairs and valves; each step of a ramp starts from the last."""
    task, point, settings = schedule.transcription.task, start, Penalty.current()
    for number, rho in enumerate(getattr(settings, METHODS[method])):
        weight = rho * task.step / COST_SCALE
        parameters = Parameters(settings.unrelaxed, valve=weight * task.nodes, pairs=weight)
        options = warm(settings.ramp_mu) if number else {}
        point = schedule.solve(f"penalty, rho = {rho:g}", point, parameters, options=options)
    return point
