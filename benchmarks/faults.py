"""Faults at random moments of the long verbs: results are whole, or completed by the same command.

    python benchmarks/faults.py                        # 5 faults of every verb
    python benchmarks/faults.py --faults 50 --seed 3   # more, others
    python benchmarks/faults.py --only solve
    python benchmarks/faults.py --afresh               # drop the counts of older code first

Signals (kill, end, interrupt) at random moments, full disks at random sizes, a clock that goes
back, and folders that cannot be written; tests/faults says what is checked. Counts are added to
benchmarks/program.json, from which benchmarks/program_page.py writes its page. Exit code 1 when
something was lost or mixed up.
"""

import argparse
import random
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path

from program import add, forget

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from faults.strike import Fault, reference, struck
from faults.verbs import VERBS

SIGNALS = {"killed": signal.SIGKILL, "ended": signal.SIGTERM, "interrupted": signal.SIGINT}


def drawn(rng: random.Random) -> Fault:
    """A fault: four of five are signals."""
    kind = rng.random()
    if kind < 0.8:
        name = rng.choice(list(SIGNALS))
        return Fault(name, SIGNALS[name], rng.uniform(0.05, 1.0))
    if kind < 0.92:
        return Fault("disk full", size=round(10 ** rng.uniform(0.0, 5.5)))
    if kind < 0.96:
        return Fault("clock back", clock=True)
    return Fault("shut", shut=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faults", type=int, default=5, help="of each verb")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", action="append", choices=list(VERBS))
    parser.add_argument("--afresh", action="store_true", help="forget earlier counts of a verb")
    arguments = parser.parse_args()
    bad = 0
    for name in arguments.only or VERBS:
        if arguments.afresh:
            forget("faults", name)
        rng, count = random.Random(f"{name} {arguments.seed}"), Counter[str]()
        with tempfile.TemporaryDirectory() as folder:
            usual = reference(VERBS[name], Path(folder) / "usual")
            for _ in range(arguments.faults):
                found = struck(VERBS[name], drawn(rng), Path(folder) / "work", *usual)
                one = Counter({"faults": 1, found.fault.name: 1})
                one["before the end"] = int(found.exit_code != 0)
                one["wrong"] = int(bool(found.wrong))
                add("faults", name, one)  # at once: a run may be interrupted
                count.update(one)
                if found.wrong:
                    print(f"  {found.fault}: exit {found.exit_code}: {found.wrong}", flush=True)
        bad += count["wrong"]
        print(f"{name}: {', '.join(f'{k} {n}' for k, n in count.items())}", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
