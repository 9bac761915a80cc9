"""How far each motion is planned and certified: python benchmarks/motions.py [FILE.yaml ...]

Without arguments the shipped motions beside the jumps. Everything from a guess (`--cold`). One row
each: how far it came, cost, CPU seconds of the solves, and the sentence of `solve`.
"""

import sys

from kemba.config import shipped_configs
from kemba.errors import KembaError
from kemba.ocp import load_task
from kemba.solve import Approach, Listener, best_plan

JUMPS = ("jump", "jump_forward", "hop", "drop", "stand", "max_jump")


def row(file: str) -> str:
    """One motion, as a row of a table."""
    task, document = load_task(file, ["solver.time_limit=900 s"])
    try:
        best = best_plan(task, document, Approach(), Listener())
    except KembaError as error:
        return f"| {task.name} | refused | | | {error} |"
    found = best.plan
    verdicts = best.judged.verdicts if best.judged else {}
    steps = {
        "plan on nodes": bool(found.status.plan),
        "refined": found.refined,
        "own replay": "replay" in verdicts and verdicts["replay"].good,
        "table": "table_replay" in verdicts and verdicts["table_replay"].good,
        "plant": "plant_replay" in verdicts and verdicts["plant_replay"].good,
    }
    reached = [name for name, good in steps.items() if good]
    cells = [
        task.name,
        ", ".join(reached),
        f"{found.cost.get('torque_squared_integral', float('nan')):.2f}",
        f"{found.solve_cpu_s:.0f}",
        best.result["sentence"][:200],
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    shipped = shipped_configs("tasks")
    files = sys.argv[1:] or [str(path) for name, path in shipped.items() if name[:-5] not in JUMPS]
    print("| motion | reached | torque² [N².m².s] | CPU [s] | sentence |\n|---|---|---|---|---|")
    for file in files:
        print(row(file), flush=True)


if __name__ == "__main__":
    main()
