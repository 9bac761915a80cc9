"""A rig's log is filtered by what its own rig knows."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.identify.logs.gate import BadData
from kemba.identify.rigs import rig_log
from kemba.trajectory import Trajectory


@pytest.mark.parametrize(("unit", "turn"), [("rad", 2 * np.pi), ("m", np.inf)])
def test_the_filter_knows_the_rate_the_inertia_the_noise_and_the_turn(
    unit: str, turn: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    def none(time: Any, position: Any, others: Any, creep: float, heavy: float = 0.0,
             known: Any = None, turn: float = np.inf) -> None:  # fmt: skip
        asked.update(creep=creep, heavy=heavy, known=known, turn=turn, others=set(others))

    monkeypatch.setattr(rig_log, "filtered", none)
    mechanism = SimpleNamespace(
        rig="drive", logged={"axis/q": unit, "axis/tau": "N"}, sign_speed=0.25
    )
    model: Any = SimpleNamespace(mechanism=mechanism, parameters={"drive_axis.J": (None, 3.0)})
    columns = {f"axis/q [{unit}]": np.zeros(5), "axis/tau [N]": np.ones(5)}
    noise = {"axis/q": 1e-4, "axis/tau": 0.5}
    with pytest.raises(BadData, match="no stretch without gaps"):
        rig_log.prepare(Trajectory(np.arange(5.0), columns, {"noise": noise}), model)
    assert asked == {"creep": 0.25, "heavy": 3.0, "known": {"": 1e-4, "axis/tau": 0.5},
                     "turn": turn, "others": {"axis/tau"}}  # fmt: skip
