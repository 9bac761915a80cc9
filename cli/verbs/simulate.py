"""`kemba-opt simulate`: a run on the plant, or a bench rig, written as logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kemba_cli.common import Json, OwnEffects, Quiet, print_json, say


def simulate(
    source: Annotated[str, typer.Argument(help="Run folder, controller.csv, or rig YAML.")],
    model: Annotated[str, typer.Option(help="Model YAML of the plant.")] = "plant",
    repeat: Annotated[int, typer.Option(min=1, help="How often to execute the run.")] = 1,
    noise: Annotated[
        bool, typer.Option("--noise", help="Noisy sensors, scattering valves.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same logs.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for the logs.")] = None,
    own_effects: OwnEffects = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Execute a run's controller on the plant, as on hardware, and write logs.

    Example: kemba-opt simulate runs/jump-1 --repeat 3 --noise
    """
    if Path(source).suffix in (".yaml", ".yml"):
        answer = _rig(source, model, out, seed, noise)
    else:
        answer = _run(source, model, out, seed, noise, repeat)
    if json:
        print_json(answer)
    else:
        typer.echo("\n".join(answer["logs"] if "runs" in answer else [answer["folder"]]))
        say(answer["sentence"], quiet)


def _run(
    source: str, model: str, out: Path | None, seed: int, noise: bool, repeat: int
) -> dict[str, Any]:
    from kemba.plant.execution.repeat import plant_of, repeat_run

    folder = Path(source) if Path(source).is_dir() else Path(source).parent
    plant = plant_of(source, model)
    repeats = repeat_run(source, plant, out or folder / "logs", repeat, noise, seed)
    runs = [r.summary for r in repeats]
    apex = ", ".join(f"{r['apex_m']:.3f}" for r in runs)
    sentence = f"reached {apex} m on {plant.name}"
    if "landed" in runs[0]:
        worst = max((abs(r["apex_error_m"]) for r in runs), default=0.0)
        landed = sum(r["landed"] for r in runs)
        sentence += f", off the plan by at most {1e3 * worst:.0f} mm; {landed} of {repeat} landed"
    return {
        "model": plant.name,
        "folder": str(out or folder / "logs"),
        "logs": [r["log"] for r in runs],
        "runs": runs,
        "sentence": sentence,
    }


def _rig(source: str, model: str, out: Path | None, seed: int, noise: bool) -> dict[str, Any]:
    from kemba.plant.rig.bench import bench_model, load_rig, write_rig

    rig = load_rig(source)
    folder = out or Path("bench") / rig.name
    logs = write_rig(rig, lambda supply: bench_model(model, supply), folder, seed, noise)
    return {
        "model": model,
        "folder": str(folder),
        "logs": [str(path) for path in logs],
        "sentence": f"{len(logs)} tests of the rig {rig.name} on {model}",
    }
