"""Refining an implicit Euler plan: the same modes, solved again so that it replays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.ipopt import COMMON, SOLVED
from kemba.ocp.mirror import Reduction
from kemba.ocp.phases.constraints import read_constraints
from kemba.ocp.phases.independent import Independent
from kemba.ocp.phases.modes import read_phases
from kemba.ocp.phases.program import Program
from kemba.ocp.phases.radau import RADAU3, RADAU5, Scheme
from kemba.ocp.phases.rules import add_rules
from kemba.ocp.phases.start import start_vector
from kemba.ocp.phases.wishes import add_wishes
from kemba.ocp.task import Task
from kemba.ocp.wishes import Wish
from kemba.trajectory import Trajectory


def build(
    model: Model, task: Task, wishes: Sequence[Wish], plan: Trajectory, reduction: Reduction, scheme: Scheme
) -> tuple[Program, np.ndarray]:
    """The program of a plan's phases and its start."""
    constraints = read_constraints(model, reduction)
    binary = [q.name for q in model.inputs.values() if q.binary]
    u = np.round(np.column_stack([plan[name] for name in binary]))
    kept = reduction.B["u"]
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    half = [j for j in range(kept.shape[1]) if any(kept[i, j] for i in places)]
    first = [places.index(int(np.argmax(np.abs(kept[:, j])))) for j in half]
    nodes = len(plan) - 1
    marks = [w.node(nodes) for w in wishes if w.at is not None]
    phases = read_phases(model, constraints, plan, u[:, first], marks)
    program = Program(model, task, reduction, phases, constraints, scheme)
    x = start_vector(program, plan)
    c = program.columns
    start = Independent({g: x[c.first[g]] for g in ("q", "v", "s")})
    end = Independent({g: x[c.end(nodes)[g]] for g in ("q", "v", "s")})
    add_wishes(program, wishes, start, end)
    add_rules(program, start)
    return program, np.clip(x, program.lower, program.upper)
