"""The supply of bench logs that do not tell it: asked for, or said; never one for several."""

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.plant.characterise import tell_supplies
from kemba.plant.rigs import LockedRig, bench_model, run_rig
from kemba.trajectory import Trajectory

SUPPLIES = (0.6e6, 0.7e6, 0.8e6)


def untold(supplies: tuple[float, ...], *left: str) -> tuple[dict[str, Trajectory], list[float]]:
    """Locked tests whose supplies are known here alone, some columns `left` out."""
    rig = LockedRig(name="locked", supplies=supplies, repeats=1)
    logs = dict(run_rig(rig, lambda supply: bench_model("plant", supply), noise=True))
    true = [log.meta.pop("supply") for log in logs.values()]
    return {k: log.select([n for n in log.names if n not in left]) for k, log in logs.items()}, true


def test_levels_of_open_chambers_tell_logs_apart() -> None:
    logs, _ = untold(SUPPLIES)
    with pytest.raises(KembaError, match=r"do not tell their supply; their chambers settle at"):
        tell_supplies(logs, ())
    logs, true = untold(SUPPLIES)
    assert tell_supplies(logs, SUPPLIES[::-1]) == ()
    assert [log.meta["supply"] for log in logs.values()] == true


@pytest.mark.parametrize("pressures", [True, False])
def test_what_is_taken_is_said(pressures: bool) -> None:
    left = () if pressures else ("chamber/extend/P", "chamber/retract/P")
    logs, _ = untold((0.6e6,), *left)
    (said,) = tell_supplies(logs, ())
    assert "taken as 0.7 MPa" in said and ("settle at" in said) is pressures
    assert {log.meta["supply"] for log in logs.values()} == {0.7e6}


def test_what_sidecars_tell_is_kept() -> None:
    logs, _ = untold((0.6e6,))
    for log in logs.values():
        log.meta["supply"] = "0.6 MPa"
    assert tell_supplies(logs, ()) == ()
    assert np.allclose([log.meta["supply"] for log in logs.values()], 0.6e6)
    logs[next(iter(logs))].meta["supply"] = "6 mm"
    with pytest.raises(KembaError, match="supply"):
        tell_supplies(logs, ())
