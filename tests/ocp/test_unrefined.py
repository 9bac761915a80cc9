"""What a plan is called that could not be refined."""

from unittest.mock import patch

import pytest
from plain_task import plain_task

from kemba.ocp import Plan, load_task, plan
from kemba.ocp.certificate.status import Status
from kemba.ocp.phases.settings import Refining


@pytest.fixture(scope="module")
def unrefined(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A plan whose refinement is given three iterations."""
    task, document = load_task(plain_task(tmp_path_factory.mktemp("plain")), ["nodes=24"])
    with patch.object(Refining, "iterations", 3):
        return plan(task, document)


def test_a_plan_that_cannot_be_refined_is_not_solved(unrefined: Plan) -> None:
    assert unrefined.status is Status.ACCEPTABLE and not unrefined.refined
    assert unrefined.sentence.startswith("acceptable: apex 0.350 m, ")
    assert "not refined (the limit of iterations was reached)" in unrefined.sentence
    assert "whose air forces are inexact" in unrefined.sentence
    assert "refine=none" in unrefined.sentence and "solved" not in unrefined.sentence


def test_its_implicit_euler_plan_is_kept(unrefined: Plan) -> None:
    assert unrefined.certificate.within(unrefined.task.tolerances)
    assert len(unrefined.trajectory.time) == 25
