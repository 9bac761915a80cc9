"""When commands rose before forces are missed, by leg."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.identify.compare.force_profiles import lags
from kemba.identify.robot import forces


def test_every_leg_has_its_own_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two legs, of which one commands 1 and the other 2, at every lag."""
    count = len(lags()) - 1
    sent = {"front/hip/tau": (1.0,), "rear/hip/tau": (2.0,)}
    monkeypatch.setattr(forces, "changes", lambda log, legs: sent)
    monkeypatch.setattr(
        forces, "risen", lambda size, time: size + 0.01 * np.tile(np.arange(count), (len(time), 1))
    )
    log = SimpleNamespace(time=np.arange(5.0))
    batch = SimpleNamespace(
        resampled=[log], valid=np.ones((5, 1), bool), pad=lambda runs, _: np.stack(runs, axis=1)
    )
    state: Any = SimpleNamespace(batch=batch, physics=SimpleNamespace(legs=("front", "rear")))
    found = forces._after(state, "hip/tau")
    assert found.shape == (5, 1, 2, count)
    for leg, size in enumerate((1.0, 2.0)):
        assert found[3, 0, leg] == pytest.approx(size + 0.01 * np.arange(count))
