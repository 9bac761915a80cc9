"""A solved program as a trajectory at the nodes, and back."""

from __future__ import annotations

import numpy as np

from kemba.model import Model
from kemba.ocp.transcribe import Transcription
from kemba.trajectory import Trajectory


def to_trajectory(transcription: Transcription, Y: np.ndarray) -> Trajectory:
    """Every quantity of the model at the nodes. Inputs and forces of a row act on the interval
    before it (implicit Euler); at the first node they are zero."""
    model, layout = transcription.model, transcription.layout
    q, v, s, u, lam = (layout.full(Y, g) for g in ("q", "v", "s", "u", "lam"))
    h = transcription.h(Y)
    a, sd = np.zeros_like(v), np.zeros_like(s)
    a[1:], sd[1:] = np.diff(v, axis=0) / h[:, None], np.diff(s, axis=0) / h[:, None]
    columns: dict[str, np.ndarray] = {}
    node = model.node
    measured = np.array(node.measure.map(len(Y))(q.T, v.T, a.T, s.T, sd.T, lam.T, u.T, [])).T
    for quantity, values in zip(node.output_quantities, measured.T, strict=True):
        columns[quantity.header] = values
    groups = [
        (model.mechanism.coordinates, q),
        (model.mechanism.velocities, v),
        (model.states.values(), s),
        (model.inputs.values(), u),
        (model.forces.values(), lam),
    ]
    for group, values in groups:
        columns |= {c.header: values[:, i] for i, c in enumerate(group)}
    meta = {"kind": "plan", "run": transcription.task.name}
    return Trajectory(transcription.times(Y), columns, meta)


def arrays(model: Model, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """q, v, s, u, lam (rows, n) of a trajectory that names them all. Raises KembaError."""
    groups = {
        "q": model.mechanism.coordinates,
        "v": model.mechanism.velocities,
        "s": model.states.values(),
        "u": model.inputs.values(),
        "lam": model.forces.values(),
    }
    rows = len(trajectory)
    return {
        name: np.column_stack([trajectory[q.name] for q in group]) if group else np.zeros((rows, 0))
        for name, group in groups.items()
    }
