"""At a high price of slacks the elastic program has the solution of the one without them."""

from pathlib import Path

import numpy as np
import pytest
from plain_task import plain_task

from kemba.ocp import load_task, plan
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.refinement.refine import Refiner, read, reduction_of
from kemba.ocp.refinement.start import solve, warm


def test_the_last_elastic_program_has_the_exact_solution(tmp_path: Path) -> None:
    task, document = load_task(plain_task(tmp_path), ["nodes=24"])
    old = plan(task, document)
    assert old.refined and old.stages is not None
    known = old.model, old.task, old.requirements, old.trajectory
    refiner = Refiner(*known, reduction_of(*known), Control())
    phases = old.stages.phases
    program, _ = refiner.build(phases, old.trajectory, RADAU5)
    start = old.stages.start(program)
    assert start is not None
    for shift in (0.0, 1e-3):  # where it begins makes no difference
        exact, x = refiner.build(phases, (program, start + shift), RADAU5)
        rigid = solve(exact, Iterate(x), warm(200), Control())
        elastic, found = refiner.last_solve(phases, (program, start + shift), RADAU5)
        assert rigid.solved and found.solved
        assert found.objective == pytest.approx(rigid.objective, rel=1e-4)
        assert np.abs(found.Y[: len(x)] - rigid.Y).max() < 0.1
        assert not found.Y[len(x) :].any()
        measured = read(elastic, found).certificate
        assert measured is not None and measured.within(task.tolerances)
