"""Continuing from a written run: its trajectory as a start on any grid."""

from __future__ import annotations

import numpy as np

from kemba.model import Model
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.transcribe import Transcription
from kemba.trajectory import Trajectory

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
