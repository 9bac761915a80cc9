"""Sweep YAML: mistakes at their line, all at once; cases from what is right."""

from pathlib import Path

import pytest

from kemba.config import shipped_configs
from kemba.errors import ConfigErrors
from kemba.sweep import Case, expand, load_sweep

HEAD = "name: test\nblocks:\n"


def cases(tmp_path: Path, text: str) -> list[Case]:
    path = tmp_path / "s.yaml"
    path.write_text(HEAD + text)
    return expand(*load_sweep(path), tmp_path / "out")


def mistakes(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(ConfigErrors) as caught:
        cases(tmp_path, text)
    lines = [str(error).splitlines()[0] for error in caught.value.errors]
    return [line.removeprefix(str(tmp_path) + "/") for line in lines]


@pytest.mark.parametrize("path", shipped_configs("sweeps").values(), ids=lambda path: path.stem)
def test_shipped_sweeps_are_right(path: Path, tmp_path: Path) -> None:
    sweep, document = load_sweep(path)
    solves = {k: b for k, b in sweep.blocks.items() if b.kind == "solve"}
    found = expand(sweep.model_copy(update={"blocks": solves}), document, tmp_path)
    assert len(found) == sum(block.cases for block in solves.values())
    assert len({case.key for case in found}) == len(found)


def test_the_same_file_gives_the_same_keys(tmp_path: Path) -> None:
    text = "  a: {kind: solve, task: jump.yaml, cases: 3, vary: {height: {low: 0.4, high: 0.5}}}\n"
    first = [case.key for case in cases(tmp_path, text)]
    assert first == [case.key for case in cases(tmp_path, text)]
    assert len({case.problem for case in cases(tmp_path, text)}) == 3
    noisy = text.replace("height", "guess_noise")
    assert len({case.problem for case in cases(tmp_path, noisy)}) == 1  # one problem, three guesses


def test_tasks_beside_the_sweep_and_what_they_set(tmp_path: Path) -> None:
    source = shipped_configs("tasks")["jump.yaml"].read_text()
    (tmp_path / "mine.yaml").write_text(source.replace("0.5 m ", "0.45 m "))
    (case,) = cases(tmp_path, "  a: {kind: solve, task: mine.yaml, set: {nodes: 30}}\n")
    assert case.work["task"]["height"] == 0.45 and case.work["task"]["nodes"] == 30


def test_mistakes_of_the_schema(tmp_path: Path) -> None:
    text = """\
  a: {kind: solve, task: jump.yaml, vary: {height: {low: 0.35 m, high: 0.6 kg}}}
  b: {kind: run}
  c: {kind: execute, task: jump.yaml, run: x}
  d: {kind: solve, task: jump.yaml, cases: 3}
  e: {kind: solve, task: jump.yaml, vary: {height: {low: 0.35 m}}}
"""
    found = mistakes(tmp_path, text)
    assert found[0].startswith("s.yaml:3:44: blocks.a.vary.height: mixes units: kg and m")
    assert found[1] == "s.yaml:4:7: blocks.b.kind: unknown kind 'run'; one of: execute, solve"
    assert "blocks.c: either 'task' or 'run' was expected" in found[2]
    assert "asks for 3 cases, but 'vary' says nothing" in found[3]
    assert "either low and high, or mean and sigma, or values were expected" in found[4]


def test_mistakes_of_the_cases(tmp_path: Path) -> None:
    text = """\
  a:
    kind: solve
    task: jump.yaml
    set: {hieght: 0.5 m}
  b:
    kind: solve
    task: jumpp.yaml
  c:
    kind: solve
    task: jump.yaml
    grid: {supply: [0.7 MPa, 0.09 MPa]}
  d:
    kind: solve
    task: jump.yaml
    grid: {start.body/pich: [0 deg]}
  e:
    kind: execute
    task: jump.yaml
    grid: {effects.seal_frction.F_c: [1 N]}
  f:
    kind: execute
    task: jump.yaml
    grid: {start.front/hp/q: [1 deg]}
"""
    assert mistakes(tmp_path, text) == [
        "s.yaml:6:11: hieght: unknown key; did you mean 'height'?",
        "s.yaml:9:5: jumpp.yaml: no such file; did you mean 'jump.yaml'?",
        "s.yaml:13:12: supply: '0.09 MPa' is out of range; at least 101325 Pa was expected",
        "s.yaml:17:12: start.body/pich: unknown quantity 'body/pich'; did you mean 'body/pitch'?",
        "s.yaml:18:3: effects.seal_frction: no such effect; did you mean 'seal_friction'?",
        "s.yaml:22:3: start.front/hp/q: no such coordinate; did you mean 'front/hip/q'?",
    ]
