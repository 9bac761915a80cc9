"""A solved program as a trajectory at the nodes, and back."""

import numpy as np

from kemba.model import Model
from kemba.ocp.transcription.transcribe import Transcription
from kemba.trajectory import Trajectory


def to_trajectory(transcription: Transcription, Y: np.ndarray) -> Trajectory:
    """Every quantity of the model at the nodes, from scaled variables `Y` (nodes + 1, n).

    Inputs and forces of a row act on the interval before it (implicit Euler); at the first node
    they are zero.
    """
    layout, h = transcription.layout, transcription.h(Y)[:, None]
    x = {g: layout.full(Y, g) for g in ("q", "v", "s", "u", "lam")}
    a, sd = np.zeros_like(x["v"]), np.zeros_like(x["s"])
    a[1:], sd[1:] = np.diff(x["v"], axis=0) / h, np.diff(x["s"], axis=0) / h
    name = transcription.task.name
    return written(transcription.model, name, transcription.times(Y), x, a, sd)


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
