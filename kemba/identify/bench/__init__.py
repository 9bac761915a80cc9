"""Identification from bench logs: x(t) is imposed, the force is the answer."""

from __future__ import annotations

from collections.abc import Sequence

from kemba.identify.bench.bench_log import prepare
from kemba.identify.bench.problem import BenchProblem
from kemba.model.model import Model
from kemba.trajectory import Trajectory

__all__ = ["BenchProblem", "bench_problem", "prepare"]


def bench_problem(logs: Sequence[Trajectory], model: Model) -> BenchProblem:
    """The problem of explaining bench logs with `model` and what may be added to it."""
    return BenchProblem(
        [prepare(str(log.meta.get("name", i)), log) for i, log in enumerate(logs)], model
    )
