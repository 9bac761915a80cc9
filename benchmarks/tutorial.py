"""Regenerate docs/tutorial.md: run its commands, put what they print and draw into the page.

    python benchmarks/tutorial.py --room FOLDER [CASE ...]

Commands that have run in FOLDER are not run again, so an interrupted run goes on where it stopped;
cases that have not run yet keep the text they have.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "tutorial.md"
IMAGES = ROOT / "docs" / "images"
COLOURS = 160  # of a figure's palette: enough for type, small enough for a repository
WIDTH = 1100  # pixels
MACHINES = {
    "friction": "{kind: seal_friction, F_c: 9 N}",
    "delay": "{kind: valve_delay, dt: 2 ms}",
    "droop": "{kind: supply_droop, D: 0.06, T: 0.3 s}",
    "nothing": "",
}
RUNS = {
    "low": 'jump.yaml --set "height=0.48 m"',
    "mid": 'jump.yaml --set "height=0.5 m"',
    "high": 'jump.yaml --set "height=0.51 m"',
    "hop": "hop.yaml",
    "drop": "drop.yaml",
}
FITTED = "{low,mid,hop,drop}"


class Room:
    """A folder in which commands run once; `say` names the stream and lines that the page shows."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "done").mkdir(parents=True, exist_ok=True)
        for name, effect in MACHINES.items():
            listed = f"effects:\n  - {effect}\n" if effect else ""
            text = f"name: {name}\nbase: planning\n{listed}"
            (folder / f"{name}.yaml").write_text(text, encoding="utf-8")

    def run(self, name: str, command: str) -> str:
        """What a command prints: its result, or its last remark where it has none."""
        kept = self.folder / "done" / f"{name}.json"
        if kept.is_file():
            record = json.loads(kept.read_text(encoding="utf-8"))
            if record["command"] == command:
                return str(record["shown"])
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        print(f"$ {command}", flush=True)
        if found := re.search(r"solve .*--out (\S+)", command):  # one that is there is kept
            shutil.rmtree(self.folder / found[1], ignore_errors=True)
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env=os.environ | {"PATH": path, "OPENBLAS_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode > 1:  # 1: a plan that another plant would miss is good enough here
            raise SystemExit(f"{command}\n{done.stdout}{done.stderr}")
        shown = "\n".join(line.rstrip() for line in done.stdout.splitlines())
        if "simulate" in command:  # its result is a path; the sentence is a remark
            shown = done.stderr.strip().splitlines()[-1]
        kept.write_text(json.dumps({"command": command, "shown": shown}), encoding="utf-8")
        return shown


def plans(room: Room) -> None:
    """The motions, planned with the paper's model."""
    for name, task in RUNS.items():
        room.run(f"solve-{name}", f"kemba-opt solve {task} --out runs/{name} -q")


def case(room: Room, name: str) -> dict[str, str]:
    """One machine from logs to a new plan: blocks of the page by their marker."""
    machine = "planning" if name == "nothing" else f"{name}.yaml"
    for seed, run in enumerate(RUNS, start=1):
        room.run(
            f"{name}-log-{run}",
            f"kemba-opt simulate runs/{run} --model {machine} --noise --seed {seed} "
            f"--out logs/{name}/{run}",
        )
    logs, held = f"logs/{name}/{FITTED}/*.csv", f"logs/{name}/high/*.csv"
    blocks = {
        "compare": [f"kemba-opt compare {logs} --figure {name}.png -q"],
        "discover": [
            f"kemba-opt discover {logs} --holdout {held} --out answers/{name} --time-limit 900 -q"
        ],
    }
    texts = _shown(room, name, blocks)
    if name != "nothing":
        texts |= _shown(room, name, _loop(room, name, held))
    draw(room, name)
    return texts


def _loop(room: Room, name: str, held: str) -> dict[str, list[str]]:
    """What follows an answer: the error anew, another effect of the ranking, a plan."""
    answer, plan = f"answers/{name}", f"runs/high-{name}"
    after = [
        f"kemba-opt compare {held} -q",
        f"kemba-opt compare {held} --model {answer}/model.yaml --figure {name}-after.png -q",
    ]
    if name == "droop":
        fitted = f"logs/{name}/{FITTED}/*.csv"
        after += [
            f"kemba-opt compare {fitted} --model {m} -q"
            for m in (f"{answer}/model.yaml", f"{name}.yaml")
        ]
    if name == "friction":
        listed = json.loads((room.folder / answer / "answer.json").read_text("utf-8"))
        rows = [row["effect"] for row in listed["ranking"][1:]]
        rival = next(effect for effect in rows if not effect.startswith("sensor_"))
        after += [
            f"kemba-opt adopt {answer} {rival} --out rival.yaml",
            f"kemba-opt compare {held} --model rival.yaml -q",
        ]
    solve = f"kemba-opt solve {RUNS['high']} --model {answer}/model.yaml --out {plan}"
    if name != "droop":
        return {"after": after, "plan": [f"{solve} 2>&1 | tail -1"]}
    execute = f"kemba-opt simulate {{}} --model {name}.yaml --noise --out executed/{{}}"
    loop = [
        execute.format("runs/high", "before"),
        f"{solve} 2>&1 | tail -1",
        execute.format(plan, "after"),
    ]
    return {"after": after, "plan": loop}


def _shown(room: Room, name: str, blocks: dict[str, list[str]]) -> dict[str, str]:
    """Commands and what they print, by marker."""
    texts = {}
    for block, commands in blocks.items():
        lines = []
        for number, command in enumerate(commands):
            shown = room.run(f"{name}-{block}-{number}", command)
            lines.append(f"$ {command}\n{shown}")
        texts[f"{name}-{block}"] = "```console\n" + "\n".join(lines) + "\n```"
    return texts


def draw(room: Room, name: str) -> None:
    """The case's figures that the page shows, small, in docs/images."""
    page = PAGE.read_text(encoding="utf-8")
    answer = room.folder / "answers" / name
    figures = {"compare": room.folder / f"{name}.png"}
    figures |= {n: answer / f"{n}.png" for n in ("heat_map", "missing_force", "ladder")}
    for title, source in figures.items():
        if source.is_file() and f"tutorial-{name}-{title}.png" in page:
            image = Image.open(source).convert("RGB")
            if image.width > WIDTH:
                size = (WIDTH, round(image.height * WIDTH / image.width))
                image = image.resize(size, Image.Resampling.LANCZOS)
            image = image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
            image.save(IMAGES / f"tutorial-{name}-{title}.png", optimize=True)


def summary(room: Room) -> str:
    """What was hidden and what was found, of the cases that have run."""
    lines = [
        "| hidden | verdict | found (95 % interval) | held-out error: drawn, found |",
        "|---|---|---|---|",
    ]
    for name, effect in MACHINES.items():
        file = room.folder / "answers" / name / "answer.json"
        if not file.is_file():
            continue
        answer = json.loads(file.read_text(encoding="utf-8"))
        found = [row for row in answer["ranking"] if row["effect"] in answer["added"]]
        values = "; ".join(
            f"`{row['effect']}` " + ", ".join(_value(p, v) for p, v in row["parameters"].items())
            for row in found
        )
        hidden = re.sub(r"[{}]|kind: ", "", effect) or "nothing"
        errors = ", ".join(_errors(room, name))
        lines.append(f"| {hidden} | {answer['verdict']} | {values or 'none'} | {errors} |")
    return "\n".join(lines)


def _errors(room: Room, name: str) -> list[str]:
    """What `compare` said of the held-out run: of the model as drawn, and as found."""
    texts = []
    for number in range(2):
        kept = room.folder / "done" / f"{name}-after-{number}.json"
        if kept.is_file():
            said = json.loads(kept.read_text(encoding="utf-8"))["shown"]
            texts += re.findall(r"([\d.]+) times the noise", said)[:1]
    return texts


def _value(name: str, value: dict[str, float | str]) -> str:
    unit = "" if value["unit"] == "1" else f" {value['unit']}"
    return f"{name} = {value['value']:.3g}{unit} ({value['low']:.3g} to {value['high']:.3g})"


def write(blocks: dict[str, str]) -> None:
    """Replace what stands between the page's markers."""
    page = PAGE.read_text(encoding="utf-8")
    for name, text in blocks.items():
        begin, end = f"<!-- run: {name} -->", "<!-- end -->"
        head, found, rest = page.partition(begin)
        if not found:
            raise SystemExit(f"{PAGE.name}: no marker {begin}")
        page = f"{head}{begin}\n{text}\n{end}{rest.partition(end)[2]}"
    PAGE.write_text(page, encoding="utf-8")


def main() -> None:
    """Run the cases given, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", choices=[*MACHINES, []], help="all when none is given")
    parser.add_argument("--room", type=Path, required=True, help="folder to work in")
    options = parser.parse_args()
    IMAGES.mkdir(exist_ok=True)
    room = Room(options.room.resolve())
    plans(room)
    for name in options.cases or MACHINES:
        write(case(room, name))
    write({"summary": summary(room)})


if __name__ == "__main__":
    main()
