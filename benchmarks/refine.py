"""Replay errors before and after refining over a fixed list of cases: python benchmarks/refine.py.

One line per case; with arguments one case only: python benchmarks/refine.py jump "height=0.8 m".
"""

import platform
import sys
import time

from kemba.ocp import load_task
from kemba.ocp.certificate.certify import costs
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.refinement import Refined, refine
from kemba.plant.replay import Replay, replay

CASES = (
    ("jump", ["height=0.35 m"]),
    ("jump", []),
    ("jump", ["height=0.6 m"]),
    ("jump", ["height=0.7 m"]),
    ("jump", ["height=0.8 m"]),
    ("jump", ["height=0.9 m"]),
    ("max_jump", []),
    ("hop", []),
    ("drop", []),
    ("jump", ["payload=1 kg"]),
    ("jump", ["payload=1 kg", "height=0.7 m"]),
    ("jump", ["supply=0.6 MPa"]),
    ("jump", ["supply=0.6 MPa", "height=0.7 m"]),
    ("jump", ["supply=0.8 MPa"]),
    ("jump", ["supply=0.8 MPa", "height=0.7 m"]),
    ("jump", ["start.body/x=-5 cm"]),
    ("jump_forward", ["distance=0.1 m"]),
    ("jump_forward", ["distance=0.2 m"]),
    ("jump_forward", []),
    ("jump_forward", ["distance=0.45 m"]),
    ("jump_forward", ["distance=0.6 m"]),
)
HEAD = (
    "| task | Euler: apex, touchdown | CPU | cost | refined: apex, touchdown | CPU more | cost "
    "| iterations |"
)


def main(cases: tuple[tuple[str, list[str]], ...]) -> None:
    """A table in Markdown: errors, CPU seconds and torque integrals of both plans."""
    print(f"{platform.processor() or platform.machine()}, {platform.system()}, one core per solve")
    print(HEAD, "|---" * (HEAD.count("|") - 1) + "|", sep="\n", flush=True)
    for name, overrides in cases:
        task, document = load_task(name, [*overrides, "refine=none"])
        euler = plan(task, document)
        busy = time.process_time()
        found = refine(euler.model, task, euler.requirements, euler.trajectory)
        busy = time.process_time() - busy
        print("|", " ".join([name, *overrides]), "|", _line(euler, found, busy), flush=True)


def _line(euler: Plan, found: Refined, busy: float) -> str:
    before = f"{_errors(replay(euler.model, euler.trajectory))} | {euler.solve_cpu_s:.1f} s | "
    before += f"{euler.cost['torque_squared_integral']:.3g}"
    if found.trajectory is None:
        return f"{before} | {found.ending} | {busy:.1f} s | | {found.iterations} |"
    cost = costs(euler.model, found.trajectory)["torque_squared_integral"]
    after = f"{_errors(replay(euler.model, found.trajectory))} | {busy:.1f} s | {cost:.3g}"
    return f"{before} | {after} | {found.iterations} |"


def _errors(done: Replay) -> str:
    touchdown = done.touchdown_error_s
    late = "" if touchdown is None else f", {1e3 * touchdown:+.2f} ms"
    return f"{1e3 * done.apex_error_m:+.3f} mm{late}"


if __name__ == "__main__":
    given = sys.argv[1:]
    main(((given[0], given[1:]),) if given else CASES)
