"""Tables I and II as the bench rigs of configs/rigs measure them on a model of the piston.

    python benchmarks/plant_tables.py [MODEL] [--figures FOLDER]

Prints what `kemba-opt characterise` reads off the locked chamber, the dynamometer and the random
test, beside the paper's values. MODEL is `plant` unless given. `--figures docs/images` draws each
rig as the paper's Fig. 3, 4, 6 and 7 do, with the fitted model in the last.
"""

import argparse
from pathlib import Path

from kemba.plant.characterise import characterise
from kemba.plant.published import as_json
from kemba.plant.rigs import bench_model, load_rig, run_rig
from kemba.plotting import plot_rig
from kemba.plotting.style import save_figure
from kemba.trajectory import Trajectory
from kemba_cli.verbs.characterise import tables

RIGS = ("locked", "volumes", "dynamometer", "random")


def main(model: str, figures: Path | None) -> None:
    data = {name: _logs(name, model) for name in RIGS}
    told = (name for name in RIGS if name != "volumes")  # the same tests as `locked`, in between
    logs = {f"{n}/{test}": log for n in told for test, log in data[n].items()}
    found = characterise(logs, bench_model(model, 0.7e6).mechanism.need_cylinder())
    for _, columns, rows in tables(as_json(found)):
        print()
        for row in (columns, *rows):
            print(" | ".join(row))
    if found.rises:
        print(f"\nfirst-order answer R2 {found.rises.r2:.4f}, eq. 5 R2 {found.rises.r2_linear:.4f}")
    for name in RIGS if figures else ():
        assert figures is not None
        drawn = plot_rig(data[name], effects=found.effects())
        print(save_figure(drawn, figures / f"plant-{name}.png"))


def _logs(rig: str, model: str) -> dict[str, Trajectory]:
    return dict(run_rig(load_rig(rig), lambda supply: bench_model(model, supply)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", nargs="?", default="plant")
    parser.add_argument("--figures", type=Path)
    asked = parser.parse_args()
    main(asked.model, asked.figures)
