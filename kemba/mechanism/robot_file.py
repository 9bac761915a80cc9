"""The one place where robot files are found and read."""

from pathlib import Path

from kemba.config import Document, is_file, load_yaml, parse, shipped_configs
from kemba.errors import KembaError, suggest
from kemba.mechanism.cylinder import Cylinder, CylinderTable, scaled
from kemba.mechanism.knee import flexion
from kemba.mechanism.links import Robot, RobotFile

ENDINGS = (".yaml", ".yml")  # other files are never read: messages may show lines of them
KNOWN_CYLINDER = "dsnu-25-70"  # whose figures are scaled when a robot names no other


def find_file(name: str | Path, kind: str, beside: Path | None = None) -> Path:
    """The whole path of a robot's or a cylinder's file (`kind`: the folder of configs/).

    `name`, with or without `.yaml`, is looked for in the folder `beside`, then in the current
    folder, then among the shipped files; from a shipped file, among the shipped ones first.
    Raises KembaError with the nearest names.
    """
    shipped = shipped_configs(kind)
    ours = {path.parent.parent for path in shipped.values()}
    folders = [*([beside] if beside else []), Path()]
    near = [folder / f"{name}{end}" for folder in folders for end in ("", ".yaml")]
    own = [path.resolve() for path in near if path.suffix in ENDINGS and is_file(path)]
    known = [shipped[key] for key in (str(name), f"{name}.yaml") if key in shipped]
    found = [*known, *own] if beside and beside.resolve().parent in ours else [*own, *known]
    if found:
        return found[0]
    listed = [path.name for folder in folders for path in folder.glob("*.yaml")]
    looked = "beside the file that names it, in the current folder and among the shipped ones"
    what = f"no such file: '{name}'"
    expected = f"one of the {kind} was looked for {looked}"
    raise KembaError(str(name), what, expected, suggest(str(name), [*shipped, *listed]))


def load_robot(name: str | Path) -> Robot:
    """The robot of a file: a path or a shipped name. Raises KembaError with every mistake."""
    path = find_file(name, "robots")
    document = load_yaml(path)
    written = parse(document, RobotFile)
    cylinder = _cylinder(written.cylinder, KNOWN_CYLINDER, document, ("cylinder",), (path,))
    robot = Robot.model_validate({**dict(written), "cylinder": cylinder})
    for x in (0.0, cylinder.stroke):
        try:
            flexion(robot.leg, x)
        except ValueError as error:
            expected = "femur, mount, pin and retracted length that close the triangle at both ends"
            at = ("leg", "piston")
            raise document.error(at, f"leg.piston: {error}", f"{expected} were expected") from None
    return robot


def load_cylinder(name: str | Path, asked: tuple[Path, ...] = ()) -> Cylinder:
    """The cylinder of a file: a path or a shipped name. Raises KembaError with every mistake.

    `asked`: cylinder files that led to this one; they detect a circle.
    """
    path = find_file(name, "cylinders")
    document = load_yaml(path)
    if path in asked:
        raise document.error(("like",), "like: leads back to this file")
    return _cylinder(parse(document, CylinderTable), None, document, (), (*asked, path))


def robot_files(name: str | Path) -> list[Path]:
    """The file of a robot and those of the cylinders whose figures it uses."""
    path = find_file(name, "robots")
    table = parse(load_yaml(path), RobotFile).cylinder
    files = [path]
    like: str | None = table.like or KNOWN_CYLINDER
    while like is not None:
        files.append(find_file(like, "cylinders", files[-1].parent))
        like = parse(load_yaml(files[-1]), CylinderTable).like
    return files


def _cylinder(
    table: CylinderTable,
    like: str | None,
    document: Document,
    at: tuple[str, ...],
    asked: tuple[Path, ...],
) -> Cylinder:
    """The cylinder of a table at `at` of a document, whose path is the last of
    `asked`; `like`: whose figures fill the gaps."""
    like = table.like or like
    given = table.given()
    try:
        if like is None:
            return parse(given, Cylinder)
        known = load_cylinder(find_file(like, "cylinders", asked[-1].parent), asked)
        return parse(scaled(known, given), Cylinder)
    except KembaError as error:
        what = ": ".join(part for part in (".".join(at), error.what) if part)
        raise document.error(at, what, error.expected, error.hint) from None
