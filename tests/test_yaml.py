"""YAML as kemba reads and writes it: YAML 1.2, within limits, no code."""

import math
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kemba.config import parse
from kemba.config.document import Document, dump_text, load_text, load_yaml
from kemba.errors import KembaError
from kemba.model.spec import ModelSpec

SECOND = 1.0  # s of CPU time in which every file is answered


def read(text: str) -> Any:
    return load_text(text, "f.yaml").data


def refused(text: str) -> str:
    """The message about a text, which comes within a second."""
    began = time.process_time()
    with pytest.raises(KembaError) as caught:
        parse(load_text(text, "f.yaml"), ModelSpec)
    message = str(caught.value)
    assert time.process_time() - began < SECOND
    assert len(message) < 30_000
    return message


@pytest.mark.parametrize(
    "text, value",
    [
        ("yes", "yes"),
        ("on", "on"),
        ("true", True),
        ("FALSE", False),
        ("tRue", "tRue"),
        ("1_000", "1_000"),
        ("0o17", 15),
        ("0x1F", 31),
        ("012", 12),
        ("0b11", "0b11"),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("1.", 1.0),
        ("-.inf", -math.inf),
        ("12:30", "12:30"),
        ("2001-01-01", "2001-01-01"),
        ("~", None),
        ("", None),
        ("'1'", "1"),
        ("!!str 1", "1"),
        ("!!float 3", 3.0),
    ],
)
def test_plain_words_are_those_of_yaml_1_2(text: str, value: object) -> None:
    found = read(f"a: {text}")["a"]
    assert found == value and type(found) is type(value)


def test_on_is_a_key() -> None:
    assert read("on: front\n1: x\n") == {"on": "front", "1": "x"}


def test_aliases_are_copies() -> None:
    data = read("a: &x {b: [1]}\nc: *x\n")
    data["a"]["b"].append(2)
    assert data["c"] == {"b": [1]}


LINKS = "".join(
    f"{n}: &{n} [{', '.join([f'*{m}'] * 9)}]\n" for m, n in zip("abcde", "bcdef", strict=True)
)


@pytest.mark.parametrize(
    "text, sentence",
    [
        ("a: &a [1]\n" + LINKS, "its aliases stand for more than 20000 keys and values"),
        ("a: &a {x: 1}\nb: {<<: *a}\n", "'<<' (merging of groups) is not part of YAML 1.2"),
        ("a: [" + "1, " * 100_000 + "1]", "has more than 20000 keys and values"),
        ("effects: [" + "1, " * 19_000 + "1]", "and 18951 more mistakes"),
        ("".join(f"k{i}: 1\n" for i in range(9_000)), "and 8950 more mistakes"),
        ("[" * 100_000, "is nested deeper than 30 levels"),
        ("a:\n" + "".join(" " * i + "b:\n" for i in range(1, 500)), "nested deeper than 30"),
        ("? " + "x" * 5000 + "\n: 1", "this key has 5000 characters; 200 are allowed"),
        ("name: " + "x" * 50_000, "this text has 50000 characters; 20000 are allowed"),
        ("supply: " + "9" * 400, "f.yaml:1:9: this number has 400 characters; 40 are allowed"),
        ("supply: 1e400", "'1e400' is larger than any number that can be computed with"),
        ("supply: !!bool execute", "f.yaml:1:9: 'execute' is no bool, as its tag says"),
        ("supply: !!timestamp 2001-01-01", "the tag '!!timestamp' is not allowed"),
        ("a: !!python/object/apply:os.system ['true']", "is not allowed"),
        ("a: !mine {b: 1}", "the tag '!mine' is not allowed"),
        ("a: " + "*a " * 3, "has no anchor"),
        ("a: &a 1\nb: [" + "*a, " * 300 + "1]", "has more than 200 aliases"),
        ("? [1]\n: 2", "f.yaml:1:3: a group or list cannot be a key"),
        (
            "a: 1\nb: 2\na: 3\n",
            "f.yaml:3:1: a: this key stands twice; its first value is in line 1",
        ),
        ("a" * 3_000_000, "is longer than 2000000 characters"),
        ("a: \ud800", "is not valid YAML"),
        ("supply: 1\n---\nsupply: 2\n", "f.yaml:2:1: a second document begins here"),
    ],
)
def test_bombs_and_tricks_are_refused_at_once(text: str, sentence: str) -> None:
    assert sentence in refused(text)


def test_a_file_that_is_too_long_is_not_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "big.yaml"
    with path.open("wb") as stream:
        stream.truncate(10_000_000_000)  # a hole; reading it whole would take the memory
    with pytest.raises(KembaError, match="is larger than 2000000 bytes"):
        load_yaml(path)


def test_values_of_the_command_line_have_the_same_limits() -> None:
    from kemba.config import apply_overrides

    with pytest.raises(KembaError, match="is not allowed; YAML never runs"):
        apply_overrides(Document({}), ["a=!!python/name:os.system"])


TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\ufffe\uffff"), max_size=40)
PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**18), 10**18)
    | st.floats(allow_nan=False)
    | TEXTS
    | st.sampled_from("on yes 1_000 0o7 1e3 ~ null .inf << = 012 0x1F - # : true".split()),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=12,
)


@given(PLAIN)
@example({"<<": None})
@settings(max_examples=300, deadline=None)
def test_what_is_written_is_read_back(data: Any) -> None:
    assert read(dump_text({"a": data}))["a"] == data


@given(st.text(max_size=60) | st.text("&*!<>[]{}:-?#,|%@`'\"\\ \t\nab1~", max_size=60))
@settings(max_examples=500, deadline=None)
def test_any_text_is_data_or_a_message(text: str) -> None:
    try:
        load_text(text, "f.yaml")
    except KembaError as error:
        assert str(error).startswith("f.yaml")
