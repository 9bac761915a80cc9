"""A motion as a recording of Rerun: the robot, the plan as a ghost, the columns as plots, laid out.

https://rerun.io; `rerun-sdk` is imported when a recording is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path
from kemba.folders import fresh
from kemba.plotting.source import Source
from kemba.report.stage import scene, shown

ENDING = ".rrd"
CLOCK = "time"
COLOURS = {"robot": (213, 94, 0), "plan": (0, 114, 178, 110)}  # as in the figures; a ghost is pale
RADIUS = 4e-3  # m, of a link as it is drawn
# a plot for each of these, of the columns that end so
PLOTS = {
    "body": ("body/x", "body/z", "body/pitch"),
    "hip angles": ("hip/q",),
    "hip torques": ("hip/tau",),
    "pistons": ("piston/x",),
    "valves": ("valve/extend", "valve/retract"),
    "feet": ("foot/Fz",),
}


def record_run(
    run: str | Path,
    out: str | Path,
    model: str | None = None,
    force: bool = False,
    column_map: str | Path | None = None,
    plan: str | Path | None = None,
) -> Path:
    """The same as `write_rerun` of a run folder or a log, with the arguments of `view_run`."""
    source, ghost = shown(run, column_map, plan)
    return write_rerun(source, fresh(out, force, "--rerun"), model, ghost)


def write_rerun(
    source: Source, path: str | Path, model: str | None = None, ghost: Source | None = None
) -> Path:
    """Write the motion of a source as `path` (.rrd), with the blueprint of its views; `ghost`: a
    second motion, drawn pale.

    Raises KembaError where rerun-sdk is not installed, columns are missing or the file cannot be
    written.
    """
    path = Path(path)
    if path.suffix != ENDING:
        raise KembaError(str(path), "is no name of a recording of Rerun", f"'NAME{ENDING}' was "
                         "expected")  # fmt: skip
    try:
        import rerun as rr
    except ImportError:
        what = "needs the package 'rerun-sdk', which is not installed"
        raise KembaError(str(path), what, hint="pip install 'kemba[rerun]'") from None
    staged = scene(source, model, ghost)
    sources = {_called(source): source} | ({_called(ghost, source): ghost} if ghost else {})
    stream = rr.RecordingStream("kemba", recording_id=path.stem)
    with atomic_path(path) as temporary:
        stream.save(temporary, default_blueprint=_blueprint(sources))
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        ground = [[x, 0.0, z] for x, z in zip(*staged["ground"], strict=True)]
        boxes = [[[x, 0.0, z] for x, z in zip(*box, strict=True)] for box in staged["obstacles"]]
        stream.log("scene/ground", rr.LineStrips3D([ground, *boxes]), static=True)
        for name, motion in zip(sources, staged["motions"], strict=False):
            _robot(stream, f"scene/{name}", staged, motion, COLOURS["plan" if ghost and
                   sources[name] is ghost else "robot"])  # fmt: skip
        for name, one in sources.items():
            _columns(stream, name, one)
        stream.disconnect()
    return path


def _called(source: Source, beside: Source | None = None) -> str:
    """The path of a source's entities: what it is, unless the other one is that too."""
    name = "plan" if source.plan else "log"
    return name if beside is None or beside.plan != source.plan else f"{name}_ghost"


def _robot(
    stream: Any, entity: str, staged: dict[str, Any], motion: dict[str, Any], colour: Any
) -> None:
    """The links of one robot at all times of the scene."""
    import rerun as rr

    strips = [
        np.array([[p[i] for p in motion["points"][name]] for name in names for i in (0, 1)])
        for names in _links(list(motion["points"]), staged["legs"])
    ]  # (2 k, times) each
    times = np.asarray(staged["time"], dtype=float)
    lines = [
        [[strip[2 * k, row], 0.0, strip[2 * k + 1, row]] for k in range(len(strip) // 2)]
        for row in range(len(times))
        for strip in strips
    ]
    style = rr.LineStrips3D.from_fields(colors=[colour], radii=[RADIUS])
    stream.log(entity, style, static=True)
    columns = rr.LineStrips3D.columns(strips=lines).partition([len(strips)] * len(times))
    stream.send_columns(entity, [rr.TimeColumn(CLOCK, duration=times)], columns)


def _links(points: list[str], legs: tuple[str, ...]) -> Iterator[list[str]]:
    """Which points one line goes through: the hips, each leg, each cylinder."""
    hips = [f"{leg}/hip" for leg in legs]
    yield hips if len(hips) > 1 else [hips[0], hips[0]]
    for leg in legs:
        yield [f"{leg}/{part}" for part in ("hip", "knee", "foot")]
        cylinder = [n for n in points if n.startswith(f"{leg}/") and n.split("/")[-1] not in
                    ("hip", "knee", "foot")]  # fmt: skip
        if len(cylinder) > 1:
            yield cylinder


def _columns(stream: Any, entity: str, source: Source) -> None:
    """Every column of a trajectory as a series of its own readings."""
    import rerun as rr

    trajectory = source.trajectory
    for header, name in zip(trajectory.headers, trajectory.names, strict=True):
        known = np.isfinite(trajectory[name])
        if known.any():
            at = rr.TimeColumn(CLOCK, duration=trajectory.time[known])
            stream.log(f"{entity}/{name}", rr.SeriesLines(names=f"{entity} {header}"), static=True)
            series = rr.Scalars.columns(scalars=trajectory[name][known])
            stream.send_columns(f"{entity}/{name}", [at], series)


def _blueprint(sources: dict[str, Source]) -> Any:
    """The robot beside a plot for each kind of column that there is."""
    import rerun.blueprint as rrb

    plots = []
    for title, ends in PLOTS.items():
        contents = [
            f"+ /{entity}/{name}"
            for entity, source in sources.items()
            for name in source.trajectory.names
            if name.endswith(ends)
        ]
        if contents:
            plots.append(rrb.TimeSeriesView(name=title, origin="/", contents=contents))
    robot = rrb.Spatial3DView(name="robot", origin="/scene")
    return rrb.Blueprint(rrb.Horizontal(robot, rrb.Vertical(*plots)), collapse_panels=True)
