"""A log whose channels run by two clocks is put on one of them."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.identify.bench import clocks


@dataclass(frozen=True)
class Log:
    motion: Any
    keep: dict[str, Any] = field(default_factory=dict)
    seen_within: float = 1e-3


@pytest.mark.parametrize(("rate", "last"), [(0.1, 0.9), (-0.1, 1.0)])
def test_beyond_what_the_other_clock_has_seen_nothing_is_kept(
    rate: float, last: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clock that is fast by a tenth ends its log at 10/11 of the true time; one that is slow
    goes on beyond it."""
    monkeypatch.setattr(clocks, "commands_by_one_clock", lambda log, theta: log)
    monkeypatch.setattr(clocks, "motion_by_one_clock", lambda motion, theta: motion)
    time = np.linspace(2.0, 3.0, 101)
    log: Any = Log(SimpleNamespace(time=time), {"piston/F": np.ones(101, bool)})
    found = clocks.without_drift(log, "the valve commands", rate)
    assert time[found.keep["piston/F"]][-1] == pytest.approx(2.0 + last, abs=0.011)
