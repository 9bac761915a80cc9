"""Ways to solve programs with complementarity pairs on NOSBENCH, a public set that others wrote.

    git clone https://github.com/nosnoc/nosbench
    python benchmarks/nosbench.py nosbench/problems/casadi --count 40 --results nosbench.jsonl
    python benchmarks/nosbench.py --results nosbench.jsonl --save benchmarks/pages/nosbench.md

Every solve has a process of its own, CPU seconds at most, and is judged by the program's own
functions: *solved* is no violation and no product above 1e-6. Files are drawn at random, half of
them from the larger half; those of `TUNED`, on which figures were chosen, are left out.
The set states no licence: it is run, and not kept here.
"""

import argparse
import json
import multiprocessing
import os
import random
import resource
import time
from collections import defaultdict
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import Record

BEGIN, END = "<!-- written by benchmarks/nosbench.py -->", "<!-- end of nosbench -->"
FEASIBLE, DEARER = 1e-6, 1e-4
COMPARED = ("plain homotopy", "solve_mpcc")  # files on which both were run are counted
METHODS = ("plain homotopy", "schedule of the plans", "solve_mpcc", "Uno")
TUNED = (57, 30, 12)  # seed, and how many files of the smaller and of the larger half


def files_of(folder: Path) -> tuple[list[Path], list[Path]]:
    """The smaller and the larger half of the files."""
    files = sorted(folder.glob("*.json"), key=lambda path: (path.stat().st_size, path.name))
    half = len(files) // 2
    return files[:half], files[half:]


def tuned(folder: Path) -> list[tuple[Path, bool]]:
    """The files that figures were chosen on, and whether they are large."""
    seed, *counts = TUNED
    rng, halves = random.Random(seed), files_of(folder)
    return [(path, large) for half, n, large in zip(halves, counts, (False, True), strict=True)
            for path in rng.sample(half, n)]  # fmt: skip


def drawn(folder: Path, seed: int, count: int) -> list[tuple[Path, bool]]:
    """Files and whether they are large: `count`, half of them large, none that was tuned on."""
    used, rng, chosen = dict(tuned(folder)), random.Random(seed), []
    for half in files_of(folder):
        left = [path for path in half if path not in used]
        rng.shuffle(left)
        chosen.append(left[: count // 2])
    both = zip_longest(*chosen)  # small and large in turn: any part of a run is balanced
    return [(path, large) for pair in both for path, large in zip(pair, (False, True), strict=True)
            if path is not None]  # fmt: skip


def load(path: Path) -> dict[str, Any]:
    """A program of the set: symbols, expressions, bounds, start and parameters."""
    import casadi as ca
    import numpy as np

    data = json.loads(path.read_text())
    x, p = ca.SX.sym("x", len(data["w0"])), ca.SX.sym("p", len(data["p0"]))
    names = {"f": "augmented_objective_fun", "g": "g_fun", "G": "G_fun", "H": "H_fun"}
    parts = {key: ca.Function.deserialize(data[name])(x, p) for key, name in names.items()}
    bounds = {key: np.array(data[name], float).ravel() for key, name in
              (("lbx", "lbw"), ("ubx", "ubw"), ("lbg", "lbg"), ("ubg", "ubg"))}  # fmt: skip
    start, at = np.array(data["w0"], float).ravel(), np.array(data["p0"], float).ravel()
    return {"x": x, **parts, "bounds": bounds, "start": start, "p": (p, at)}


@cache
def methods() -> tuple[dict[str, Any], Any]:
    """The methods, and what judges their points; imports are in nobody's CPU time."""
    import scipy.optimize  # noqa: F401 (solve_mpcc imports it when it needs it)
    from mpcc import on_nosbench, on_schedule

    return {**on_nosbench.METHODS, **on_schedule.METHODS}, on_nosbench.judged


def solved(path: Path, method: str) -> dict[str, Any]:
    """One solve: cost, violation, products, iterations and CPU seconds."""
    known, judged = methods()
    begin = time.process_time()
    given = load(path)
    x, iterations = known[method](given)
    cpu = time.process_time() - begin
    return {**judged(given, x), "iterations": iterations, "cpu": cpu}


def tried(path: Path, method: str, limit: int) -> dict[str, Any]:
    """The same in a process of its own with `limit` CPU seconds."""
    methods()
    fork = multiprocessing.get_context("fork")  # what is imported need not be imported again
    receive, send = fork.Pipe(duplex=False)

    def one() -> None:
        receive.close()
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # MUMPS prints
        try:
            send.send(solved(path, method))
        except Exception as error:  # whatever a method raises is its answer
            send.send({"f": None, "why": f"{type(error).__name__}: {error}"[-120:]})

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = fork.Process(target=one)
    process.start()
    send.close()
    try:
        answer: dict[str, Any] = receive.recv()
    except EOFError:
        answer = {"f": None, "why": f"stopped after {limit} CPU seconds"}
    process.join()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return {"violation": None, "products": None, "cpu": spent, **answer}


def good(row: dict[str, Any]) -> bool:
    """Whether a point is feasible and its products are small."""
    return row["f"] is not None and max(row["violation"], row["products"]) <= FEASIBLE


def table(rows: list[dict[str, Any]]) -> list[str]:
    """The lines of the page for some of the rows."""
    import numpy as np

    from kemba.scenarios.share import wilson

    whole = _whole(rows)

    def share(count: int, of: int) -> str:
        if not of:
            return "none"
        low, high = wilson(count, of)
        return f"{count} of {of} ({low:.0%} to {high:.0%})"

    lines = [
        "| method | solved | dearer than the best by > 1e-4 | cost, relative to the best: median, "
        "worst tenth | CPU s, median | in all |",
        "|---|---|---|---|---:|---:|",
    ]
    best = {name: min((r["f"] for r in of.values() if good(r)), default=None)
            for name, of in whole.items()}  # fmt: skip
    for method in METHODS:
        mine = {name: of[method] for name, of in whole.items() if method in of}
        if not mine:
            continue
        found = {name: row for name, row in mine.items() if good(row)}
        over = [(row["f"] - best[name]) / max(1.0, abs(best[name])) for name, row in found.items()]
        ratio = [1.0 + v for v in over] or [np.nan]
        cpu = [row["cpu"] for row in mine.values()]
        cells = (method, share(len(found), len(mine)),
                 share(sum(v > DEARER for v in over), len(over)),
                 f"{np.median(ratio):.4f}, {np.quantile(ratio, 0.9):.3f}",
                 f"{np.median(cpu):.1f}", f"{sum(cpu):.0f}")  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def page(rows: list[dict[str, Any]]) -> list[str]:
    """All lines: the smaller files, the larger ones, those that were tuned on."""
    from kemba.sweep import machine

    drawn_files = [row for row in rows if not row.get("tuned")]
    groups = {
        "The smaller half": [row for row in drawn_files if not row["large"]],
        "The larger half": [row for row in drawn_files if row["large"]],
        "On which figures were chosen": [row for row in rows if row.get("tuned")],
    }
    lines = []
    for words, of in groups.items():
        if whole := _whole(of):
            lines += [f"{words}, {len(whole)} files:", "", *table(of), ""]
    limits = {method: max(row["limit"] for row in rows if row["method"] == method)
              for method in METHODS if any(row["method"] == method for row in rows)}  # fmt: skip
    seed, there = rows[0]["seed"], rows[0]["there"]
    most = ", ".join(f"{method} {limit}" for method, limit in limits.items())
    lines += [f"Drawn with seed {seed} from {there} files that were there. CPU seconds of one "
              f"solve at most: {most}. On {machine()}."]  # fmt: skip
    return lines


def _whole(rows: list[dict[str, Any]]) -> dict[str, dict[str, dict[str, Any]]]:
    """The answers by file and method, of files on which all that are compared were run."""
    by_file: dict[str, dict[str, dict[str, Any]]] = defaultdict(dict)
    for row in rows:
        by_file[row["file"]][row["method"]] = row
    return {name: of for name, of in by_file.items() if set(COMPARED) <= set(of)}


def main() -> None:
    """Solve what was not solved yet, or print and save the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="problems/casadi of the clone")
    parser.add_argument("--count", type=int, default=40, help="files, half of them large")
    parser.add_argument("--tuned", action="store_true", help="the files figures were chosen on")
    parser.add_argument("--half", choices=("both", "smaller", "larger"), default="both")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=int, default=100, help="CPU seconds of one solve")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS)
    parser.add_argument("--results", type=Path, required=True, help="a line of JSON for each solve")
    parser.add_argument("--save", type=Path, help="page whose tables are replaced")
    asked = parser.parse_args()
    record = Record(asked.results)
    have = record.known("file", "method")
    there = len(list(asked.folder.glob("*.json"))) if asked.folder else 0
    files = []
    if asked.folder is not None:
        files = tuned(asked.folder) if asked.tuned else drawn(asked.folder, asked.seed, asked.count)
    for path, large in files:
        if asked.half not in ("both", "larger" if large else "smaller"):
            continue
        for method in asked.methods:
            if (path.name, method) in have:
                continue
            asks = {"file": path.name, "large": large, "tuned": asked.tuned, "method": method}
            how = {"seed": asked.seed, "there": there, "limit": asked.limit}
            record.add({**asks, **how, **tried(path, method, asked.limit)})
    record.show(page(record.rows), asked.save, BEGIN, END)


if __name__ == "__main__":
    main()
