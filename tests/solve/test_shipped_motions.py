"""Every shipped task is good from nothing, but those that say that they are not."""

import pytest

from kemba.config import shipped_configs
from kemba.ocp import load_task
from kemba.solve import Approach, Listener, best_plan

NOT_YET = "No good plan from nothing yet"
GOOD = [name for name, path in shipped_configs("tasks").items() if NOT_YET not in path.read_text()]


@pytest.mark.nightly
@pytest.mark.parametrize("name", GOOD)
def test_a_shipped_motion_is_good(name: str) -> None:
    best = best_plan(*load_task(name), Approach(), Listener())
    assert best.good, best.result["sentence"]
