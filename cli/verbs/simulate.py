"""`kemba-opt simulate`: a run on the plant, or a bench rig, written as logs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kemba_cli.common import Force, newest, put, say

if TYPE_CHECKING:
    from kemba.plant.rigs import Rig


def simulate(
    source: Annotated[
        str | None, typer.Argument(help="Run folder, controller.csv, or rig YAML (the newest run).")
    ] = None,
    model: Annotated[
        str | None, typer.Option(help="Model YAML of the plant; else the task's own.")
    ] = None,
    repeat: Annotated[int, typer.Option(min=1, help="How often to execute the run.")] = 1,
    noise: Annotated[
        bool,
        typer.Option(
            "--noise", help="Add the noise of sensors, and scatter to the times of valves."
        ),
    ] = False,
    policy: Annotated[
        bool, typer.Option("--policy", help="With feedback: the run's policy.npz, made if missing.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same logs.")] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the logs (a new one in the run).")
    ] = None,
    force: Force = False,
) -> None:
    """Execute a run's controller on the plant, as on hardware, and write logs.

    Example: kemba-opt simulate runs/jump-1 --repeat 3 --noise
    """
    from kemba.folders import claimed
    from kemba_cli.next_steps import after_simulate, say_next
    from kemba_cli.progress import SIMULATE, Progress

    source = source or str(newest("controller.csv"))
    if Path(source).suffix in (".yaml", ".yml"):
        from kemba.plant.rigs import load_rig

        rig = load_rig(source)
        with claimed(out, Path("bench") / rig.name, "*.csv", force) as folder:
            answer = _rig(rig, model or "plant", folder, seed, noise)
    else:
        default = (Path(source) if Path(source).is_dir() else Path(source).parent) / "logs"
        progress = Progress(SIMULATE)
        with claimed(out, default, "*.csv", force) as folder, progress:
            answer = _run(source, model, folder, seed, noise, repeat, policy, progress.tell)
    put(answer, "\n".join(answer["logs"] if "runs" in answer else [answer["folder"]]))
    say(answer["sentence"])
    run = Path(source) if Path(source).is_dir() else Path(source).parent
    say_next(after_simulate(answer["logs"], run))


def _run(
    source: str,
    model: str | None,
    out: Path,
    seed: int,
    noise: bool,
    repeat: int,
    policy: bool,
    tell: Callable[[str], None],
) -> dict[str, Any]:
    from kemba.plant.repeat import outcome, plant_of, repeat_run

    plant = plant_of(source, model)
    play, fed_back = None, ""
    if policy:
        from kemba.policy.execute import player_of
        from kemba.scenarios.feedback import policy_of, words_of

        file = policy_of(source, tell)
        play, fed_back = player_of(file, source), f"; {words_of(file)}"
    repeats = repeat_run(source, plant, out, repeat, noise, seed, play=play, tell=tell)
    runs = [r.summary for r in repeats]
    facts = {"model": plant.name, "folder": str(out), "logs": [r["log"] for r in runs]}
    return {**facts, "runs": runs, "sentence": f"{outcome(repeats, plant.name)}{fed_back}"}


def _rig(rig: Rig, model: str, folder: Path, seed: int, noise: bool) -> dict[str, Any]:
    from kemba.plant.rigs import bench_model, write_rig

    logs = write_rig(rig, lambda supply: bench_model(model, supply), folder, seed, noise)
    sentence = f"{len(logs)} tests of the rig {rig.name} on {model}"
    facts = {"model": model, "folder": str(folder), "logs": [str(path) for path in logs]}
    return {**facts, "sentence": sentence}
