"""A motion in 3-D: a page of its own with its viewer, or a recording for Rerun.

https://rerun.io; `rerun-sdk` is imported when a recording is asked for.
"""

from collections.abc import Iterator
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

import kemba
from kemba.errors import KembaError
from kemba.files import atomic_path, atomic_text
from kemba.folders import ended, fresh, place_for
from kemba.plotting.source import CYLINDER, Pose, Source, load_source, machine_of, poses
from kemba.report.charts import script_text
from kemba.trajectory import Array

PAGES = Path(__file__).parent / "pages"
RATE = 250.0  # poses per second of motion
BESIDE = 2.0  # m of ground before and behind the motion
AROUND = 0.3  # s, shown before and after the ghost moves


def view_run(
    run: str | Path,
    out: str | Path | None = None,
    model: str | None = None,
    force: bool = False,
    column_map: str | Path | None = None,
    plan: str | Path | None = None,
) -> Path:
    """A page with the motion of `run`, a run folder or a log, in 3-D, which needs no other file;
    written to `out`, which `force` replaces, or as a new file beside the motion.

    `model`: of the robot that is drawn. `column_map`: for the log of another program. `plan`: the
    run that is drawn as a ghost. Raises KembaError where columns are missing or the page cannot be
    written.
    """
    source, ghost = shown(run, column_map, plan)
    assert source.path is not None
    place = place_for(out, source.path.with_name("view.html"), force)
    return write_page(place, source.name, stage(source, model, ghost))


def shown(
    run: str | Path, column_map: str | Path | None, plan: str | Path | None
) -> tuple[Source, Source | None]:
    """The motion of a run folder or a log, and that of the run which is its ghost, if there is
    one. Raises KembaError."""
    source = load_source(run, column_map)
    return source, load_source(plan) if plan else None


def stage(
    source: Source, model: str | None = None, ghost: Source | None = None, name: str = ""
) -> str:
    """The viewer with its scene as HTML; `ghost`: a second motion, drawn pale. Raises KembaError
    when columns are missing."""
    shown = scene(source, model, ghost)
    who = f"Shown: {name or source.name}."
    if ghost is not None:
        who += f" Pale blue: {'the plan' if ghost.plan else ghost.name}."
    high = max(centre[1] for centre in shown["motions"][0]["centres"])
    alt = f"{who} The robot in 3-D from the side; its body rises to {high:.2f} m."
    code = {"viewer": page_text("viewer.js"), "scene": script_text(shown)}
    return fill("stage.html", who=escape(who), alt=escape(alt), **code)


def scene(source: Source, model: str | None = None, ghost: Source | None = None) -> dict[str, Any]:
    """Times [s]; of every robot points [m], valves and contacts; the size [m] of it all. Raises
    KembaError where columns are missing."""
    machine = machine_of(source, model)
    times = _times(source, ghost)
    shown = [poses(one, machine, times) for one in (source, ghost) if one and not one.bench]
    if not shown or not shown[0]:
        expected = "body/z, hip/q and piston/x or knee/q of every leg were expected"
        raise KembaError(source.name, "cannot be shown", expected)
    places = np.array([list(pose.points.values()) for robot in shown for pose in robot])
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    legs, ground = machine.mechanism.legs, machine.mechanism.scene.ground
    return {
        "time": [round(float(time), 4) for time in times],
        "motions": [_robot(robot, legs) for robot in shown if robot],
        "legs": legs,
        "cylinder": CYLINDER,
        "range": [low[0], high[0]],
        "ground": [c.round(4).tolist() for c in ground.line(low[0] - BESIDE, high[0] + BESIDE)],
        "obstacles": [
            [c.round(4).tolist() for c in box.outline(ground)]
            for box in machine.mechanism.scene.obstacles
        ],
        "centre": [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2],
        "size": float(max(high - low)),
    }


def _times(source: Source, ghost: Source | None) -> Array:
    """Times [s] of the poses: while the ghost moves, and a little longer."""
    low, high = (float(source.trajectory.time[i]) for i in (0, -1))
    if ghost is not None:
        low = max(low, float(ghost.trajectory.time[0]) - AROUND)
        high = min(high, float(ghost.trajectory.time[-1]) + AROUND)
    return np.linspace(low, high, max(2, round((high - low) * RATE) + 1))


def _robot(shown: list[Pose], legs: tuple[str, ...]) -> dict[str, Any]:
    return {
        "points": {n: [pose.points[n].round(4) for pose in shown] for n in shown[0].points},
        "valves": {leg: ["".join(map(str, pose.valves[leg])) for pose in shown] for leg in legs},
        "stands": {leg: [int(pose.stands[leg]) for pose in shown] for leg in legs},
        "centres": [pose.centre.round(4) for pose in shown],
    }


def write_page(path: str | Path, title: str, body: str) -> Path:
    """Write one whole HTML page. Raises KembaError."""
    path = Path(path)
    text = fill(
        "page.html", title=escape(title), css=page_text("page.css"), body=body,
        version=kemba.__version__,
    )  # fmt: skip
    with atomic_text(path) as stream:
        stream.write(text)
    return path


def fill(name: str, **values: str) -> str:
    """A page of this package with its `$names` replaced."""
    return Template(page_text(name)).substitute(values)


def page_text(name: str) -> str:
    """The text of a file in `pages`."""
    return (PAGES / name).read_text(encoding="utf-8")


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
    return write_rerun(source, fresh(out, force, "--rerun", [ENDING]), model, ghost)


def write_rerun(
    source: Source, path: str | Path, model: str | None = None, ghost: Source | None = None
) -> Path:
    """Write the motion of a source as `path` (.rrd), with the blueprint of its views; `ghost`: a
    second motion, drawn pale.

    Raises KembaError where rerun-sdk is not installed, columns are missing or the file cannot be
    written.
    """
    path = ended(path, [ENDING])
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
            _record_robot(stream, f"scene/{name}", staged, motion, COLOURS["plan" if ghost and
                   sources[name] is ghost else "robot"])  # fmt: skip
        for name, one in sources.items():
            _columns(stream, name, one)
        stream.disconnect()
    return path


def _called(source: Source, beside: Source | None = None) -> str:
    """The path of a source's entities: what it is, unless the other one is that too."""
    name = "plan" if source.plan else "log"
    return name if beside is None or beside.plan != source.plan else f"{name}_ghost"


def _record_robot(
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
