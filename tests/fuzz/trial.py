"""One trial: an input is drawn, written to a file, and held against the rule."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

from hypothesis import strategies as st

from fuzz import sound
from fuzz.files import KINDS, yaml_text
from fuzz.formats import as_file, odd_format, odd_formats
from fuzz.loggers import BINARY, foreign, lost
from fuzz.logs import cells, damaged_log, sidecar, text
from fuzz.rule import Outcome, outcome

MAP = """\
kind: bench
columns:
  time [s]: {source: "time [s]"}
  piston/x [m]: {source: "piston/x [m]"}
  piston/F [N]: {source: "piston/F [N]"}
  valve/extend [1]: {source: "valve/extend [1]"}
  valve/retract [1]: {source: "valve/retract [1]"}
"""
Trial = tuple[Callable[[], st.SearchStrategy[str]], Callable[[str, Path], Outcome]]


def _yaml(content: str, folder: Path) -> Outcome:
    file = folder / "input.yaml"
    file.write_text(content, encoding="utf-8")
    return outcome("check", file)


def _log(verb: str) -> Callable[[str, Path], Outcome]:
    def run(content: str, folder: Path) -> Outcome:
        file = folder / "input.csv"
        file.write_text(content, encoding="utf-8")
        options = {"discover": ["--out", str(folder / "answer"), "--force", "--no-figure"]}
        return outcome(verb, file, *options.get(verb, []))

    return run


def _foreign(content: str, folder: Path) -> Outcome:
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    file = folder / "input.csv"
    file.write_text(content, encoding="utf-8")
    return outcome("check", file, "--map", str(folder / "map.yaml"))


def _sidecar(content: str, folder: Path) -> Outcome:
    file = folder / "input.csv"
    file.write_text(text(cells(sound.bench())), encoding="utf-8")
    (folder / "input.meta.yaml").write_text(content, encoding="utf-8")
    return outcome("check", file)


def _format(content: str, folder: Path) -> Outcome:
    return outcome("check", as_file(content, folder))


def _drafted(content: str, folder: Path) -> Outcome:
    """A map is drafted of a log, and the log is read with it, be it whole or not."""
    file, drafted = as_file(content, folder), folder / "input.map.yaml"
    drafted.unlink(missing_ok=True)
    found = outcome("map", file, "--out", str(drafted))
    if found.broken or not drafted.is_file():
        return found
    return outcome("check", file, "--map", str(drafted))


def _of_program(program: str) -> Callable[[str, Path], Outcome]:
    """The same, and no reading is lost or made up without a word. What mixed-up commands would
    leave is not asked: it takes most of the time, and is the same in all formats."""

    def run(content: str, folder: Path) -> Outcome:
        with patch("kemba.identify.robot.problem.mixed_commands", return_value=()):
            found = _drafted(content, folder)
        silent = "" if found.broken else lost(program, as_file(content, folder))
        return replace(found, broken=f"silent: {silent}") if silent else found

    return run


def _dry_run(content: str, folder: Path) -> Outcome:
    file = folder / "input.yaml"
    file.write_text(content, encoding="utf-8")
    return outcome("solve", file, "--dry-run")


def _seen(content: str, folder: Path) -> Outcome:
    file = folder / "input.csv"
    file.write_text(content, encoding="utf-8")
    return outcome("compare", file, "--what-could-be-seen")


def _bench() -> st.SearchStrategy[str]:
    return damaged_log(cells(sound.bench()))


def _robot() -> st.SearchStrategy[str]:
    return damaged_log(cells(sound.robot()))


# what is tried: where its inputs come from, and what is done with one
TRIALS: dict[str, Trial] = {
    **{kind: (lambda kind=kind: yaml_text(kind), _yaml) for kind in KINDS},  # type: ignore[misc]
    "sidecars": (lambda: sidecar(sound.bench().headers), _sidecar),
    "bench logs": (_bench, _log("check")),
    "mapped logs": (_bench, _foreign),
    "other formats": (odd_formats, _format),
    "foreign logs": (foreign, _drafted),
    "dry runs": (lambda: yaml_text("tasks"), _dry_run),
    "robot logs": (_robot, _log("check")),
    "what could be seen": (_bench, _seen),
    "compare": (_bench, _log("compare")),
    "discover": (_bench, _log("discover")),
}

# one binary format alone, our own and those of other programs: more of what the two kinds of broken
# formats above draw from
FORMATS: dict[str, Trial] = {
    **{f"our {ending}": (lambda ending=ending: odd_format(ending), _format)  # type: ignore[misc]
       for ending in ("npz", "mat", "parquet", "mcap")},
    **{name: (lambda name=name: foreign((name,)), _of_program(name))  # type: ignore[misc]
       for name in BINARY},
}  # fmt: skip
