"""How good is the default? Forty tasks, each as `solve` plans it and from random starts.

    python benchmarks/quality.py [--starts 20] [--limit 600]   # goes on where the record ends
    python benchmarks/quality.py --part 1/2                   # every second task, for two cores
    python benchmarks/quality.py --save benchmarks/pages/plan-quality.md       # writes the table

A random start has guess noise 0.25 and a seed, as those of `--starts`. It is planned without
refinement first, which is cheap; the three cheapest of a task are refined and executed. The best
one known is the cheapest refined plan, whether or not the plant keeps to it. Results are lines of
benchmarks/quality.jsonl; an interrupted study goes on after the last.
"""

import argparse
import itertools
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from quality_table import RECORD, REFINED, summary, written

from kemba.ocp import load_task, plan
from kemba.ocp.certificate.certify import objective
from kemba.ocp.certificate.status import Status
from kemba.solve import Approach, Listener, best_plan

NOISE = 0.25  # of the guesses of `--starts`
HEIGHTS = (0.36, 0.45, 0.55, 0.65, 0.77, 0.9)  # m
USES = ((0.7, 0.7), (0.6, 0.8), (0.8, 0.62), (0.6, 0.62), (0.8, 0.8))  # duration s, supply MPa
DISTANCES = (0.3, 0.1, 0.6, 0.2, 0.45)  # m
AHEAD = ((0.75, 0.7), (0.8, 0.8))


def tasks() -> list[tuple[str, ...]]:
    """The shipped task and what is changed in it, in an order that spreads over the grid."""
    spot = [_asked("jump.yaml", u, f"height={h} m") for u in USES for h in HEIGHTS]
    ahead = [_asked("jump_forward.yaml", u, f"distance={d} m") for u in AHEAD for d in DISTANCES]
    mixed = itertools.zip_longest(spot[0::3], spot[1::3], spot[2::3], ahead)
    return [asked for group in mixed for asked in group if asked is not None]


def _asked(name: str, use: tuple[float, float], figure: str) -> tuple[str, ...]:
    return name, figure, f"duration={use[0]} s", f"supply={use[1]} MPa"


def default(asked: tuple[str, ...], limit: float) -> dict[str, Any]:
    """The plan that `solve` gives, executed."""
    return _executed(asked, limit, ())


def started(asked: tuple[str, ...], limit: float, seed: int) -> dict[str, Any]:
    """A plan from a random start, not refined."""
    settings = [f"guess_noise={NOISE}", f"seed={seed}", f"solver.time_limit={limit} s"]
    task, document = load_task(asked[0], [*asked[1:], *settings, "refine=none"])
    found = plan(task, document)
    cost = objective(found.model, found.task, found.requirements, found.trajectory)
    solved = found.status is Status.SOLVED
    return {"cost": cost if solved else None, "status": str(found.status)}


def refined(asked: tuple[str, ...], limit: float, seed: int) -> dict[str, Any]:
    """The same refined and executed."""
    return _executed(asked, limit, (f"guess_noise={NOISE}", f"seed={seed}"))


def _executed(asked: tuple[str, ...], limit: float, settings: tuple[str, ...]) -> dict[str, Any]:
    more = [*asked[1:], *settings, f"solver.time_limit={limit} s"]
    made = best_plan(*load_task(asked[0], more), Approach(), Listener())
    found = made.plan
    cost = objective(found.model, found.task, found.requirements, found.trajectory)
    whole = found.refined and found.status is Status.SOLVED
    return {"cost": cost if whole else None, "good": made.good, "start": found.start,
            "status": str(found.status)}  # fmt: skip


def study(asked_for: Sequence[tuple[str, ...]], starts: int, limit: float) -> Iterator[Any]:
    """Rows of what is left to do: the defaults, then a few starts of each task, then the others."""
    done = RECORD.read_text(encoding="utf-8").splitlines() if RECORD.is_file() else []
    known = {(r["task"], r["kind"], r["seed"]): r for r in map(json.loads, done)}

    def left(asked: tuple[str, ...], kind: str, seed: int, run: Callable[..., Any]) -> Any:
        key = (" ".join(asked), kind, seed)
        if key in known:
            return
        begin = time.process_time()
        answer = run(asked, limit, *((seed,) if seed else ()))
        cpu = round(time.process_time() - begin, 2)
        known[key] = {"task": key[0], "kind": kind, "seed": seed, **answer, "cpu_s": cpu}
        yield known[key]

    for asked in asked_for:
        yield from left(asked, "default", 0, default)
    for few in (range(1, 6), range(6, 11), range(11, 16), range(16, 21)):
        for asked in asked_for:
            name = " ".join(asked)
            if few[0] > 1 and not _solved(known, name):
                continue  # no plan from five starts: probably there is none
            for seed in (s for s in few if s <= starts):
                yield from left(asked, "start", seed, started)
            ours = _solved(known, name)
            for row in sorted(ours, key=lambda r: r["cost"])[:REFINED]:
                yield from left(asked, "refined", row["seed"], refined)


def _solved(known: dict[tuple[str, str, int], dict[str, Any]], task: str) -> list[dict[str, Any]]:
    """Starts of a task that gave a plan."""
    return [row for key, row in known.items() if key[:2] == (task, "start") and row["cost"]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--limit", type=float, default=600.0, help="seconds of one plan")
    parser.add_argument("--part", default="1/1", help="which share of the tasks")
    parser.add_argument("--save", type=Path, help="write the table of what is recorded to a page")
    asked = parser.parse_args()
    if asked.save is not None:
        written(asked.save)
        return
    part, parts = map(int, asked.part.split("/"))
    for row in study(tasks()[part - 1 :: parts], asked.starts, asked.limit):
        with RECORD.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row) + "\n")
        print(row, flush=True)
    print("\n".join(summary()))


if __name__ == "__main__":
    main()
