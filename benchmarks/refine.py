"""Replay errors of shipped tasks before and after refining: python benchmarks/refine.py."""

from __future__ import annotations

import sys
import time

from kemba.ocp.phases import refine
from kemba.ocp.plan import plan
from kemba.ocp.task import load_task
from kemba.plant.replay import Replay, replay

CASES = (
    ("jump", ["height=0.35 m"]),
    ("jump", ["height=0.5 m"]),
    ("jump", ["height=0.7 m"]),
    ("max_jump", []),
)


def main(cases: tuple[tuple[str, list[str]], ...]) -> None:
    """One line per case: replay errors and CPU seconds of both plans."""
    for name, overrides in cases:
        task, document = load_task(name, overrides)
        euler = plan(task, document)
        before = replay(euler.model, euler.trajectory)
        busy = time.process_time()
        found = refine(euler.model, task, euler.wishes, euler.trajectory)
        busy = time.process_time() - busy
        title = " ".join([name, *overrides])
        print(f"{title:22} euler  {_errors(before)}  {euler.solve_cpu_s:5.2f} s", flush=True)
        if found.trajectory is None or found.certificate is None:
            print(f"{'':22} radau  {found.message} after {found.iterations} iterations")
            continue
        after = replay(euler.model, found.trajectory)
        print(f"{'':22} radau  {_errors(after)}  {busy:5.2f} s, {found.iterations} iterations, "
              f"{len(found.phases)} phases, dynamics {found.certificate.dynamics:.0e}, bounds "
              f"{found.certificate.bounds:.0e}", flush=True)  # fmt: skip


def _errors(done: Replay) -> str:
    touchdown = done.touchdown_error_s
    late = "     none" if touchdown is None else f"{1e3 * touchdown:+6.2f} ms"
    return f"apex {1e3 * done.apex_error_m:+8.3f} mm, touchdown {late}"


if __name__ == "__main__":
    given = sys.argv[1:]
    main(((given[0], given[1:]),) if given else CASES)
