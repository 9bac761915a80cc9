"""One style of options over all verbs: the same name for the same thing, and the usual ones."""

import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from kemba_cli.main import app

COMMANDS: dict[str, Any] = dict(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
SHORT = {"-q": "quiet", "-v": "verbose", "-h": "help"}
CONTINUES = {"sweep"}  # a folder that is there is continued, not replaced
DRAWS = {"solve", "sweep", "compare", "discover", "characterise"}  # figures beside an answer


def options(command: Any) -> list[Any]:
    """The options of a verb."""
    return [p for p in command.params if p.param_type_name == "option"]


def names(command: Any) -> set[str]:
    """All names of the options of a verb."""
    return {name for o in options(command) for name in (*o.opts, *o.secondary_opts)}


def test_the_verbs_are_found() -> None:
    assert {"solve", "plot", "review", "learn", "map", "discover"} <= set(COMMANDS)


@pytest.mark.parametrize("verb", COMMANDS)
def test_every_verb_takes_the_usual_options(verb: str) -> None:
    assert {"--json", "--quiet", "-q", "--verbose", "-v"} <= names(COMMANDS[verb])


@pytest.mark.parametrize("verb", COMMANDS)
def test_what_writes_can_be_told_where_and_to_replace(verb: str) -> None:
    known = names(COMMANDS[verb])
    if {"--out", "--figure", "--animate"} & known and verb not in CONTINUES:
        assert "--force" in known
    if "--force" in known:
        assert "--out" in known


@pytest.mark.parametrize("verb", COMMANDS)
def test_options_look_alike(verb: str) -> None:
    """Long names in lower case with hyphens, few short ones, a sentence of help, --no-x for x."""
    for option in options(COMMANDS[verb]):
        for name in (*option.opts, *option.secondary_opts):
            assert SHORT.get(name) == option.name or re.fullmatch(r"--[a-z]+(-[a-z]+)*", name)
        assert option.help and option.help[0].isupper() and option.help.endswith("."), option.opts
        if option.is_flag and option.default is True:
            assert [f"--no-{option.opts[0][2:]}"] == option.secondary_opts


@pytest.mark.parametrize("verb", COMMANDS)
def test_figures_are_a_switch_everywhere(verb: str) -> None:
    """`--figure/--no-figure`, where a verb draws figures beside its answer."""
    found = [o for o in options(COMMANDS[verb]) if "--figure" in o.opts]
    assert bool(found) == (verb in DRAWS)
    assert all(o.is_flag and o.secondary_opts == ["--no-figure"] for o in found)


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["a.csv", "--figure", "heat.png"], ["a.csv", "--out", "heat.png"]),
        (["--figure=heat.png", "a.csv"], ["--out", "heat.png", "a.csv"]),
        (["--figure", "a.csv"], ["--figure", "a.csv"]),
        (["a.csv", "--figure", "--json"], ["a.csv", "--figure", "--json"]),
        (["a.csv", "--figure"], ["a.csv", "--figure"]),
    ],
)
def test_compare_reads_the_earlier_form_too(words: list[str], meant: list[str]) -> None:
    """`--figure FILE`, which scripts still write."""
    command = COMMANDS["compare"]

    def read(typed: list[str]) -> dict[str, object]:
        return dict(command.make_context("compare", list(typed)).params)

    assert read(words) == read(meant)
    assert read(words)["logs"] == [Path("a.csv")]


def test_a_name_means_the_same_everywhere() -> None:
    """One option name has one parameter, so that what is learnt at one verb holds for the next."""
    meant: dict[str, set[str]] = defaultdict(set)
    for command in COMMANDS.values():
        for option in options(command):
            for name in option.opts:
                meant[name].add(str(option.name).rstrip("s"))
    several = {name: found for name, found in meant.items() if len(found) > 1}
    assert not several


def test_verbose_tells_the_time_and_tracebacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*args: object) -> None:
        raise RuntimeError("as a test")

    done = CliRunner().invoke(app, ["effects", "seal_friction", "-v"])
    assert done.exit_code == 0 and re.search(r"took \d+\.\d s", done.stderr)
    assert "took" not in CliRunner().invoke(app, ["effects", "seal_friction"]).stderr
    monkeypatch.setattr("kemba.runs.newest_run", broken)
    assert "Traceback" not in CliRunner().invoke(app, ["plot"]).stderr
    assert "Traceback" in CliRunner().invoke(app, ["plot", "--verbose"]).stderr
