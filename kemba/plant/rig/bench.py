"""Running a rig's tests on a model of the piston and writing bench logs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from kemba.config import Document, Section, find_config, load_yaml, parse
from kemba.model import Model, load_model
from kemba.plant.execution.sensors import Sensors, take_log
from kemba.plant.rig.imposed import drive
from kemba.plant.rig.rigs import AnyRig, Rig
from kemba.trajectory import Trajectory

FORCE_NOISE = 0.3  # N, 1 sigma of a bench force transducer


class RigFile(Section):
    """A rig YAML: `rig` holds one of the rigs."""

    rig: AnyRig


def load_rig(name: str | Path) -> Rig:
    """The rig of a YAML file, or a shipped one. Raises KembaError with every mistake."""
    return parse_rig(load_yaml(find_config(name, "rigs")))


def parse_rig(document: Document) -> Rig:
    """The rig a document describes. Raises KembaError with every mistake."""
    return parse(document, RigFile).rig


def bench_model(name: str | Path, supply: float) -> Model:
    """The bench piston of a model YAML at a supply pressure [Pa]."""
    return load_model(name, supply=supply, rig=True)


def run_rig(
    rig: Rig, model: Callable[[float], Model], seed: int = 0, noise: bool = False
) -> Iterator[tuple[str, Trajectory]]:
    """Names and bench logs of a rig's tests; `model` gives the piston at a supply pressure [Pa].

    Deterministic by `seed`.
    """
    rng = np.random.default_rng(seed)
    models: dict[float, Model] = {}
    sensors = Sensors(noise={"F": FORCE_NOISE, "x": 1e-5, "P": 1e3} if noise else {})
    first = models[rig.supplies[0]] = model(rig.supplies[0])
    for test in rig.tests(rng, first.mechanism.stroke):
        if test.supply not in models:
            models[test.supply] = model(test.supply)
        piston = models[test.supply]
        truth = drive(piston, test.motion, test.valves, test.times)
        log = take_log(truth, sensors, rng, piston.effects)
        log.meta |= {"kind": "bench", "rig": rig.name, "supply": test.supply, **test.facts}
        yield test.name, log


def write_rig(
    rig: Rig, model: Callable[[float], Model], out: str | Path, seed: int = 0, noise: bool = False
) -> list[Path]:
    """Run a rig and write one log per test; the paths in order."""
    paths = []
    for name, log in run_rig(rig, model, seed, noise):
        path = Path(out) / f"{name}.csv"
        log.write(path)
        paths.append(path)
    return paths
