"""YAML to checked data: every mistake at its line, all at once."""

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, model_validator

from kemba.config import (
    apply_overrides,
    dump_yaml,
    find_config,
    load_yaml,
    parse,
    shipped_configs,
)
from kemba.config.document import Document, load_text
from kemba.errors import ConfigErrors, KembaError
from kemba.quantity import Param


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class HipFriction(Part):
    kind: Literal["hip_friction"] = "hip_friction"
    on: str | list[str] = "hip"
    T_c: Annotated[float, Param("N.m", lower=0.0)]


class EndCushion(Part):
    kind: Literal["end_cushion"] = "end_cushion"
    c: Annotated[float, Param("N.s.m-1")] = 300.0


Length = Annotated[float, Param("m")]


class Goals(Part):
    apex: Length | None = None
    bounds: dict[str, tuple[Length, Length]] = {}


class Jump(Part):
    nodes: int = Field(100, gt=1)
    goals: Goals = Goals()
    method: Literal["penalty", "relaxation"] = "relaxation"
    effects: list[Annotated[HipFriction | EndCushion, Field(discriminator="kind")]] = []
    notes: dict[str, float | str] = {}

    @model_validator(mode="after")
    def _lucky(self) -> "Jump":
        if self.nodes == 7:
            raise ValueError("7 nodes are unlucky")
        return self


BAD = """\
nodes: many
goals:
  apx: 0.5 m
  apex: 3 kg
  bounds: {z: [1 m, 2 s], x: 3}
method: penelty
effects:
  - kind: hip_frction
  - {kind: hip_friction, T_c: -3, on: 5}
  - {kind: hip_friction}
  - T_c: 3
  - 7
nods: 3
"""

EXPLAINED = """\
jump.yaml:1:1: nodes: 'many' is of the wrong kind; a whole number was expected
    nodes: many
    ^
jump.yaml:3:3: goals.apx: unknown key; did you mean 'apex'?
      apx: 0.5 m
      ^
jump.yaml:4:3: goals.apex: '3 kg' is a mass; a length such as '0.5 m' was expected
      apex: 3 kg
      ^
jump.yaml:5:21: goals.bounds.z[1]: '2 s' is a time; a length such as '0.5 m' was expected
      bounds: {z: [1 m, 2 s], x: 3}
                        ^
jump.yaml:5:27: goals.bounds.x: '3' is of the wrong kind; a list was expected
      bounds: {z: [1 m, 2 s], x: 3}
                              ^
jump.yaml:6:1: method: 'penelty' is not allowed; did you mean 'penalty'?
    method: penelty
    ^
jump.yaml:8:5: effects[0].kind: unknown kind 'hip_frction'; did you mean 'hip_friction'?
      - kind: hip_frction
        ^
jump.yaml:9:26: effects[1].T_c: '-3' is out of range; at least 0 N.m was expected
      - {kind: hip_friction, T_c: -3, on: 5}
                             ^
jump.yaml:9:35: effects[1].on: '5' is of the wrong kind; a text or a list was expected
      - {kind: hip_friction, T_c: -3, on: 5}
                                      ^
jump.yaml:10:5: effects[2].T_c: missing; a torque such as '12 N.m' was expected
      - {kind: hip_friction}
        ^
jump.yaml:11:5: effects[3].kind: missing; it says what this item is
      - T_c: 3
        ^
jump.yaml:12:5: effects[4]: '7' is of the wrong kind; a group of keys was expected
      - 7
        ^
jump.yaml:13:1: nods: unknown key; did you mean 'nodes'?
    nods: 3
    ^"""


def message(text: str) -> str:
    """What is said about a YAML text."""
    with pytest.raises(KembaError) as caught:
        parse(load_text(text, "jump.yaml"), Jump)
    return str(caught.value)


def test_all_mistakes_at_their_places() -> None:
    assert message(BAD) == EXPLAINED


def test_good_files_and_dicts() -> None:
    text = "goals: {apex: 50 cm}\neffects:\n  - {kind: hip_friction, T_c: 0.6 N.m, on: [front]}\n"
    expected = Jump(goals=Goals(apex=0.5), effects=[HipFriction(T_c=0.6, on=["front"])])
    assert parse(load_text(text, "jump.yaml"), Jump) == expected
    assert parse({"goals": {"apex": "0.5 m"}}, Jump).goals.apex == 0.5


def test_mistakes_without_a_line() -> None:
    assert message("nodes: 7\n") == "jump.yaml: 7 nodes are unlucky"
    assert message("") == "jump.yaml: is empty; keys such as nodes, goals, method, effects, notes"
    assert message("[1]") == "jump.yaml: a list is of the wrong kind; a group of keys was expected"
    with pytest.raises(KembaError, match=r"^goals.apx: unknown key; did you mean 'apex'\?$"):
        parse({"goals": {"apx": 1}}, Jump)


@pytest.mark.parametrize(
    ("text", "start"),
    [
        ("a: [1, 2\nb: 3\n", "jump.yaml:2:2: is not valid YAML: did not find expected ','"),
        ("a:\n\tb: 1\n", "jump.yaml:2:1: is not valid YAML: found character that"),
        ("a: *none\n", "jump.yaml:1:4: the alias '*none' has no anchor"),
        (
            "a: !!python/name:os.system x\n",
            "jump.yaml:1:4: the tag '!!python/name:os.system' is not",
        ),
        ("a: 1\n---\nb: 1\n", "jump.yaml:2:1: a second document begins here"),
        ("&a [*a]", "jump.yaml:1:5: the alias '*a' contains itself"),
        ("a: \x01", "jump.yaml: is not valid YAML: unacceptable character"),
    ],
)
def test_syntax_errors(text: str, start: str) -> None:
    assert message(text).startswith(start)


def test_all_duplicate_keys() -> None:
    told = message("nodes: 1\nnodes: 2\ngoals:\n  apex: 1\n  apex: 2\n").splitlines()
    assert told[0] == "jump.yaml:2:1: nodes: this key stands twice; its first value is in line 1"
    assert (
        told[3] == "jump.yaml:5:3: goals.apex: this key stands twice; its first value is in line 4"
    )


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match="No such file"):
        load_yaml(tmp_path / "none.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(KembaError, match="is not a UTF-8 text"):
        load_yaml(tmp_path / "binary.yaml")


def document() -> Document:
    text = "nodes: 10\ngoals:\n  apex: 1\neffects:\n  - &a {kind: hip_friction, T_c: 1}\n  - *a\n"
    return load_text(text, "jump.yaml")


def test_overrides() -> None:
    options = ["nodes=20", "goals.apex=0.5 m", "effects.0.T_c=3", "effects[1].on=[front, rear]"]
    jump = parse(apply_overrides(document(), options), Jump)
    assert (jump.nodes, jump.goals.apex) == (20, 0.5)
    first, second = jump.effects
    assert isinstance(first, HipFriction) and isinstance(second, HipFriction)
    assert (first.T_c, second.T_c, second.on) == (3.0, 1.0, ["front", "rear"])


def test_overrides_that_do_not_fit_the_schema() -> None:
    options = ["nodez=20", "goals.apex=0.5 kg", "goals.foo.bar=3"]
    with pytest.raises(ConfigErrors) as caught:
        parse(apply_overrides(document(), options), Jump)
    assert sorted(str(error) for error in caught.value.errors) == [
        "--set goals.apex=0.5 kg: goals.apex: '0.5 kg' is a mass; "
        "a length such as '0.5 m' was expected",
        "--set goals.foo.bar=3: goals.foo: unknown key; one of: apex, bounds",
        "--set nodez=20: nodez: unknown key; did you mean 'nodes'?",
    ]


def test_overrides_that_lead_nowhere() -> None:
    with pytest.raises(ConfigErrors) as caught:
        apply_overrides(
            document(), ["nodes", "nodes.x=1", "effects.7.T_c=3", "effects[2].T_c=3", "a..b=4"]
        )
    assert [str(error) for error in caught.value.errors] == [
        "--set nodes: is not key=value; such as --set 'goals.apex=0.5 m'",
        "--set nodes.x=1: nodes is a plain value and has no key 'x'",
        "--set effects.7.T_c=3: effects has no item '7'; 0 to 1 was expected",
        "--set effects[2].T_c=3: effects has no item '2'; 0 to 1 was expected",
        "--set a..b=4: is not key=value; such as --set 'goals.apex=0.5 m'",
    ]


def test_written_yaml_reads_back(tmp_path: Path) -> None:
    shared = [1.0, 2e-9]
    data = {"z": {"b": shared, "a": shared}, "on": "yes", "none": None, "text": "0.5 m"}
    dump_yaml(data, tmp_path / "deep" / "x.yaml")
    assert load_yaml(tmp_path / "deep" / "x.yaml").data == data
    assert list(load_yaml(tmp_path / "deep" / "x.yaml").data) == list(data)


def test_shipped_configs_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = shipped_configs("robots")["kemba.yaml"]
    assert find_config("kemba", "robots") == shipped
    assert find_config("robots/kemba.yaml", "robots") == shipped
    with pytest.raises(KembaError, match=r"kembo.yaml: no such file.*did you mean 'kemba.yaml'"):
        find_config("kembo.yaml", "robots")
    Path("kemba.yaml").write_text("name: mine")
    assert find_config("kemba.yaml", "robots") == Path("kemba.yaml")
