"""The rules that keep the tree readable: imports one way, small files, nothing heavy at --help."""

import ast
import re
import statistics
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib

ROOT = Path(__file__).parent.parent

# From the bottom up; a room may import its own level and those below.
LEVELS = [
    {"errors"},
    {"cache", "files", "instructions", "machine_code", "settings", "stopwatch", "units"},
    {"folders"},
    {"quantity"},
    {"config"},
    {"trajectory"},
    {"scene"},
    {"logs"},
    {"mechanism"},
    {"effects"},
    {"model"},
    {"events"},
    {"ocp", "plant"},
    {"contract", "identify"},
    {"runs"},
    {"policy", "sensitivity"},
    {"scenarios"},
    {"solve"},
    {"plotting", "report"},
    {"sweep"},
    {"rounds"},
    {"api"},
    {"cli"},
]
LEVEL = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}
ONLY_IN = {
    "pinocchio": {"mechanism"},
    "matplotlib": {"plotting", "api"},
    "typer": {"cli"},
    "rich": {"cli"},
    "dask": {"sweep"},
    "distributed": {"sweep"},
    "pint": {"units"},
    "yaml": {"config"},
    "filelock": {"folders"},
    "pandas": {"logs", "trajectory"},
    "pyarrow": {"logs"},
    "mcap": {"logs"},
    "rosbags": {"logs"},
    "google": {"logs"},
    "matio": {"logs"},
    "asammdf": {"logs"},
    "nptdms": {"logs"},
    "pyulog": {"logs"},
    "rerun": {"report"},
}
SOURCES = sorted([*ROOT.glob("kemba/**/*.py"), *ROOT.glob("cli/**/*.py")])
FOLDERS = (".", ".ci", ".github", "cli", "configs", "docs", "kemba", "tests")
TEXTS = [
    path
    for folder in FOLDERS
    for path in (ROOT / folder).glob("*" if folder == "." else "**/*")
    if path.is_file() and path.suffix in {".md", ".py", ".toml", ".yaml", ".yml"}
]


def room(path: Path) -> str:
    """The room a source file belongs to."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return "cli" if parts[0] == "cli" else parts[1]


def imported(path: Path) -> Iterator[tuple[str, int]]:
    """Every imported module and its line, wherever in the file it is imported."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: write the import in full"
            yield node.module or "", node.lineno
            if node.module == "kemba":
                yield from ((f"kemba.{alias.name}", node.lineno) for alias in node.names)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_go_one_way(path: Path) -> None:
    own = room(path)
    for module, line in imported(path):
        top, *rest = module.split(".")
        assert own in ONLY_IN.get(top, {own}), f"{path}:{line}: {top} belongs in {ONLY_IN[top]}"
        target = "cli" if top == "kemba_cli" else rest[0] if top == "kemba" and rest else None
        if target and own != "__init__":
            assert LEVEL[target] <= LEVEL[own], f"{path}:{line}: {own} must not import {target}"


def test_a_name_means_one_thing() -> None:
    """No two classes are called the same."""
    names = Counter(
        node.name
        for path in SOURCES
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef)
    )
    assert [name for name, count in names.items() if count > 1] == []


# Within planning, from the bottom up.
PLANNING = [
    "task",
    "functions",
    "nlp",
    "mpcc",
    "transcription",
    "certificate",
    "relaxation",
    "phases",
    "refinement",
]
PLANNING += ["continuation", "infeasibility", "planned", "planner", "finer"]
PLANNING += ["raised", "planning"]


def test_planning_is_built_from_the_bottom_up() -> None:
    """A room of planning imports no room above it, so that `nlp` knows no robot and no task."""
    for path in (ROOT / "kemba/ocp").rglob("*.py"):
        own = module_name(path).split(".")[2:3]
        for module, line in imported(path):
            target = module.split(".")[2:3] if module.startswith("kemba.ocp.") else []
            if own and target and own[0] in PLANNING and target[0] in PLANNING:
                above = PLANNING.index(target[0]) > PLANNING.index(own[0])
                assert not above, f"{path}:{line}: {own[0]} must not import {target[0]}"


def test_functions_for_ipopt_know_no_model() -> None:
    """`nlp` is about nonlinear programs alone."""
    for path in (ROOT / "kemba/ocp/nlp").glob("*.py"):
        for module, line in imported(path):
            known = module.split(".")[:2] != ["kemba", "model"]
            assert known and not module.startswith("kemba.ocp.task"), f"{path}:{line}: {module}"


def test_no_circular_imports() -> None:
    """Of all imports, also those inside functions and under TYPE_CHECKING."""
    assert circles(import_graph()) == []


def test_circles_are_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set[str](), "e": {"a"}}
    assert circles(graph) == [{"b", "c"}]


def module_name(path: Path) -> str:
    """The dotted name under which a source file is imported."""
    parts = list(path.relative_to(ROOT).with_suffix("").parts)
    parts[0] = {"cli": "kemba_cli"}.get(parts[0], parts[0])
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def import_graph() -> dict[str, set[str]]:
    """Which of our modules every one of our modules imports, wherever in its file."""
    modules = {module_name(path): path for path in SOURCES}
    graph: dict[str, set[str]] = {}
    for name, path in modules.items():
        targets: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                targets |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                whole = [f"{node.module}.{alias.name}" for alias in node.names]
                targets |= {full if full in modules else str(node.module) for full in whole}
        graph[name] = (targets & set(modules)) - {name}
    return graph


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Groups of modules that import each other: each reaches every other of its group."""
    reach: dict[str, set[str]] = {}
    for name in graph:
        todo, seen = [name], set[str]()
        while todo:
            new = graph[todo.pop()] - seen
            seen |= new
            todo += new
        reach[name] = seen
    groups = [{b for b in reach[a] if a in reach[b]} for a in graph if a in reach[a]]
    return [group for i, group in enumerate(groups) if group not in groups[:i]]


def test_files_are_small() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert max(lengths.values()) <= 500, max(lengths, key=lambda path: lengths[path])
    assert statistics.median(lengths.values()) < 200


def test_rooms_are_small() -> None:
    rooms = Counter(path.parent for path in SOURCES if path.name != "__init__.py")
    assert max(rooms.values()) <= 20, max(rooms, key=lambda path: rooms[path])


@pytest.mark.skipif(sys.version_info < (3, 11), reason="tomllib came with Python 3.11")
def test_every_package_is_installed() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    folders = {path.parent for path in SOURCES}
    names = {re.sub("^cli", "kemba_cli", ".".join(f.relative_to(ROOT).parts)) for f in folders}
    listed = project["tool"]["setuptools"]["packages"]
    assert listed == sorted(names | {"kemba_configs"})
    assert all((folder / "__init__.py").is_file() for folder in folders)


def test_nothing_names_a_machine() -> None:
    place = re.compile(r"(?<![\w.:)~-])/(?:home|root|tmp|work|Users)/\w|index-url")
    for path in TEXTS:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            assert not place.search(line) or "re.compile" in line, f"{path}:{number}: {line}"


def test_planning_does_not_wait_for_slow_imports() -> None:
    """Building a program takes less time than these modules take to import."""
    slow = [f"scipy.{m}" for m in ("integrate", "interpolate", "optimize", "sparse", "stats")]
    slow.append("matplotlib")
    code = (
        "import importlib, sys; importlib.import_module('kemba.ocp.planning');"
        f"print([m for m in {slow} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
