"""The figure of a motion."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from kemba.errors import KembaError
from kemba.plotting import draw
from kemba.plotting.motion import plot_motion
from kemba.plotting.source import Machine, Source, load_source, machine_of, stance_spans
from kemba.plotting.style import save_figure
from kemba.trajectory import Trajectory

LABELS = {
    "body centre z, x [m]",
    "pitch θ [deg]",
    "hip q [deg]",
    "piston x [mm]",
    "hip τ [N m]",
    "chamber F [N]",
    "piston F [N]",
    "ground F [N]",
}


def labels(figure: Figure) -> set[str]:
    """The names of all y axes."""
    return {axes.get_ylabel() for axes in figure.axes} - {""}


def showing(figure: Figure, name: str) -> Axes:
    """The axes that show a column."""
    for axes in figure.axes:
        if any(artist.get_gid() == name for artist in (*axes.lines, *axes.collections)):
            return axes
    raise AssertionError(f"{name} is not shown")


def lines(figure: Figure, name: str) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """How a column is drawn, once per source: draw style, times, numbers."""
    found = [line for axes in figure.axes for line in axes.lines if line.get_gid() == name]
    return [(str(f.get_drawstyle()), *map(np.asarray, f.get_data())) for f in found]


def test_a_plan_fills_every_panel(plan: Source, machine: Machine) -> None:
    figure = plot_motion([plan], machine)
    assert labels(figure) == LABELS
    assert len(figure.axes) == 1 + 2 + 2 * 7  # strip, body, panels of two legs
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title for title in titles if title] == ["front leg", "rear leg"]
    assert figure.get_size_inches()[0] == 7.0
    assert figure.get_size_inches()[1] < 9.5  # in, a page


def test_plans_step_before_and_logs_after_their_row(
    plan: Source, log: Source, machine: Machine
) -> None:
    figure = plot_motion([plan, log], machine)
    (planned, _, numbers), (measured, *_) = lines(figure, "front/hip/tau")
    assert (planned, measured) == ("steps-pre", "steps-post")
    assert numbers[0] == numbers[1]
    assert [style for style, *_ in lines(figure, "front/foot/Fz")] == ["steps-pre"]
    assert {style for style, *_ in lines(figure, "body/z")} == {"default"}


def test_sampled_contact_forces_are_lines(plan: Source, machine: Machine) -> None:
    figure = plot_motion([Source("log", plan.trajectory)], machine)
    assert [style for style, *_ in lines(figure, "front/foot/Fz")] == ["default"]


def test_units_on_the_axes_are_those_of_the_numbers(plan: Source, machine: Machine) -> None:
    figure = plot_motion([plan], machine)
    (_, _, hip), (_, _, piston) = (lines(figure, f"front/{n}")[0] for n in ("hip/q", "piston/x"))
    np.testing.assert_allclose(hip, np.degrees(plan.trajectory["front/hip/q"]))
    np.testing.assert_allclose(piston, 1e3 * plan.trajectory["front/piston/x"])


def test_limits_are_shown(plan: Source, machine: Machine) -> None:
    figure = plot_motion([plan], machine)

    def limits(name: str) -> list[float]:
        shown = [line for line in showing(figure, name).lines if line.get_gid() == "limit"]
        return [float(line.get_ydata()[0]) for line in shown]  # type: ignore[index, arg-type]

    assert limits("front/hip/tau") == [-24.8, 24.8]
    assert limits("rear/piston/x") == pytest.approx([0.0, 70.0])
    assert limits("rear/chamber/extend/F") == [324.0, 260.0]
    assert limits("front/piston/F") == []


def test_limits_follow_the_runs_own_supply(tmp_path: Path, jump: Callable[..., Trajectory]) -> None:
    jump(5).write(tmp_path / "run/trajectory.csv")
    (tmp_path / "run/task.yaml").write_text("model: planning\nsupply: 6 bar\n")
    source = load_source(tmp_path / "run")
    assert machine_of(source).limits["chamber/F"] == (287.0, 239.0)
    assert machine_of(source, "planning").limits["chamber/F"] == (324.0, 260.0)


def test_valves_are_bars_over_the_time_they_are_on(plan: Source, machine: Machine) -> None:
    figure = plot_motion([plan], machine)
    rows = [c for axes in figure.axes for c in axes.collections if "valve" in str(c.get_gid())]
    assert len(rows) == 4
    bars = next(c for c in rows if c.get_gid() == "front/valve/retract").get_paths()
    drawn = [(p.vertices[:, 0].min(), p.vertices[:, 0].max()) for p in bars]
    time, on = plan.trajectory.time, plan.trajectory["front/valve/retract"] > 0.5
    first, last = np.flatnonzero(on)[[0, -1]]
    assert drawn == [(time[first - 1], time[last])]


def test_stance_is_shaded_in_every_panel(plan: Source, log: Source, machine: Machine) -> None:
    figure = plot_motion([plan], machine)
    for axes in figure.axes[1:]:
        (bands,) = (c for c in axes.collections if c.get_gid() == "stance")
        assert len(bands.get_paths()) == 2
    (_, takeoff), (landing, _) = stance_spans(log, machine, "front")  # from the foot's height
    assert (takeoff, landing) == pytest.approx((0.20, 0.49), abs=0.03)


def test_a_foot_that_stays_down_has_not_left_the_ground(log: Source, machine: Machine) -> None:
    """Its force is lost in the noise for a while after it has touched; its height tells."""
    t = log.trajectory
    at = machine.coordinates(t)
    assert at is not None
    down = machine.points(at)["front/foot"][:, 1] < 4e-3
    landed = t.time[np.flatnonzero(~down)[-1] + 1]
    light = (t.time > landed + 0.015) & (t.time < landed + 0.04)
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(t))
    force = np.where(down & ~light, 30.0, 0.0) + noise
    measured = t.with_columns({"front/foot/Fz [N]": force})
    spans = stance_spans(Source("log", measured), machine, "front")
    assert len(spans) == 2 and spans[1] == pytest.approx((landed, t.time[-1]), abs=0.01)
    blind = measured.select(["front/foot/Fz"])  # without its joints only the force is known
    assert len(stance_spans(Source("log", blind), machine, "front")) == 3


def test_runs_overlay_in_their_colours(plan: Source, log: Source, machine: Machine) -> None:
    figure = plot_motion([plan, log], machine)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["plan", "log"]
    drawn = [line for line in showing(figure, "body/z").lines if line.get_gid() == "body/z"]
    assert len({line.get_color() for line in drawn}) == 2
    assert labels(figure) == LABELS


def test_missing_columns_drop_their_panels(log: Source, machine: Machine) -> None:
    assert labels(plot_motion([log], machine)) == LABELS - {
        "chamber F [N]",
        "piston F [N]",
        "ground F [N]",
    }
    height = Source("z", log.trajectory.select(["body/z"]))
    figure = plot_motion([height], machine)
    assert len(figure.axes) == 1  # no strip without joints
    one_leg = [n for n in log.trajectory.names if not n.startswith("rear")]
    assert len(plot_motion([Source("f", log.trajectory.select(one_leg))], machine).axes) == 6


def test_gaps_do_not_disturb(log: Source, machine: Machine) -> None:
    z = log.trajectory["body/z"].copy()
    z[50:90] = np.nan
    holey = Source("holey", log.trajectory.with_columns({"body/z [m]": z}))
    assert labels(plot_motion([holey], machine)) == labels(plot_motion([log], machine))


def test_rounding_errors_are_not_magnified(
    jump: Callable[..., Trajectory], machine: Machine
) -> None:
    figure = plot_motion([Source("plan", jump(51, sway=1e-9), plan=True)], machine)
    low, high = showing(figure, "body/pitch").get_ylim()
    assert high - low >= 4.0  # deg


def test_the_strip_names_its_times(plan: Source, machine: Machine) -> None:
    texts = [text.get_text() for text in plot_motion([plan], machine).axes[0].texts]
    assert texts[0] == "0.00 s"
    times = [float(text.removesuffix(" s")) for text in texts]
    assert np.ptp([b - a for a, b in pairwise(times)]) <= 0.02


def test_letters_are_legible(plan: Source, log: Source, machine: Machine) -> None:
    figure = plot_motion([plan, log], machine)
    texts = figure.findobj(Text)
    assert min(text.get_fontsize() for text in texts if text.get_text()) >= 7  # type: ignore[attr-defined]


def test_nothing_to_plot(machine: Machine) -> None:
    odd = Source("odd", Trajectory([0.0, 1.0], {"wind [m.s-1]": [1.0, 2.0]}))
    with pytest.raises(KembaError, match=r"odd: has nothing to plot; columns of the robot log"):
        plot_motion([odd], machine)


def test_formats(plan: Source, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("figures")
    figure = draw([Source("z", plan.trajectory.select(["body/z"]))])
    for name in ("a.png", "new/a.pdf", "a.svg"):
        assert save_figure(figure, folder / name).stat().st_size > 1000
    with pytest.raises(KembaError, match=r"no format '.jpeg2'; a name ending in .png"):
        save_figure(figure, folder / "a.jpeg2")
    with pytest.raises(KembaError, match="has no ending"):
        save_figure(figure, folder / "a")
