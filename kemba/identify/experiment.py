"""The next test: which one of a menu of rig tests tells the remaining effects apart best."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.files import read_json
from kemba.identify.bench.bench_log import prepare
from kemba.identify.bench.problem import BenchProblem
from kemba.identify.evidence.linear import linearise, time_blocks
from kemba.identify.problem.problem import Array
from kemba.model.spec import load_model
from kemba.plant.rig.rigs import DynamometerRig, LockedRig, RandomRig, Rig
from kemba.settings import BY_HAND, Settings, setting
from kemba.trajectory import Trajectory


class ExperimentSettings(Settings):
    """How the tests of the menu are judged."""

    force_noise: float = setting(
        1.0, "N", "noise of the force sensor", "convention: a usual transducer of a rig"
    )
    position_noise: float = setting(
        1e-5, "m", "noise of the position sensor", "convention: a usual one of a rig"
    )
    rows: float = setting(1000.0, "Hz", "rows per second of the simulated logs", BY_HAND)
    tests: int = setting(12, "1", "most tests of one rig that are simulated to judge it", BY_HAND)
    clear: float = setting(
        5.0,
        "nats",
        "evidence that settles a question",
        "literature: Kass and Raftery 1995, 'very strong' evidence begins at 5 nats",
    )
    rivals: int = setting(4, "1", "effects that are to be told apart", "convention: few")


@dataclass(frozen=True)
class Proposal:
    """A rig, and how many nats it should put between the rivals hardest to tell apart."""

    rig: Rig
    nats: float
    rivals: tuple[str, str]

    @property
    def sentence(self) -> str:
        first, second = self.rivals
        if self.nats < ExperimentSettings.current().clear:
            return (
                f"No test of the menu separates {first} from {second}; "
                f"the best, {self.rig.name}, would gain {self.nats:.1f} nats."
            )
        return f"The test '{self.rig.name}' separates {first} from {second} ({self.nats:.0f} nats)."


def menu(stroke: float) -> list[Rig]:
    """Standard tests of one piston of this stroke [m]."""
    modes = ("extend", "retract", "both", "none")
    slow = DynamometerRig.model_validate(
        {"name": "slow_stroke", "speeds": {m: [0.01, 0.02, 0.05] for m in modes}}
    )
    fast = DynamometerRig.model_validate(
        {"name": "dynamometer", "speeds": {m: [0.1, 0.3, 0.6, 1.0] for m in modes}}
    )
    both_ends = {"positions": [0.0, stroke / 2, stroke]}
    return [
        LockedRig.model_validate({"name": "locked_extend", "chamber": "extend", **both_ends}),
        LockedRig.model_validate({"name": "locked_retract", "chamber": "retract", **both_ends}),
        slow,
        fast,
        RandomRig.model_validate({"name": "random", "duration": 4.0}),
        RandomRig.model_validate({"name": "random_fast", "duration": 4.0, "speed": 1.2}),
    ]


def propose(folder: str | Path, out: Path) -> Proposal:
    """The test that best separates the rivals of an answer, written to `out` as a rig YAML."""
    answer = read_json(Path(folder) / "answer.json")
    rivals = contenders(answer)
    model = load_model(str(answer.get("base") or "planning"), rig=True)
    proposals = [
        p for rig in menu(model.mechanism.stroke) if (p := _judge(rig, model, rivals)) is not None
    ]
    if not proposals:
        names = ", ".join(rivals)
        raise KembaError(str(folder), f"no rig test shows a difference between {names}")
    best = max(proposals, key=lambda p: p.nats)
    rig = {"kind": best.rig.kind, **best.rig.model_dump(mode="json", exclude_defaults=True)}  # type: ignore[attr-defined]
    dump_yaml({"rig": {**rig, "notes": best.sentence}}, out)
    return best


def contenders(answer: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Theta of the first effect of an answer and of its likeliest rivals."""
    rows = {row["effect"]: row for row in answer["ranking"]}
    if not rows:
        raise KembaError("answer.json", "has no ranking", "nothing is left to be separated")
    first = next(iter(rows))
    others = [*rows[first]["equivalent_to"], *(e for e in rows if e != first)]
    chosen = [first, *dict.fromkeys(e for e in others if e in rows)]
    chosen = chosen[: ExperimentSettings.current().rivals]
    return {
        name: {f"{name}.{p}": v["value"] for p, v in rows[name]["parameters"].items()}
        for name in chosen
    }


def _judge(rig: Rig, model: Any, rivals: Mapping[str, Mapping[str, float]]) -> Proposal | None:
    """How well a rig separates the first rival from the one most like it."""
    runs = [prepare(t.meta["name"], t) for t in _logs(rig, model.mechanism.stroke)]
    problem = BenchProblem(runs, model)
    known = {n: t for n, t in rivals.items() if n in problem.candidates}
    if len(known) < 2:
        return None
    first, *others = known
    blocks = time_blocks(problem)
    linear, jacobian, base = linearise(problem, known[first], blocks, tuple(problem.nuisance))
    found = []
    for other in others:
        gap = problem.residual(known[other]) - base
        found.append((_distance(gap, jacobian, linear.width), other))
    nats, nearest = min(found)
    return Proposal(rig, nats, (first, nearest))


def _distance(gap: Array, jacobian: Array, width: Array) -> float:
    """Half the squared gap that nominal figures within their tolerance cannot close."""
    scaled = jacobian * width
    h = np.eye(len(width)) + scaled.T @ scaled
    return 0.5 * float(gap @ gap - (scaled.T @ gap) @ np.linalg.solve(h, scaled.T @ gap))


def _logs(rig: Rig, stroke: float) -> Iterator[Trajectory]:
    """The rig's tests as logs with ideal sensors and no force yet."""
    settings, rng = ExperimentSettings.current(), np.random.default_rng(0)
    for number, test in enumerate(rig.tests(rng, stroke)):
        if number >= settings.tests:
            return
        times = test.times[:: max(1, round(rig.rate / settings.rows))]
        x, _ = test.motion(times)
        noise = settings.force_noise * rng.standard_normal(len(times))
        columns = {
            "piston/x [m]": x + settings.position_noise * rng.standard_normal(len(times)),
            "piston/F [N]": noise,
        }
        for valve in ("extend", "retract"):
            profile = test.valves.get(f"valve/{valve}")
            on = np.zeros(len(times)) if profile is None else np.array([profile(t) for t in times])
            columns[f"valve/{valve} [1]"] = on
        yield Trajectory(times, columns, {"name": test.name})
