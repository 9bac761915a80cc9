"""The same data written in another way get the same answer: a test that needs no truth."""

from functools import cache
from pathlib import Path

import pytest

pytest.importorskip("numba")

from robot_logs import hops
from transformed import CHANGES, in_other_units, mirrored, permuted, read, written
from twin.cases import bench_case
from twin.catalogue import hidden

from kemba.identify.answer import Answer, Ranked, Value
from kemba.identify.workflow import discover_logs

CASES = {"seal_friction": 3, None: 5}


def same(one: Answer, other: Answer) -> bool:
    """Whether two answers name the same, and sizes whose intervals meet."""
    if (one.verdict, set(one.added)) != (other.verdict, set(other.added)):
        return False
    values = [
        {r.effect: r.parameters for r in a.ranking if r.effect in a.added} for a in (one, other)
    ]
    for effect, parameters in values[0].items():
        for name, a in parameters.items():
            b = values[1][effect][name]
            if a.low > b.high or b.low > a.high:
                return False
    return True


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory):
    """bench(effect): paths of two logs, and the answer about them."""

    @cache
    def make(effect: str | None) -> tuple[list[Path], Answer]:
        folder = tmp_path_factory.mktemp("bench")
        paths, _ = bench_case(folder, effect, seed=CASES[effect], runs=2, duration=1.5)
        return paths, discover_logs(paths)[0]

    return make


@pytest.mark.slow
def test_units_and_order_of_columns_are_no_matter(bench, tmp_path: Path) -> None:
    paths, first = bench("seal_friction")
    assert first.added == ("seal_friction",)
    others, column_map = in_other_units(permuted(read(paths)), tmp_path)
    assert same(first, discover_logs(others, column_map=column_map)[0])


@pytest.mark.nightly
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("effect", CASES)
def test_the_answer_stays(effect: str | None, change: str, bench, tmp_path: Path) -> None:
    paths, first = bench(effect)
    again = discover_logs(written(CHANGES[change](read(paths)), tmp_path))[0]
    assert same(first, again), f"{first.sentence} -> {again.sentence}"


@pytest.mark.nightly
@pytest.mark.parametrize("effect", ["seal_friction", None])
def test_a_robot_is_the_same_from_the_other_side(effect: str | None, tmp_path: Path) -> None:
    logs, _ = hops(*([hidden(effect)] if effect else []), runs=3)
    first = discover_logs(written(logs, tmp_path / "one"))[0]
    assert first.added == ((effect,) if effect else ())
    again = discover_logs(written(mirrored(logs), tmp_path / "other"))[0]
    assert same(first, again), f"{first.sentence} -> {again.sentence}"


def test_the_comparison_sees_another_answer() -> None:
    """Else the tests above could not fail."""
    nothing = Answer("nothing")
    assert same(nothing, nothing) and not same(nothing, Answer("missing", added=("gas_spring",)))
    far = [Ranked("gas_spring", 1.0, {"k": Value(x, x - 1.0, x + 1.0, "N")}) for x in (5.0, 8.0)]
    one, other = (Answer("missing", added=("gas_spring",), ranking=[r]) for r in far)
    assert same(one, one) and not same(one, other)
