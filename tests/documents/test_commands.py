"""Every command on every page: its options exist, and it runs and ends as the page says."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import typer
from documents.pages import ELSEWHERE, PAGES, ROOT, blocks, calls, commands, mentioned
from documents.stories import STORIES, Story

from kemba_cli.main import app

GROUP = typer.main.get_command(app)
TYPED = [page for page in PAGES if commands(page) or mentioned(page)]


@pytest.mark.parametrize("page", TYPED)
def test_commands_fit_the_program(page: str) -> None:
    """Verbs and options that the program has, no more arguments than a verb takes."""
    for line in [*commands(page), *mentioned(page)]:
        for verb, *words in calls(line):
            if verb.startswith("-"):
                continue
            command = GROUP.commands[verb]  # type: ignore[attr-defined]
            context = command.context_class(command, info_name=verb)
            _, left, _ = command.make_parser(context).parse_args(list(words))
            assert left == [], f"{page}: {line}"


@pytest.mark.parametrize("page", TYPED)
def test_studies_that_are_named_exist(page: str) -> None:
    for line in [*commands(page), *mentioned(page)]:
        for script, words in re.findall(r"python (benchmarks/\w+\.py)([^|&]*)", line):
            source = (ROOT / script).read_text(encoding="utf-8")
            for option in re.findall(r"--[\w-]+", words):
                assert f'"{option}"' in source, f"{page}: {script} has no {option}"


def test_every_page_with_commands_is_executed_somewhere() -> None:
    """By a story here, or by another test."""
    typed = {page for page in PAGES if commands(page)}
    assert typed <= {*STORIES, *ELSEWHERE}
    assert not set(STORIES) & set(ELSEWHERE)
    assert set(STORIES) <= set(PAGES)
    assert all((ROOT / test).is_file() for test in ELSEWHERE.values())


def test_lines_are_read_as_they_are_typed() -> None:
    assert "kemba-opt plot" in commands("plan.md")  # without its remark
    assert calls("cd a && .venv/bin/kemba-opt check a.yaml 2>&1 | tail -1") == [["check", "a.yaml"]]
    assert "kemba-opt simulate dynamometer.yaml" in mentioned("plant.md")
    assert not any("RUN" in span for page in PAGES for span in mentioned(page))


def script_of(page: str, story: Story) -> str:
    """The page as one script of shell, which stops at the first line that ends in another way.

    Whole commands within the text, as in tables, come after those of the blocks.
    """
    wanted = [*(g for g in story.given if isinstance(g, str)), *commands(page)]
    spans = (span for span in mentioned(page) if span.startswith("kemba-opt "))
    wanted += [span for span in spans if len(span.split()) > 2]  # `kemba-opt solve` is a name
    lines = []
    for line in wanted:
        if line.startswith(story.skipped):
            continue
        typed = line
        for part, other in story.instead.items():
            typed = typed.replace(part, other)
        codes = next((codes for part, codes in story.ends.items() if part in typed), (0,))
        listed = " ".join(map(str, codes))
        told = shlex.quote(f"{page}: {typed}: not {listed}, but")
        fits = f'case " {listed} " in *" $code "*) ;; *) echo {told} $code; exit 99;; esac'
        lines += [f"echo {shlex.quote('$ ' + typed)}", typed, f"code=$?; {fits}"]
    return "\n".join(lines)


@contextmanager
def cluster(page: str) -> Iterator[dict[str, str]]:
    """The address of a Dask cluster, for the page that needs one."""
    if page != "sweeps.md":
        yield {}
        return
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as one:
        yield {"CLUSTER": one.scheduler_address}


@pytest.mark.nightly
@pytest.mark.parametrize("page", STORIES)
def test_the_commands_of_a_page_run(page: str, tmp_path: Path) -> None:
    """In order, from a folder with what the page's reader has."""
    story = STORIES[page]
    for given in story.given:
        if not isinstance(given, str):
            given(tmp_path)
    own = {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])}
    with cluster(page) as address:
        done = subprocess.run(
            ["bash", "-c", script_of(page, story)],
            cwd=tmp_path,
            env={**os.environ, **own, **address},
            capture_output=True,
            text=True,
        )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.nightly
@pytest.mark.parametrize("page", ["library.md", "README.md"])
def test_the_code_of_a_page_runs(page: str, tmp_path: Path) -> None:
    for code in blocks(page, "python"):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
