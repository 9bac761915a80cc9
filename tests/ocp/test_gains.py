"""What goals that are to be large or small weigh in the cost, which trades them."""

from types import SimpleNamespace

import numpy as np
import pytest
from ocp.toys import Push, bead

from kemba.config import Document
from kemba.model import Model
from kemba.ocp.certificate.certify import gains
from kemba.ocp.planned import warnings
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.trajectory import Trajectory

TIME = np.linspace(0.0, 1.0, 5)
PLAN = Trajectory(TIME, {"body/x [m]": TIME, "body/vx [m.s-1]": 2.0 - TIME}, {})
FAR = {"quantity": "body/x", "at": "end", "maximise": True}
SLOW = {"quantity": "body/vx", "at": "middle", "minimise": True}


def made(**goals: object) -> SimpleNamespace:
    document = Document({"start": {"body/x": 0.0}, "goals": goals, "duration": 1.0, "nodes": 4})
    task = Task.model_validate(document.data)
    asked = resolve(task, Model(bead(), [Push()]), document)
    return SimpleNamespace(requirements=asked, trajectory=PLAN)


def test_each_goal_says_what_it_takes_from_the_cost() -> None:
    plan = made(far=FAR, slow=SLOW)
    scales = {r.quantity.name: r.scale for r in plan.requirements if r.aim}
    found = gains(plan.requirements, PLAN)
    assert found == pytest.approx(
        {
            "far (body/x)": 30.0 * 1.0 / scales["body/x"],
            "slow (body/vx)": -30.0 * 1.5 / scales["body/vx"],
        }
    )
    (said,) = warnings(plan)
    assert said.startswith("goals lower the cost [N2.m2.s]: far (body/x) by ")
    assert " and slow (body/vx) by -" in said


def test_one_goal_alone_is_traded_with_none() -> None:
    assert warnings(made(far=FAR)) == []
