"""Words that stand for several requirements, and what is wrong with them."""

from pathlib import Path

import pytest

from kemba.errors import KembaError
from kemba.ocp import load_task
from kemba.ocp.reading import asked_of

BOUND = """
distance: 0.5 m
nodes: 40
contacts: [air, rear, air, front, air]
periodic: true
start: {body/x: 0 m}
goals:
  stride: {quantity: "at(end, body/x) - at(start, body/x)", equals: distance}
  apart: {quantity: "front/foot/x - rear/foot/x", at: touchdown front, at_least: 10 cm}
cost:
  calm: {expression: "front/hip/w^2 + rear/hip/w^2", weight: 0.01}
"""


def asked(path: Path, text: str) -> list[str]:
    path.joinpath("own.yaml").write_text(text)
    task, document = load_task(path / "own.yaml")
    return [requirement.label for requirement in asked_of(task, document)[1]]


def test_a_stride_is_closed_in_every_state_and_valve(tmp_path: Path) -> None:
    labels = asked(tmp_path, BOUND)
    closed = [label for label in labels if label.startswith("periodic:")]
    assert len(closed) == 6 + 7 + 4 + 4  # coordinates without x, rates, forces of air, valves
    assert "periodic:body/x" not in closed and "periodic:rear/valve/extend" in closed


def test_feet_stand_or_bear_nothing(tmp_path: Path) -> None:
    labels = asked(tmp_path, BOUND)
    assert labels.count("contacts:rear/foot/z") == labels.count("contacts:front/foot/z") == 1
    assert labels.count("contacts:rear/foot/Fz") == 4


def test_feet_are_clear_in_the_middle_of_each_of_their_flights(tmp_path: Path) -> None:
    tmp_path.joinpath("own.yaml").write_text("clearance: 3 cm\n" + BOUND)
    found = asked_of(*load_task(tmp_path / "own.yaml"))[1]
    clear = [r for r in found if r.location == ("clearance",)]
    flights = {name: [r.during for r in clear if r.quantity.name == f"{name}/foot/z"]
               for name in ("rear", "front")}  # fmt: skip
    assert flights["rear"] == [pytest.approx((0.03, 0.17)), pytest.approx((0.49, 0.91))]
    assert flights["front"] == [pytest.approx((0.09, 0.51)), pytest.approx((0.83, 0.97))]
    assert {r.lower for r in clear} == {0.03}


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [
        ("rear, air, front", "reer, air, front", "own.yaml:4:1: contacts: no leg 'reer'"),
        (
            "periodic: true",
            "periodic: {except: [body/y]}",
            "own.yaml:5:1: periodic: except: no state",
        ),
        ("touchdown front", "touchdown side", "goals.apart: `contacts` have no 'touchdown side'"),
        ("- rear/foot/x", "- rear/foot/vx", "mixes a length with a speed"),
        ("front/hip/w^2", "front/hip/ww^2", "own.yaml:11:"),
        ("contacts: [air, rear, air, front, air]", "", "an event of `contacts`"),
    ],
)
def test_a_mistake_is_told_at_its_line(tmp_path: Path, was: str, now: str, said: str) -> None:
    assert was in BOUND
    with pytest.raises(KembaError) as caught:
        asked(tmp_path, BOUND.replace(was, now))
    assert said in str(caught.value)


LEAP = """
distance: 0.5 m
nodes: 40
start: {body/x: 0 m}
end: {body/x: distance}
"""


@pytest.mark.parametrize(
    ("model", "state", "most"), [("planning", "F", 324.0), ("orifice", "P", 7.25e5)]
)
def test_no_motion_begins_with_more_air_than_there_is(
    model: str, state: str, most: float, tmp_path: Path
) -> None:
    tmp_path.joinpath("own.yaml").write_text(f"model: {model}\n{LEAP}")
    found = asked_of(*load_task(tmp_path / "own.yaml"))[1]
    begins = {r.label: r.upper for r in found if r.location == ("start",)}
    assert begins[f"start:rear/chamber/extend/{state}"] == pytest.approx(most, rel=1e-3)
    assert not any("hip" in label or "body" in label for label in begins)


def test_air_that_the_task_gives_is_its_own(tmp_path: Path) -> None:
    given = LEAP.replace("{body/x: 0 m}", "{body/x: 0 m, rear/chamber/*/F: 80 N, settled: true}")
    assert not [label for label in asked(tmp_path, given) if label.startswith("start:")]
    assert not [label for label in asked(tmp_path, BOUND) if label.startswith("start:")]


def test_first_order_air_has_the_pressures_of_physical_one(tmp_path: Path) -> None:
    """A task that bounds pressures is sought with first-order chambers, too."""
    tmp_path.joinpath("own.yaml").write_text(
        LEAP.replace("start:", "bounds: {'*/chamber/*/P': {at_most: 0.6 MPa}}\nstart:")
    )
    task, document = load_task(tmp_path / "own.yaml", ["model=orifice"])
    for lags in (False, True):
        labels = [r.label for r in asked_of(task, document, lags=lags)[1]]
        assert "bounds.*/chamber/*/P:rear/chamber/extend/P" in labels
