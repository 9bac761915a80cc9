"""Stick figures: geometry, poses, and the animation made of them."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from kemba.errors import KembaError
from kemba.plotting.source import Machine, Source, poses
from kemba.plotting.sticks import MODES, animate, save_animation


def distance(points: dict[str, np.ndarray], start: str, end: str) -> float:
    """Distance [m] of two points of a pose."""
    return float(np.hypot(*(points[end] - points[start])))


def test_links_keep_their_lengths(plan: Source, machine: Machine) -> None:
    times = np.linspace(0.0, 0.7, 15)
    extension = np.interp(times, plan.trajectory.time, plan.trajectory["rear/piston/x"])
    for pose, x in zip(poses(plan, machine, times), extension, strict=True):
        points = pose.points
        for leg in ("front", "rear"):
            assert distance(points, f"{leg}/hip", f"{leg}/knee") == pytest.approx(0.242)
            assert distance(points, f"{leg}/knee", f"{leg}/foot") == pytest.approx(0.234)
            assert distance(points, f"{leg}/hip", f"{leg}/mount") == pytest.approx(0.031)
            assert distance(points, f"{leg}/knee", f"{leg}/pin") == pytest.approx(0.048)
        length = distance(points, "rear/mount", "rear/pin")
        assert length == pytest.approx(0.2057 + x, abs=5e-4)  # angles are interpolated


def test_a_log_without_knees_has_the_same_poses(
    plan: Source, log: Source, machine: Machine
) -> None:
    knees = [n for n in plan.trajectory.names if "knee" not in n]
    bare = Source("bare", plan.trajectory.select(knees), plan=True)
    times = np.linspace(0.0, 0.7, 9)
    for one, other in zip(poses(plan, machine, times), poses(bare, machine, times), strict=True):
        for name, place in one.points.items():
            np.testing.assert_allclose(other.points[name], place, atol=1e-6)


def test_contact_and_valves_are_those_of_the_interval(plan: Source, machine: Machine) -> None:
    start, push, flight, pull, landed = poses(plan, machine, np.array([0, 0.1, 0.22, 0.3, 0.6]))
    assert [p.stands["front"] for p in (start, push, flight, pull, landed)] == [
        True, True, False, False, True,
    ]  # fmt: skip
    assert push.valves == {"front": (1, 0), "rear": (1, 0)}
    assert pull.valves["rear"] == (0, 1)
    assert flight.valves["rear"] == (0, 0)


def test_frames_follow_the_clock(plan: Source, machine: Machine) -> None:
    film = animate(plan, machine, slower=2.0)
    frames = list(film.new_saved_frame_seq())
    assert len(frames) == round(plan.trajectory.time[-1] * 2.0 * 25) + 1
    film._draw_was_started = True  # type: ignore[attr-defined]  # it is never saved


def test_a_gif_has_every_frame(plan: Source, machine: Machine, tmp_path: Path) -> None:
    path = save_animation(plan, machine, tmp_path / "new" / "jump.gif", slower=0.5)
    with Image.open(path) as picture:
        assert getattr(picture, "n_frames", 1) == round(plan.trajectory.time[-1] * 0.5 * 25) + 1


def test_other_formats(
    plan: Source, machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(KembaError, match=r"needs the program ffmpeg.*GIF: --animate .*jump.gif"):
        save_animation(plan, machine, tmp_path / "jump.mp4")
    with pytest.raises(KembaError, match=r"no format '.avi'; .* .gif or .mp4"):
        save_animation(plan, machine, tmp_path / "jump.avi")


def test_what_cannot_be_animated(log: Source, machine: Machine) -> None:
    bare = Source("bare", log.trajectory.select(["body/z", "front/hip/q"]))
    with pytest.raises(KembaError, match=r"bare: cannot be animated; body/z, hip/q and piston/x"):
        animate(bare, machine)


def test_every_mode_of_a_cylinder_has_its_own_colour() -> None:
    assert set(MODES) == {(extend, retract) for extend in (0, 1) for retract in (0, 1)}
    assert len(set(MODES.values())) == 4
