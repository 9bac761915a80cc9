"""Progress of long work: what is being done, and about how much time is left."""

import re

import pytest

from kemba.stopwatch import Stage
from kemba_cli import progress as courses
from kemba_cli.common import speaking
from kemba_cli.progress import (
    COMPARE,
    DISCOVER,
    LEARN,
    NEAR,
    REVIEW,
    SOLVE,
    Left,
    Progress,
    duration,
    span,
)


class Clock:
    """A clock that is put forward by hand."""

    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(courses, "time", made)
    monkeypatch.setattr("kemba_cli.progress.time", made)
    return made


def test_a_stage_is_a_text_and_a_count() -> None:
    stage = Stage("refitting valve_delay", 2, 8)
    assert stage == "refitting valve_delay (2 of 8)"
    assert (stage.name, stage.part, stage.parts) == ("refitting valve_delay", 2, 8)


COURSES = [SOLVE, NEAR, courses.ROBUST, COMPARE, DISCOVER, LEARN, REVIEW, courses.SENSITIVITY]


@pytest.mark.parametrize("course", COURSES)
def test_every_course_goes_forward(course: courses.Course) -> None:
    assert list(course.values()) == sorted(course.values())
    assert all(0.0 <= share < 1.0 for share in course.values())


def test_parts_share_the_time_of_their_stage() -> None:
    course = {"first": 0.0, "second": 0.4, "second, more exactly": 0.6}
    assert span(course, "second, more exactly (again)") == (0.6, 1.0)
    assert span(course, Stage("second", 2, 4)) == pytest.approx((0.45, 0.5))
    assert span(course, "unknown") == (0.0, 0.0)


def test_the_time_left_follows_the_stages(clock: Clock) -> None:
    """A quarter took 10 s, so three quarters take 30 s; a stage that is slow is waited for."""
    left = Left({"first": 0.0, "second": 0.25, "third": 0.75})
    left.enter("first")
    assert left.words == ""
    clock.now += 10.0
    left.enter("second")
    assert left.seconds == pytest.approx(30.0) and left.words == "about 30 s left"
    clock.now += 12.0
    assert left.seconds == pytest.approx(18.0)
    clock.now += 60.0
    assert left.seconds == pytest.approx(10.0)  # the third stage is still to come
    left.enter("first")  # again: nothing is undone
    assert left.share == 0.25


def test_a_plan_from_another_one_takes_its_own_time(clock: Clock) -> None:
    """Until that fails and the plan is made from a guess."""
    left = Left(SOLVE)
    clock.now += 2.0
    left.enter("from the earlier plan runs/jump-1: the best one")
    assert left.share == NEAR["from the"] and left.seconds == pytest.approx(18.0)
    left.enter("relax (half robot, 50 nodes)")
    assert left.words == ""


def test_how_many_plans_a_robust_task_tries_is_not_guessed(clock: Clock) -> None:
    left = Left(SOLVE)
    clock.now += 2.0
    left.enter("from the earlier plan runs/jump-1: the best one")
    assert left.words
    clock.now += 2.0
    left.enter("as asked, hold 0.3 s: 57 of 60 scenarios succeed (95 %: 86 to 98 %)")
    left.enter("from the plan as asked: the best one")
    assert left.words == ""
    clock.now += 16.0
    left.enter("replay: controller.csv (2 of 3)")
    assert left.words == "about 1 s left"


def test_nothing_is_said_of_the_time_of_a_compiler(clock: Clock) -> None:
    left = Left({"first": 0.0, "second": 0.25, "third": 0.75})
    left.enter("first")
    clock.now += 10.0
    left.enter("second")
    assert left.words
    left.enter("compiling the simulator, once on this machine")
    assert not left.words
    left.enter("third")
    assert left.words


def test_a_limit_bounds_the_time_left(clock: Clock) -> None:
    left = Left({"first": 0.0, "second": 0.2}, limit=60.0)
    assert left.words == "at most 60 s left"
    clock.now += 40.0
    left.enter("second")
    assert left.seconds == pytest.approx(20.0)


def test_seconds_in_words() -> None:
    assert [duration(s) for s in (0.2, 8.4, 43.0, 95.0, 301.0)] == [
        *("1 s", "8 s", "45 s", "2 min", "5 min"),
    ]


def test_lines_where_no_one_watches(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    """One line a stage with the time left; of stages that are alike one in two seconds."""
    with Progress({"reading": 0.0, "executing": 0.5}) as progress:
        progress.tell("reading")
        clock.now += 4.0
        for number in range(1, 6):
            progress.tell(Stage("executing", number, 5))
            clock.now += 0.8
    lines = capsys.readouterr().err.splitlines()
    assert lines[:2] == ["   0.0 s  reading", "   4.0 s  executing (1 of 5), about 4 s left"]
    assert [re.findall(r"\d of 5", line)[0] for line in lines[1:]] == ["1 of 5", "4 of 5"]


def test_quiet_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with speaking(quiet=True), Progress(SOLVE) as progress:
        progress.tell("relax")
        progress.watch(10, 1.0, 1e-3)
    assert capsys.readouterr().err == ""
