"""Regenerate docs/tutorial.md: type its commands, put what they print and draw into the page.

    python benchmarks/tutorial.py --room FOLDER [MACHINE ...]

Commands that have run in FOLDER are not run again, so an interrupted run goes on where it stopped.
With machines named, only their commands run, and the rest of the page stays as it is.
"""

import argparse
import hashlib
import json
import os
import re
import resource
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "tutorial.md"
IMAGES = ROOT / "docs" / "images"
COLOURS = 160  # of a figure's palette: enough for type, small enough for a repository
WIDTH = 1100  # pixels
HIDDEN = {
    "friction": "seal_friction, F_c: 9 N",
    "delay": "valve_delay, dt: 2 ms",
    "droop": "supply_droop, D: 0.06, T: 0.3 s",
    "nothing": "nothing",
}
FENCE = re.compile(r"```(sh|console)\n(.*?)```", re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
WITHIN = 0.1  # by which share a number on the page may differ when it is typed elsewhere
UNLIKELY = 1.0  # %, rows of a ranking below it may change places


@dataclass(frozen=True)
class Typed:
    """A command of the page, and what the page shows below it."""

    command: str
    shown: str = ""


@dataclass(frozen=True)
class Ran:
    """What a command printed; `cpu`: processor time [s]."""

    shown: str
    code: int
    cpu: float


def typed(page: str) -> list[Typed]:
    """The commands of a page in order; a block of shell is one command and shows nothing."""
    found = []
    for language, body in FENCE.findall(page):
        if language == "sh":
            found.append(Typed(body.strip()))
        else:
            found += _console(body)
    return found


def _console(body: str) -> Iterator[Typed]:
    for part in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
        command, _, shown = part.partition("\n")
        yield Typed(command, shown.rstrip("\n"))


class Room:
    """A folder in which every command runs once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "done").mkdir(parents=True, exist_ok=True)

    def run(self, command: str) -> Ran:
        """What a command printed on stdout, now or when it ran. Raises RuntimeError on failure.

        Exit code 1 is an answer: a plan that the simulated robot would miss is good enough here.
        """
        kept = self.folder / "done" / f"{hashlib.sha256(command.encode()).hexdigest()[:16]}.json"
        if kept.is_file():
            record = json.loads(kept.read_text(encoding="utf-8"))
            return Ran(record["shown"], record["code"], record["cpu"])
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        print(f"$ {command}", flush=True)
        before = _children()
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env=os.environ | {"PATH": path, "OPENBLAS_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode > 1:
            raise RuntimeError(f"$ {command}\n{done.stdout}{done.stderr}")
        shown = "\n".join(line.rstrip() for line in done.stdout.splitlines())
        found = Ran(shown, done.returncode, _children() - before)
        record = {"command": command, "shown": shown, "code": found.code, "cpu": found.cpu}
        kept.write_text(json.dumps(record), encoding="utf-8")
        return found


def _children() -> float:
    """Processor time [s] of all finished children."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def differences(page: str, printed: str) -> list[str]:
    """Where what was printed is not what the page shows; numbers may differ by `WITHIN`, or by one
    unit of the last digit shown."""
    ours, theirs = _lines(page), _lines(printed)
    if len(ours) != len(theirs):
        return [f"the page shows {len(ours)} lines, {len(theirs)} were printed: {printed}"]
    return [
        f"the page shows {a!r}, {b!r} was printed"
        for a, b in zip(ours, theirs, strict=True)
        if NUMBER.sub("#", a) != NUMBER.sub("#", b)
        or not all(_near(x, y) for x, y in zip(NUMBER.findall(a), NUMBER.findall(b), strict=True))
    ]


def _lines(text: str) -> list[str]:
    """Lines with single spaces, without effects of a ranking that are unlikely anyway."""
    lines = [" ".join(line.split()) for line in text.splitlines()]
    chances = [re.match(r"([\d.]+) %  ?\S", line) for line in lines]
    return [
        line
        for line, chance in zip(lines, chances, strict=True)
        if chance is None or float(chance[1]) >= UNLIKELY
    ]


def _near(a: str, b: str) -> bool:
    digits = len(a.partition(".")[2]) if "e" not in a else 0
    unit = 10.0**-digits if "e" not in a else 0.0
    return abs(float(a) - float(b)) <= max(WITHIN * abs(float(a)), unit) + 1e-12


def regenerated(page: str, room: Room, machines: Iterable[str] = HIDDEN) -> str:
    """The page with what its commands print; commands of other machines are left alone."""
    left = set(HIDDEN) - set(machines)

    def block(match: re.Match[str]) -> str:
        language, body = match.groups()
        if language == "sh":
            room.run(body.strip())
            return match[0]
        lines = []
        for one in _console(body):
            other = any(name in one.command for name in left)
            shown = one.shown if other else room.run(one.command).shown
            lines.append(f"$ {one.command}" + (f"\n{shown}" if shown else ""))
        return "```console\n" + "\n".join(lines) + "\n```"

    return FENCE.sub(block, page)


def times(page: str, room: Room) -> str:
    """How long the page takes, in words."""
    spent = [(one.command, room.run(one.command).cpu) for one in typed(page)]
    kinds = {"plans": " solve ", "logs": " simulate ", "`compare`": " compare "}
    kinds |= {"`discover`": " discover "}
    parts = [
        f"{sum(cpu for command, cpu in spent if verb in command) / 60.0:.1f} min for {kind}"
        for kind, verb in kinds.items()
    ]
    total = sum(cpu for _, cpu in spent) / 60.0
    return f"Typing all of it takes {total:.0f} minutes of processor time: {', '.join(parts)}."


def draw(room: Room, page: str) -> None:
    """The figures that the page shows, small, in docs/images."""
    from PIL import Image

    for name, title in re.findall(r"images/tutorial-(\w+?)-(\w+)\.png", page):
        folder = room.folder
        source = folder / f"{name}.png" if title == "compare" else folder / "answers" / name
        source = source if title == "compare" else source / f"{title}.png"
        if not source.is_file():
            continue
        image = Image.open(source).convert("RGB")
        if image.width > WIDTH:
            size = (WIDTH, round(image.height * WIDTH / image.width))
            image = image.resize(size, Image.Resampling.LANCZOS)
        image = image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        image.save(IMAGES / f"tutorial-{name}-{title}.png", optimize=True)


def summary(page: str, room: Room) -> str:
    """What was hidden and what was found, of the machines that have run."""
    lines = [
        "| hidden | verdict | found (95 % interval) | held-out error: drawn, found |",
        "|---|---|---|---|",
    ]
    for name, hidden in HIDDEN.items():
        file = room.folder / "answers" / name / "answer.json"
        if not file.is_file():
            continue
        answer = json.loads(file.read_text(encoding="utf-8"))
        found = [row for row in answer["ranking"] if row["effect"] in answer["added"]]
        values = "; ".join(
            f"`{row['effect']}` " + ", ".join(_value(p, v) for p, v in row["parameters"].items())
            for row in found
        )
        after = [t for t in typed(page) if f"compare logs/{name}/high/" in t.command][:2]
        errors = [re.findall(r"([\d.]+) times the noise", room.run(t.command).shown) for t in after]
        told = ", ".join(one[0] for one in errors if one)
        lines.append(f"| {hidden} | {answer['verdict']} | {values or 'none'} | {told} |")
    return "\n".join(lines)


def _value(name: str, value: dict[str, float | str]) -> str:
    unit = "" if value["unit"] == "1" else f" {value['unit']}"
    return f"{name} = {value['value']:.3g}{unit} ({value['low']:.3g} to {value['high']:.3g})"


def put(page: str, name: str, text: str) -> str:
    """The page with `text` between the markers of `name`."""
    head, found, rest = page.partition(f"<!-- run: {name} -->")
    if not found:
        raise SystemExit(f"{PAGE.name}: no marker {name}")
    return f"{head}{found}\n{text}\n<!-- end -->{rest.partition('<!-- end -->')[2]}"


def main() -> None:
    """Run the machines given, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "machines", nargs="*", help=f"of {', '.join(HIDDEN)}; all when none is given"
    )
    parser.add_argument("--room", type=Path, required=True, help="folder to work in")
    options = parser.parse_args()
    room, page = Room(options.room.resolve()), PAGE.read_text(encoding="utf-8")
    page = regenerated(page, room, options.machines or HIDDEN)
    draw(room, page)
    page = put(page, "summary", summary(page, room))
    if not options.machines:
        page = put(page, "times", times(page, room))
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
