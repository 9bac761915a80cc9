"""Times in words, and channels of several clocks on the rows of one."""

import numpy as np
import pytest

from kemba.logs.times import one_clock, placed, seconds
from kemba.trajectory import Trajectory


def test_a_clock_that_goes_back_a_little_does_not_begin_anew() -> None:
    read = seconds(np.array(["10:00:00.5", "10:00:00.4", "10:00:01.5"], dtype=object))
    assert read == pytest.approx([0.0, -0.1, 1.0])


@pytest.mark.parametrize("mark", [".", ",", ":"])
def test_milliseconds_without_zeros_before_them_are_a_count(mark: str) -> None:
    """12:00:01.5 is 5 ms after the second where 12:00:01.12 follows a row later."""
    ms = np.arange(995, 2120, 7)
    texts = [f"12:00:{count // 1000:02d}{mark}{count % 1000}" for count in ms]
    read = seconds(np.array(texts, dtype=object))
    assert read == pytest.approx((ms - ms[0]) / 1000)
    for texts in (["1.25", "1.5", "1.75"], ["0.75", "1.0", "1.25"], ["1.5", "1.75", "2"]):
        short = seconds(np.array([f"12:00:0{text}" for text in texts], dtype=object))
        assert short == pytest.approx([0.0, 0.25, 0.5]), "goes on as a count, too"
    back = seconds(np.array(["12:00:01.5", "12:00:01.12", "12:00:01.05"], dtype=object))
    assert back == pytest.approx([0.0, -0.38, -0.45]), "as written where it goes back either way"


@pytest.mark.parametrize(("gap", "known"), [(24e-3, True), (26e-3, False)])
def test_nothing_is_known_far_from_the_next_reading(gap: float, known: bool) -> None:
    """Of a channel in steps of 10 ms; the row is just after the reading before the gap."""
    own = np.cumsum([0.0, 0.01, 0.01, gap, 0.01, 0.01])
    time = np.arange(0.0001, own[-1], 1e-3)
    assert np.isfinite(placed(time, own, own, False)[20]) == known


def test_channels_on_another_clock_are_named_and_no_others() -> None:
    """`body/z` is read between the rows of `body/x`; `body/pitch` in every tenth of its rows."""
    time = np.arange(2000) * 0.5e-3
    x, z, pitch = (np.full(len(time), np.nan) for _ in range(3))
    x[::2], z[1::4], pitch[::20] = time[::2], time[1::4], time[::20]
    log = Trajectory(time, {"body/x [m]": x, "body/z [m]": z, "body/pitch [rad]": pitch})
    (said,) = one_clock(log).meta["read"]
    assert said.startswith("body/z have a clock of their own")


def test_rows_that_go_back_are_left_as_they_are() -> None:
    """Their fault is told where the log is checked, and not covered here."""
    time = np.arange(200) * 1e-3
    x, z = (np.full(len(time), np.nan) for _ in range(2))
    x[::2], z[1::4] = time[::2], time[1::4]
    columns = {"body/x [m]": x, "body/z [m]": z}
    assert len(one_clock(Trajectory(time, columns))) == 100
    time[120] = time[110]
    log = Trajectory(time, columns)
    assert one_clock(log) is log
