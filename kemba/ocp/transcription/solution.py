"""A solved program as a trajectory at the nodes, and back."""

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.ocp.transcription.unilateral import rigid_constraints
from kemba.trajectory import Trajectory

FLIES = 1e-3  # N; a foot with less force flies


def to_trajectory(
    transcription: Transcription, Y: np.ndarray, model: Model | None = None
) -> Trajectory:
    """Every quantity of the model at the nodes, from scaled variables `Y` (nodes + 1, n).

    Inputs and forces of a row act on the interval before it (implicit Euler); at the first node
    they are zero. `model`: the same one in a scene with walls, where the program has level ground.
    """
    layout, h = transcription.layout, transcription.h(Y)[:, None]
    x = {g: layout.full(transcription.raised(Y), g) for g in ("q", "v", "s", "u", "lam")}
    if model is not None:
        _slip_along(model, x)
    a, sd = np.zeros_like(x["v"]), np.zeros_like(x["s"])
    a[1:], sd[1:] = np.diff(x["v"], axis=0) / h, np.diff(x["s"], axis=0) / h
    name = transcription.task.name
    return written(model or transcription.model, name, transcription.times(Y), x, a, sd)


def _slip_along(model: Model, x: dict[str, np.ndarray]) -> None:
    """Slip speeds of feet without force are along the ground of the model's own scene."""
    node = model.node
    for foot in rigid_constraints(model, whole(node)):
        if foot.friction is not None:
            slip = ca.Function("slip", [node.q, node.v], [foot.friction.slip])
            along = np.abs(np.array(slip.map(len(x["q"]))(x["q"].T, x["v"].T)).ravel())
            flies = x["lam"][:, foot.force] < FLIES
            flies[0] = False  # there all forces are zero
            x["lam"][flies, foot.friction.speed] = along[flies]


def written(
    model: Model,
    run: str,
    time: np.ndarray,
    x: dict[str, np.ndarray],
    a: np.ndarray,
    sd: np.ndarray,
) -> Trajectory:
    """A plan at `time` (rows,) [s] with q, v, s, u, lam (rows, n) in x, rates `a` of v and `sd` of
    s: with every output of the model, then the groups themselves."""
    node, columns = model.node, {}
    at = [x["q"], x["v"], a, x["s"], sd, x["lam"], x["u"]]
    measured = np.array(node.measure.map(len(time))(*(values.T for values in at), [])).T
    for quantity, values in zip(node.output_quantities, measured.T, strict=True):
        columns[quantity.header] = values
    for name, group in model.groups.items():
        columns |= {q.header: values for q, values in zip(group, x[name].T, strict=True)}
    meta = {"kind": "plan", "run": run, **model.mechanism.scene.dump()}
    return Trajectory(time, columns, meta)


def arrays(model: Model, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """q, v, s, u, lam (rows, n) of a trajectory that names them all. Raises KembaError."""
    rows = len(trajectory)
    return {
        name: np.column_stack([trajectory[q.name] for q in group]) if group else np.zeros((rows, 0))
        for name, group in model.groups.items()
    }
