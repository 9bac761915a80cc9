"""Sensor faults are written once: simulator, bench and robot identification read one class."""

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest
from robot_logs import hops

from kemba.effects import BY_KIND
from kemba.effects.sensors import SensorBias, SensorEffect
from kemba.effects.series import Series
from kemba.identify.bench.problem import bench_problem
from kemba.identify.robot.problem import robot_problem
from kemba.model import load_model
from kemba.plant.repeat import Sensors, take_log
from kemba.quantity import Param
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]


class SensorDrift(SensorEffect):
    """A zero that wanders off at a constant rate."""

    kind: Literal["sensor_drift"] = "sensor_drift"
    rate: Annotated[float, Param("s-1", 1.0, doc="of the zero, in the channel's unit")] = 0.0

    equation: ClassVar[str] = "measured = true + rate t"
    source: ClassVar[str] = "a test"
    off: ClassVar[dict[str, float]] = {"rate": 0.0}
    stage: ClassVar[Literal["clock", "gain", "zero"]] = "zero"

    def sized(self, sigma: float) -> dict[str, Param]:
        return {"rate": Param("s-1", 5.0 * sigma)}

    def measured(self, true: Series) -> Series:
        return self._added(true, self.rate)

    def undone(self, measured: Series) -> Series:
        return self._added(measured, -self.rate)

    def _added(self, to: Series, rate: float) -> Series:
        moved = to.plus(rate * to.time)
        if not to.rates:
            return moved
        return replace(moved, rates=(to.rates[0] + rate, *to.rates[1:]))


@pytest.fixture
def drift(monkeypatch: pytest.MonkeyPatch) -> None:
    """The catalogue with one more kind of fault."""
    monkeypatch.setattr(BY_KIND, "_kinds", {**BY_KIND, "sensor_drift": SensorDrift})
    monkeypatch.setattr(BY_KIND, "_union", None)


def drifted(log: Trajectory, header: str, rate: float) -> Trajectory:
    """The log as a drifting sensor writes it, by the simulator's own sensors."""
    channel = header.split(" [")[0]
    fault = SensorDrift(channel=channel, rate=rate)
    seen = take_log(log, Sensors(), np.random.default_rng(0), [fault])
    return log.with_columns({header: seen[channel]})


@pytest.mark.usefixtures("drift")
@pytest.mark.parametrize("header", ["piston/F [N]", "piston/x [m]"])
def test_one_class_brings_a_fault_to_simulator_and_bench(bench_log: BenchLog, header: str) -> None:
    rate = 8.0 if "[N]" in header else 0.012
    log = drifted(bench_log(), header, rate)
    problem = bench_problem([log], load_model(rig=True))
    name = f"sensor_drift:{header.split(' [')[0]}"
    assert problem.candidates[name].sensor
    left, before = (problem.residual(t) for t in ({f"{name}.rate": rate}, {}))
    assert np.mean(left[200:] ** 2) < 1.3 < 0.7 * np.mean(before[200:] ** 2)


@pytest.mark.usefixtures("drift")
def test_one_class_brings_a_fault_to_the_robot() -> None:
    pytest.importorskip("numba")
    (log, *_), _ = hops(runs=1)
    name, rate = "sensor_drift:body/pitch", 0.1
    model = load_model("planning")
    sound = robot_problem([log], model)
    problem = robot_problem([drifted(log, "body/pitch [rad]", rate)], model)
    theta = {f"{name}.rate": rate}
    assert problem.candidates[name].sensor and problem.is_straight(f"{name}.rate")
    assert np.mean(problem.residual({}) ** 2) > 1.2 * np.mean(sound.residual({}) ** 2)
    # contacts of both are read from the motion that sensors without the fault would have seen
    problem, sound = problem.relinearise(theta), sound.relinearise({f"{name}.rate": 0.0})
    clean = np.mean(sound.residual({}) ** 2)
    assert np.mean(problem.residual(theta) ** 2) == pytest.approx(clean, rel=0.05)


def test_a_fault_on_the_models_list_is_in_the_prediction(bench_log: BenchLog) -> None:
    log = bench_log()
    off = log.with_columns({"piston/F [N]": log["piston/F"] + 12.0})
    fault = SensorBias(channel="piston/F", b=12.0)
    told = bench_problem([off], load_model(extra=[fault], rig=True))
    right = bench_problem([log], load_model(rig=True)).residual({})
    assert told.residual({}) == pytest.approx(right)
    assert fault.name not in told.candidates
    assert told.nuisance["sensor_bias:piston/F.b"] == pytest.approx((12.0, 1.2))
