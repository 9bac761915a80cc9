"""Other solvers on kemba's programs: do they solve them, and in how many iterations?

    python benchmarks/solvers.py nlp/*.casadi --limit 60 --save benchmarks/pages/plan-quality.md

The files are those of `kemba-opt export RUN --nlp`. Each solve has a process of its own, CPU
seconds at most, and the solver's own options, but for its output. `--save` replaces the table of
the page.
"""

import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from block import put_block
from load_program import load

BEGIN, END = "<!-- solvers: written by benchmarks/solvers.py -->", "<!-- end of solvers -->"
FEASIBLE = 1e-6  # scaled violation of rows and bounds of a solution

# name: plugin, its options, whether it takes the exact derivatives of the file
SOLVERS: dict[str, tuple[str, dict[str, Any], bool]] = {
    "IPOPT (MUMPS)": ("ipopt", {"ipopt.print_level": 0, "ipopt.max_iter": 500}, True),
    "uno, preset ipopt": ("uno", {"uno": {"preset": "ipopt", "logger": "SILENT"}}, False),
    "uno, preset filtersqp": ("uno", {"uno": {"preset": "filtersqp", "logger": "SILENT"}}, False),
    "fatrop": ("fatrop", {"fatrop": {"print_level": 0, "max_iter": 500}}, False),
}


def solved(path: str, name: str) -> dict[str, Any]:
    """How one solver ends: its status, iterations, cost, and the worst violation."""
    plugin, options, exact = SOLVERS[name]
    nlp, derivatives, at = load(path)
    options = {**options, "print_time": False, "error_on_fail": False}
    solver = ca.nlpsol("solver", plugin, nlp, {**options, **(derivatives if exact else {})})
    found = solver(**at)
    x, g = np.array(found["x"]).ravel(), np.array(found["g"]).ravel()
    pairs = ((x, at["lbx"], at["ubx"]), (g, at["lbg"], at["ubg"]))
    over = max(float(np.max([low - v, v - high])) for v, low, high in pairs)
    stats = solver.stats()
    count = stats.get("iter_count")
    return {"status": str(stats.get("return_status")), "success": bool(stats.get("success")),
            "iterations": count, "cost": float(found["f"]), "violation": over}  # fmt: skip


def tried(path: str, name: str, limit: int) -> dict[str, Any]:
    """The same in a process of its own with `limit` CPU seconds."""

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))

    command = [sys.executable, __file__, "--one", path, name]
    done = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=bounded)
    if done.returncode < 0:
        return {"status": f"stopped after {limit} CPU seconds", "success": False}
    if done.returncode or not done.stdout:
        last = done.stderr.strip().splitlines() or ["no answer"]
        return {"status": f"error: {last[-1][-90:]}", "success": False}
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def row(path: str, name: str, answer: dict[str, Any]) -> str:
    """One line of the table."""
    good = answer["success"] and answer.get("violation", 1.0) <= FEASIBLE
    cost = f"{answer['cost']:.5g}" if good else ""
    cells = (Path(path).stem, name, "yes" if good else "no", answer.get("iterations") or "",
             cost, answer["status"])  # fmt: skip
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Solve everything and print the table."""
    if sys.argv[1:2] == ["--one"]:
        print("\n" + json.dumps(solved(sys.argv[2], sys.argv[3])))
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", nargs="+")
    parser.add_argument("--limit", type=int, default=60, help="CPU seconds of one solve")
    parser.add_argument("--save", type=Path, help="page whose table is replaced")
    asked = parser.parse_args()
    lines = [
        "| program | solver | solved | iterations | cost | it says |",
        "|---|---|---|---|---|---|",
    ]
    for path in asked.programs:
        for name in SOLVERS:
            lines.append(row(path, name, tried(path, name, asked.limit)))
            print(lines[-1], flush=True)
    lines.append(f"\nCasADi {ca.CasadiMeta.version()}; at most {asked.limit} CPU seconds each.")
    if asked.save is not None:
        put_block(asked.save, BEGIN, END, lines)


if __name__ == "__main__":
    main()
