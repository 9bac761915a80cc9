"""Starts from other plans: of half the robot for the whole one, of a written run on any grid."""

from dataclasses import replace

import numpy as np

from kemba.model import Model
from kemba.ocp.functions.problem import violation
from kemba.ocp.nlp.ipopt import Iterate, warm
from kemba.ocp.relaxation.schedule import exact, fix, move
from kemba.ocp.relaxation.session import Attempt, Schedule
from kemba.ocp.relaxation.settings import Ends, Relaxation, Starts
from kemba.ocp.transcription.parameters import Parameters
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.transcribe import Transcription
from kemba.trajectory import Trajectory

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
    parameters = Parameters(Relaxation.current().margin * schedule.final_eps)
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
    whole, starts, ends = schedule.transcription, Starts.current(), Ends.current()
    Y = widen(half, whole, point.Y)
    lost = np.flatnonzero(~half.layout.reduction.B["q"].any(axis=1))
    for group in ("q", "v"):
        columns = whole.layout.slices[group].start + lost
        Y[:, columns] = guess.Y[:, columns]
    longest = schedule.at_most(ends.relax_iterations)
    options = warm(starts.rounded_mu, starts.rounded, max_iter=longest)
    moved = move(schedule, Iterate(Y), Relaxation.current().loose, **options)
    return fix(schedule, moved) if moved.solved else moved


HELD = ("u", "lam", "h")  # act on the interval before a node


def resumed(transcription: Transcription, trajectory: Trajectory) -> Iterate:
    """The trajectory as a point of the program; another number of nodes is interpolated.

    Raises KembaError when the trajectory lacks a column of the model.
    """
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
    return np.column_stack([np.interp(at, rows, column) for column in values.T])
