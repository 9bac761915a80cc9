"""The steps of the schedule: relaxed pairs from a start inside the bounds, valves rounded and
fixed, pairs tightened; begun from a guess, from half the robot, or from a written run on any grid.
See docs/solving.md."""

from dataclasses import replace
from typing import Any

import numpy as np

from kemba.model import Model
from kemba.ocp.functions.problem import violation
from kemba.ocp.nlp.ending import Ending, Stagnation
from kemba.ocp.nlp.ipopt import WARM_PUSH, Bounds, Iterate, warm
from kemba.ocp.relaxation.session import Attempt, Schedule
from kemba.ocp.relaxation.settings import Ends, Grids, Relaxation, Starts
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.stage import COST_SCALE
from kemba.ocp.transcription.transcribe import Parameters, Transcription
from kemba.trajectory import Array, Trajectory

RELAX = "relax"  # the name of a schedule's first solve

EXACT_ROWS = 1e-8  # of the last solve: 100 times below the certificate's tolerance of 1e-6


def interior(push: float | None = None) -> dict[str, Any]:
    """IPOPT options of a first solve, which starts `push` inside the bounds."""
    push = Starts.interior_push if push is None else push
    distance = {"bound_push": push, "bound_frac": push}
    return {**distance, "mu_init": Starts.interior_mu, "tol": Ends.tol}


def exact(mu: float) -> dict[str, Any]:
    """IPOPT options of a last solve at barrier parameter `mu`.

    Rows are met tightly, since the certificate measures them; the cost needs few digits.
    """
    tol = Ends.exact_tol
    return warm(mu, tol=tol, constr_viol_tol=EXACT_ROWS, acceptable_iter=0)


def find(schedule: Schedule, start: Iterate) -> Iterate:
    """From a guess to a plan with binary valves, its pairs still a little loose."""
    options = {**interior(), "max_iter": schedule.at_most(Ends.relax_iterations)}
    parameters = Parameters(Relaxation.loose, forces=Relaxation.forces)
    point = schedule.solve(RELAX, start, parameters, options=options)
    if point.ending in (Ending.INFEASIBLE, Ending.ITERATION_LIMIT):
        return point  # it would not converge with tighter pairs either
    return binary(schedule, point)


def relax_stepwise(schedule: Schedule, start: Iterate, rows: np.ndarray) -> Iterate:
    """From a guess to a relaxed plan that meets the `rows` (rows,) of the program, too, which are
    left out at first.

    Continuation in their bounds, from what the first solve leaves to what is asked, in steps that
    double where one is solved and halve where it is not (Allgower and Georg, Introduction to
    Numerical Continuation Methods, SIAM 2003).
    """
    program = schedule.transcription
    asked = program.g_lower[rows], program.g_upper[rows]
    parameters = Parameters(Relaxation.loose, forces=Relaxation.forces)

    def solved(point: Iterate, lower: Array, upper: Array, most: int, **options: Any) -> Iterate:
        program.g_lower[rows], program.g_upper[rows] = lower, upper
        options["max_iter"] = schedule.at_most(most)
        return schedule.solve(RELAX, point, parameters, options=options)

    free = np.full(rows.sum(), np.inf)
    point = solved(start, -free, free, Ends.relax_iterations, **interior())
    g = program.problem.g(point.Y.ravel(), parameters.vector(program.nodes))
    left = np.array(g).ravel()[rows]
    off = [np.where(np.isfinite(a), left - a, 0.0) for a in asked]
    share, step = 0.0, FIRST_STEP
    while share < 1.0 and step >= LEAST_STEP:
        new = min(1.0, share + step)
        below, above = (1.0 - new) * np.minimum(off[0], 0.0), (1.0 - new) * np.maximum(off[1], 0.0)
        options = warm(Starts.changed_mu, Starts.changed, tol=Ends.tol)
        bounds = asked[0] + below, asked[1] + above
        found = solved(point, *bounds, STEP_ITERATIONS, **options)
        if found.solved:
            point, share, step = found, new, 2.0 * step
        else:
            step /= 2.0
    program.g_lower[rows], program.g_upper[rows] = asked
    return point if share == 1.0 else replace(point, ending=found.ending)


FIRST_STEP = 1 / 4  # of what the bounds change
LEAST_STEP = 1 / 16  # of it; what no such step solves is no motion
STEP_ITERATIONS = 150  # where a step is solved it takes 14 to 150


def binary(schedule: Schedule, point: Iterate, push: float = WARM_PUSH) -> Iterate:
    """Push the valves towards 0 and 1, then round and fix them, the pairs as loose as before; the
    start moves `push` off the bounds."""
    tol, weights = Ends.tol, (Relaxation.loose, Relaxation.valve, Relaxation.switching)
    parameters = Parameters(*weights, forces=Relaxation.forces)
    most = {"max_iter": schedule.at_most(Ends.valve_iterations)}
    options = warm(Starts.changed_mu, push, tol=tol, **most)
    point = schedule.solve("binary valves", point, parameters, options=options)
    options = warm(Starts.rounded_mu, Starts.rounded, tol=tol, **most)
    parameters, fixed = (
        Parameters(Relaxation.loose, forces=Relaxation.forces),
        schedule.valves(point),
    )
    return schedule.solve("round valves", point, parameters, options=options, fixed=fixed)


def fix(
    schedule: Schedule,
    point: Iterate,
    forces: float | None = None,
    stagnation: Stagnation | None = None,
    **more: Any,
) -> Iterate:
    """Round and fix the valves, the pairs tighter; `forces` is the weight of squared forces,
    `more` are options of IPOPT."""
    options = warm(Starts.changed_mu, Starts.changed, tol=Ends.tol, **more)
    weight = Relaxation.forces if forces is None else forces
    parameters, fixed = Parameters(Relaxation.tight, forces=weight), schedule.valves(point)
    return schedule.solve(
        "fix valves", point, parameters, options=options, fixed=fixed, stagnation=stagnation
    )


def tighten(schedule: Schedule, point: Iterate) -> Iterate:
    """Tighten the pairs to what the certificate asks, with the valves fixed."""
    eps = Relaxation.margin * schedule.final_eps
    parameters = Parameters(eps, proximal=Relaxation.proximal)
    options, fixed = exact(Starts.tighten_mu), schedule.valves(point)
    return schedule.solve("tighten", point, parameters, options=options, fixed=fixed)


def move(schedule: Schedule, start: Iterate, eps: float | None = None, **more: Any) -> Iterate:
    """Release every valve switch by a few nodes and push the valves towards 0 and 1 again, the
    pairs relaxed by `eps`; `more` are options of IPOPT."""
    eps = Relaxation.tight if eps is None else eps
    options = {**warm(Starts.changed_mu, Starts.changed, tol=Ends.tol), **more}
    free = _released(schedule.valves(start))
    weights = Relaxation.valve, Relaxation.switching_moved
    parameters = Parameters(eps, *weights, forces=Relaxation.forces)
    return schedule.solve("move switches", Iterate(start.Y), parameters, options=options, free=free)


def _released(valves: dict[int, np.ndarray]) -> dict[int, Bounds]:
    """Bounds of the valve columns: free near their switches, fixed elsewhere."""
    reach, bounds = Grids.reach, {}
    for column, u in valves.items():
        near = np.zeros(len(u), dtype=bool)
        for k in np.flatnonzero(np.diff(u)):
            near[max(k + 1 - reach, 1) : k + 1 + reach] = True
        bounds[column] = (np.where(near, 0.0, u), np.where(near, 1.0, u))
    return bounds


def refine_grid(schedule: Schedule, coarse: Transcription, point: Iterate) -> Iterate:
    """A coarse plan on the finer grid of `schedule`, with its valves kept.

    Where that takes too long, the valves do not fit the finer grid, and are sought again there.
    """
    start = Iterate(prolong(coarse, schedule.transcription, point.Y))
    longest = schedule.at_most(Ends.misfit_iterations)
    stagnation = Stagnation(Ends.stagnation_iterations, Ends.stagnation_near)
    kept = fix(schedule, start, forces=0.0, stagnation=stagnation, max_iter=longest)
    return kept if kept.solved else seek_again(schedule, coarse, point)


def seek_again(schedule: Schedule, coarse: Transcription, point: Iterate) -> Iterate:
    """The valves of a coarse plan sought on the finer grid of `schedule`."""
    start = Iterate(prolong(coarse, schedule.transcription, point.Y))
    found, most = binary(schedule, start, Starts.changed), schedule.at_most(Ends.valve_iterations)
    return fix(schedule, found, forces=0.0, max_iter=most) if found.solved else found


def prolong(coarse: Transcription, fine: Transcription, Y: np.ndarray) -> np.ndarray:
    """Y (coarse nodes + 1, n) on a finer grid (fine nodes + 1, n): states in between, inputs and
    forces held."""
    at = np.linspace(0.0, coarse.nodes, fine.nodes + 1)
    groups, raised = coarse.layout.slices.items(), coarse.raised(Y)
    finer = np.hstack([_at_nodes(raised[:, part], at, group in HELD) for group, part in groups])
    return fine.raised(finer, -1.0)


# weights rho of the paper's penalty method (eq. 9), and of a ramp that ends there
PENALTIES = {"penalty": (1e4,), "penalty_ramped": (1e1, 1e2, 1e3, 1e4)}
UNRELAXED = 1e6  # a relaxation so wide that the pairs' rows never bind
RAMP_MU = 1e-2  # barrier parameter of the ramp's later solves


def penalise(schedule: Schedule, start: Iterate, method: str) -> Iterate:
    """Solve with penalised pairs and valves; each step of a ramp starts from the last."""
    task, point = schedule.transcription.task, start
    for number, rho in enumerate(PENALTIES[method]):
        weight = rho * task.step / COST_SCALE
        parameters = Parameters(UNRELAXED, valve=weight * task.nodes, pairs=weight)
        options = warm(RAMP_MU) if number else {}
        point = schedule.solve(f"penalty, rho = {rho:g}", point, parameters, options=options)
    return point


CONFIRMED = 1e-7  # scaled violation of the whole robot's rows that needs no further solve
CONFIRM_MU = 1e-7  # barrier parameter of that solve: below the tolerance of a plan solved already


def widen(half: Transcription, whole: Transcription, Y: np.ndarray) -> np.ndarray:
    """Y (nodes + 1, n) of the half robot as Y of the whole one."""
    groups = {g: half.layout.full(Y, g) for g in ("q", "v", "s", "u", "lam")}
    groups["h"] = half.layout.half(Y, "h")
    return whole.layout.pack(groups)


def confirm(schedule: Schedule, half: Transcription, point: Iterate) -> Iterate:
    """A solved plan of the half robot on the whole one, solved again where a row is not met.

    That is rare: what the half robot leaves out is zero by symmetry.
    """
    whole = schedule.transcription
    start = replace(point, Y=widen(half, whole, point.Y), lam_x=None, lam_g=None)
    parameters = Parameters(Relaxation.margin * schedule.final_eps)
    g = np.array(whole.problem.g(start.Y.ravel(), parameters.vector(whole.nodes))).ravel()
    if violation(whole, g) <= CONFIRMED and point.ending is not None:
        schedule.attempts.append(Attempt("confirmed on the whole robot", point.ending, 0))
        return start
    options, fixed = exact(CONFIRM_MU), schedule.valves(start)
    return schedule.solve("whole robot", start, parameters, options=options, fixed=fixed)


def grow(schedule: Schedule, half: Transcription, point: Iterate, guess: Iterate) -> Iterate:
    """A plan of the whole robot, its pairs still a little loose, from one of the half robot for
    what the task asks of both legs alike.

    All switches are released by a few nodes, and rounded again. Coordinates that are zero by
    symmetry, such as the way forward, start from `guess`.
    """
    whole = schedule.transcription
    Y = widen(half, whole, point.Y)
    lost = np.flatnonzero(~half.layout.reduction.B["q"].any(axis=1))
    for group in ("q", "v"):
        columns = whole.layout.slices[group].start + lost
        Y[:, columns] = guess.Y[:, columns]
    longest = schedule.at_most(Ends.relax_iterations)
    options = warm(Starts.rounded_mu, Starts.rounded, max_iter=longest)
    moved = move(schedule, Iterate(Y), Relaxation.loose, **options)
    return fix(schedule, moved) if moved.solved else moved


HELD = ("u", "lam", "h")  # act on the interval before a node


def resumed(transcription: Transcription, trajectory: Trajectory) -> Iterate:
    """The trajectory as a point of the program; another number of nodes is interpolated. Raises
    KembaError when the trajectory lacks a column of the model."""
    t = transcription
    groups = node_groups(t.model, trajectory)
    at = np.linspace(0.0, len(trajectory) - 1, t.nodes + 1)
    steps = {name: _at_nodes(values, at, name in HELD) for name, values in groups.items()}
    steps["h"] = steps["h"] * (len(trajectory) - 1) / t.nodes
    Y = np.zeros(t.shape)
    Y[:, : t.layout.size] = t.layout.pack(steps)
    return Iterate(np.clip(Y, t.lower, t.upper))


def node_groups(model: Model, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """q, v, s, u, lam and the steps h [s] of a trajectory, (rows, n) each."""
    h = np.diff(trajectory.time)
    return {**arrays(model, trajectory), "h": np.concatenate([h[:1], h])[:, None]}


def _at_nodes(values: np.ndarray, at: np.ndarray, held: bool) -> np.ndarray:
    """Rows of `values` at fractional rows `at`, held from the right or linear in between."""
    if held:
        return np.asarray(values[np.ceil(at - 1e-9).astype(int)])
    rows = np.arange(len(values))
    columns = [np.interp(at, rows, column) for column in values.T]
    return np.asarray(np.reshape(columns, (values.shape[1], len(at))).T)
