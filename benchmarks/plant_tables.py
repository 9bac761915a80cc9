"""Tables I and II as the bench rigs of configs/rigs measure them on a model of the piston.

    python benchmarks/plant_tables.py [MODEL]

Prints what `kemba-opt characterise` reads off the locked chamber, the dynamometer and the random
test, beside the paper's values. MODEL is `plant` unless given.
"""

from __future__ import annotations

import sys

from kemba.plant import tables
from kemba.plant.bench import bench_model, load_rig, run_rig
from kemba.plant.characterise import characterise

RIGS = ("locked", "dynamometer", "random")


def main(model: str) -> None:
    logs = {
        f"{name}/{test}": log
        for name in RIGS
        for test, log in run_rig(load_rig(name), lambda supply: bench_model(model, supply))
    }
    found = characterise(logs)
    for columns, rows in (
        (tables.RISE_COLUMNS, tables.rise_rows(found)),
        (tables.FORCE_COLUMNS, tables.force_rows(found)),
        (tables.CHECK_COLUMNS, tables.check_rows(found)),
    ):
        print()
        for row in (columns, *rows):
            print(" | ".join(row))
    if found.rises:
        print(f"\nfirst-order answer R2 {found.rises.r2:.4f}, eq. 5 R2 {found.rises.r2_linear:.4f}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "plant")
