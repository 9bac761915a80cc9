"""What the reader of a page has before its first command, and how its commands end."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from documents.pages import ROOT, blocks

from kemba.config import shipped_configs

Given = Callable[[Path], None] | str  # files that are made, or a line of shell


@dataclass(frozen=True)
class Story:
    """A page as it is tried: `given` comes first.

    `skipped`: lines that begin so are executed elsewhere. `instead`: a part of a command -> what is
    typed in its place, where a test has no display, no cluster or not the hours. `ends`: a part of
    a command -> the exit codes it may have; else 0.
    """

    given: tuple[Given, ...] = ()
    skipped: tuple[str, ...] = ()
    instead: Mapping[str, str] = field(default_factory=dict)
    ends: Mapping[str, tuple[int, ...]] = field(default_factory=dict)


def write(name: str, text: str) -> Given:
    """A file with this text."""

    def made(folder: Path) -> None:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")

    return made


def of_the_page(page: str, language: str, **names: int) -> Given:
    """Files from code blocks of a page: name (`_` for the last point) -> number of the block."""

    def made(folder: Path) -> None:
        for name, number in names.items():
            body = blocks(page, language)[number]
            (folder / ".".join(name.rsplit("_", 1))).write_text(body, encoding="utf-8")

    return made


def logs(*names: str) -> Given:
    """Logs of hops of a machine with friction in its seals."""

    def made(folder: Path) -> None:
        from robot_logs import hops
        from twin import catalogue

        found, _ = hops(catalogue.hidden("seal_friction", 1.0), runs=len(names), figures_off=0.01)
        for name, log in zip(names, found, strict=True):
            log.write(folder / name)

    return made


def their_log(folder: Path) -> None:
    """The same, as two other programs write it."""
    from foreign_files import german, logs_out
    from robot_logs import hops
    from twin import catalogue

    log = hops(catalogue.hidden("seal_friction", 1.0), runs=1)[0][0]
    german(log, folder / "their_log.csv")
    logs_out(log, folder / "logsOut.mat")


def drives(folder: Path) -> None:
    """Two days of an axis with friction and damping."""
    from rigs.machines import drive_log

    for seed, name in enumerate(("monday", "tuesday")):
        drive_log(folder / f"{name}.csv", inertia=95.0, coulomb=30.0, viscous=200.0, seed=seed)


def mine(folder: Path) -> None:
    """A task of one's own: the shipped one, copied."""
    shutil.copy(shipped_configs("tasks")["jump.yaml"], folder / "mine.yaml")


FRICTION = "base: planning\neffects:\n  - {kind: seal_friction, F_c: 9 N}\n"
WEAK = "name: mine\nbase: planning\neffects:\n  - {kind: supply_scale, k: 0.95}\n"
PLANNED = (0, 1)  # of a plan on a model that logs have changed: it may fail on the plant
JUMP = "kemba-opt solve jump.yaml --no-figure -q"

LIMITED = "reliability.yaml --time-limit 60"  # the whole sweep takes hours

STORIES: dict[str, Story] = {
    "README.md": Story(
        (mine,),
        skipped=("python3 -m venv",),  # .ci/run installs as these lines say
        ends={"review": (0, 1), "learn": PLANNED, "max_jump": PLANNED},
    ),
    "benchmarks.md": Story(
        instead={
            "benchmarks/solve.py": f"{ROOT}/benchmarks/solve.py",
            "--repeats 5 --save benchmarks/pages/benchmarks.md": "jump --repeats 1",
        },
    ),
    "discovery.md": Story(
        (logs("run_00.csv", "run_01.csv", "run_02.csv", "run_03.csv"),),
        ends={"solve": PLANNED},
    ),
    "effects.md": Story(),
    "extending.md": Story(
        (
            of_the_page("extending.md", "python", my_effects_py=0),
            of_the_page("extending.md", "yaml", **{"with-lip_yaml": 1}),
            "kemba-opt simulate dynamometer.yaml -q",
            "n=1; for f in bench/dynamometer/*.csv; do cp $f bench_$n.csv; n=$((n+1)); done",
        ),
        ends={"solve": PLANNED},
    ),
    "files.md": Story((mine,)),
    "learn.md": Story(
        (write("mine.yaml", WEAK), write("answer/model.yaml", FRICTION), JUMP),
        ends={"learn": PLANNED, "solve --from": PLANNED, "--from": PLANNED},
    ),
    "library.md": Story(),
    "logs.md": Story(
        (their_log, drives, of_the_page("logs.md", "yaml", press_yaml=1, known_yaml=2)),
        instead={"MAP.yaml": "their_log_map.yaml"},
        ends={"review": (0, 1)},
    ),
    "missing.md": Story(
        (
            logs("logs/log-1.csv", "logs/log-2.csv", "logs/log-3.csv"),
            logs("jump_1.csv", "jump_2.csv"),
        ),
        ends={"solve": PLANNED},
    ),
    "plan.md": Story(instead={" --show": ""}),
    "plant.md": Story(("kemba-opt simulate locked.yaml -q",)),
    "policy.md": Story(),
    "review.md": Story(
        (
            logs("bench.csv"),
            JUMP,
            "kemba-opt simulate runs/jump-1 --repeat 2 --noise --out logs -q",
            "kemba-opt discover logs/*.csv --out answer --time-limit 60 -q",
        ),
        ends={"review": (0, 1), "--model answer-1": PLANNED},  # whatever it says of the logs
    ),
    "robots.md": Story(
        (write("mine/model.yaml", blocks("robots.md", "yaml")[0]),),
        skipped=("kemba-opt characterise --model",),  # its logs are those of a rig of one's own
        instead={"mkdir mine": "mkdir -p mine"},
    ),
    "index.md": Story(
        skipped=("python3 -m venv", "source .venv", "pip install"),  # as in the README
    ),
    "sweeps.md": Story(
        instead={"tcp://host:8786": "$CLUSTER", "reliability.yaml": LIMITED},
        ends={"--time-limit": (0, 1)},
    ),
    "tasks.md": Story((mine,), instead={"--robust 60": "--robust 2"}),
    # how far one second comes depends on the machine, and so does what is continued from there
    "why-not.md": Story(ends={"--time-limit 1": (1,), "--resume": PLANNED}),
}
