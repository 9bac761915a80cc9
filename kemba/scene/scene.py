"""A scene: the ground and its obstacles, as a task or the sidecar of a log writes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from kemba.config import Document, Section, parse
from kemba.config.document import Location
from kemba.errors import KembaError
from kemba.scene.ground import EDGE, Ground
from kemba.scene.obstacles import Obstacle
from kemba.scene.terrain import AnyTerrain, Terrain

AROUND = 0.03  # m; how far a start guess keeps from an obstacle
POINTS = ("foot", "knee", "hip")  # of a leg; hips are the corners of the body


@dataclass(frozen=True)
class Scene:
    """Lines of terrain and obstacles; flat at 0 without any. Equal scenes say the same."""

    terrain: tuple[Terrain, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()

    @cached_property
    def ground(self) -> Ground:
        """Height, slope, normal and friction at any place."""
        return Ground(self.terrain)

    @property
    def plain(self) -> bool:
        """Whether the ground is level at 0 and free: heights above it are heights."""
        return self.ground.level == 0.0 and not self.obstacles

    @property
    def even(self) -> bool:
        """Whether every place of it is like every other."""
        friction = any(t.friction is not None and t.begin is not None for t in self.terrain)
        return self.ground.level is not None and not self.obstacles and not friction

    def skyline(self, x: np.ndarray) -> np.ndarray:
        """Height [m] of what is lowest for a foot at places x (n,): the ground, or `AROUND` an
        obstacle as much above its top."""
        low = np.broadcast_to(self.ground.height(x), x.shape)
        for box in self.obstacles:
            near = (x > box.begin - AROUND) & (x < box.to + AROUND)
            low = np.where(near, box.top(self.ground) + AROUND, low)
        return low

    def json(self) -> dict[str, Any]:
        """Its keys as a file writes them."""
        boxes = [o.model_dump(mode="json", by_alias=True) for o in self.obstacles]
        lines = [t.dump() for t in self.terrain]
        return {k: v for k, v in (("terrain", lines), ("obstacles", boxes)) if v}

    def faults(self) -> Iterator[tuple[Location, str]]:
        """What cannot be, and where: lines of terrain or obstacles that overlap."""
        for kind, told in (("height", _shaping), ("friction", _gripping)):
            begun: list[tuple[float, int]] = []
            for i, line in enumerate(self.terrain):
                if not told(line):
                    continue
                at = -np.inf if line.begin is None else line.begin
                near = [j for other, j in begun if at == other or abs(at - other) < 2 * EDGE]
                if near:
                    yield ("terrain", i), _overlap(kind, line, near[0])
                begun.append((at, i))
        edges = [t.begin for t in self.terrain if _shaping(t) and t.begin is not None]
        for i, box in enumerate(self.obstacles):
            for j, other in enumerate(self.obstacles[:i]):
                if box.begin < other.to + 2 * EDGE and other.begin < box.to + 2 * EDGE:
                    yield ("obstacles", i), f"overlaps obstacles[{j}], edges of 2 cm included"
            if any(box.begin - EDGE < edge < box.to + EDGE for edge in edges):
                yield ("obstacles", i), "stands on an edge of the terrain; move it off"


FLAT = Scene()


class SceneKeys(Section):
    """The keys of a scene in the sidecar of a log."""

    terrain: tuple[AnyTerrain, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()


def scene_in(meta: Mapping[str, Any], where: str = "") -> Scene:
    """The scene that a sidecar, or the data of a task, says. Raises KembaError where it is wrong,
    at `where`."""
    given = {key: meta[key] for key in SceneKeys.model_fields if meta.get(key)}
    if not given:
        return FLAT
    keys = parse(Document(given, where), SceneKeys)
    scene = Scene(keys.terrain, keys.obstacles)
    for location, what in scene.faults():
        raise KembaError(where, f"{location[0]}[{location[1]}]: {what}")
    return scene


def _shaping(line: Terrain) -> bool:
    return type(line) is not Terrain


def _gripping(line: Terrain) -> bool:
    return line.friction is not None


def _overlap(kind: str, line: Terrain, other: int) -> str:
    if line.begin is None:
        return f"says the {kind} everywhere, as terrain[{other}] does; give one of them a `from`"
    begins = f"says the {kind} from {line.begin:g} m on"
    return f"{begins}, within the edge of terrain[{other}]; {200 * EDGE:g} cm apart were expected"
