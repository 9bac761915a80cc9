"""A scene: the ground and its obstacles, as a task or the sidecar of a log writes them.

Lines of terrain begin one behind the other. Between two of them the ground goes from the one to the
other over the width `EDGE` by a polynomial with two continuous derivatives, so that a wall is a
steep, rounded contact like any other, and the same in plans, executions and identification. The
rounding lies on the lower side: the ground is nowhere lower than the one that is written, but for
0.2 mm at the foot of a ramp. Every subclass of `Terrain` is a kind of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi, tan
from typing import Annotated, Any, ClassVar

import casadi as ca
import numpy as np
from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, core_schema

from kemba.config import Document, Section, parse
from kemba.config.document import Location
from kemba.errors import KembaError
from kemba.quantity import Param


class Terrain(Section):
    """The ground from the place `from` on, up to the next line that says the same; without
    `from`, everywhere. A line with nothing but `friction` changes no height."""

    begin: Annotated[float, Param("m", lower=-5.0, upper=5.0, doc="place x")] | None = Field(
        default=None, alias="from"
    )
    friction: Annotated[float, Param("1", lower=0.0, doc="friction coefficient")] | None = None

    key: ClassVar[str] = "friction"  # by which a line is known to be of this kind

    def surface(self, x: ca.SX, before: float) -> ca.SX | None:
        """Height [m] at x [m], smooth also before `from`; `before`: height of the ground that ends
        there. None: it stays as it is."""
        return None

    def levelled(self, base: float) -> Terrain:
        """The line at a height of `base` [m]; as it is where a kind is not level."""
        return self

    def dump(self) -> dict[str, Any]:
        """The line as a file writes it."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True)


class Ramp(Terrain):
    """`{from: 1.2 m, slope: 10 deg}`; with `height` that of its beginning."""

    slope: Annotated[float, Param("rad", lower=-pi / 4, upper=pi / 4, doc="upwards along x")]
    height: Annotated[float, Param("m", lower=-2.0, upper=2.0, doc="where it begins")] | None = None

    key: ClassVar[str] = "slope"

    def surface(self, x: ca.SX, before: float) -> ca.SX:
        first = before if self.height is None else self.height
        return first + tan(self.slope) * (x - (self.begin or 0.0))


class Level(Terrain):
    """`{from: 0.45 m, height: 0.15 m}`."""

    height: Annotated[float, Param("m", lower=-2.0, upper=2.0, doc="above 0")]

    key: ClassVar[str] = "height"

    def surface(self, x: ca.SX, before: float) -> ca.SX:
        return ca.SX(self.height)

    def levelled(self, base: float) -> Level:
        return self.model_copy(update={"height": base})


def kinds() -> dict[str, type[Terrain]]:
    """Every kind by the key that tells it from the others; `friction` alone is the plain one."""
    found: list[type[Terrain]] = [*Terrain.__subclasses__(), Terrain]
    return {kind.key: kind for kind in found}


class _OfAnyKind:
    """Marks a field that holds terrain of the kind whose key it has."""

    def members(self) -> Iterable[type[Terrain]]:
        """The classes that are allowed there (to locate errors)."""
        return kinds().values()

    def _read(self, value: Any) -> Terrain:
        if isinstance(value, Terrain):
            return value
        if not isinstance(value, dict) or not value.keys() & kinds().keys():
            raise ValueError(f"says nothing of the ground; one of {', '.join(kinds())} is expected")
        return next(kind for key, kind in kinds().items() if key in value).model_validate(value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self._read, serialization=core_schema.plain_serializer_function_ser_schema(Terrain.dump)
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [kind.model_json_schema() for kind in self.members()]}


AnyTerrain = Annotated[Terrain, _OfAnyKind()]


EDGE = 0.02  # m; about the way of a foot in two steps of a plan, so that nodes see an edge
LEVEL = 1e-9  # m; a smaller jump between two lines is none


def rise(x: ca.SX, begin: float) -> ca.SX:
    """0 before `begin` [m], 1 from `begin` + `EDGE` on, twice continuously differentiable."""
    u = ca.fmax(0, ca.fmin(1, (x - begin) / EDGE))
    return u**3 * (10 - u * (15 - 6 * u))


def larger(a: ca.SX, b: ca.SX) -> ca.SX:
    """The larger of two lengths [m], twice continuously differentiable: up to 1.5 mm less where
    they differ by less than `EDGE`."""
    apart = (a - b) / EDGE
    u = ca.fmin(1, apart**2)
    return (a + b + EDGE * (u * (15 - u * (10 - 3 * u)) / 8 + ca.fmax(0, ca.fabs(apart) - 1))) / 2


def beside(s: ca.SX) -> ca.SX:
    """A way aside `s` [m], twice continuously differentiable; within a solid `STEEP` times it, from
    a depth of `EDGE` on: a motion through a solid is led over it, not torn apart."""
    t = ca.fmax(0, -s / EDGE)
    u = ca.fmin(1, t)
    return s - (STEEP - 1) * EDGE * (u**3 * (1 - u / 2) + ca.fmax(0, t - 1))


STEEP = 10.0  # so that 1 m below the top of a box 16 cm wide the way out of its middle is up


@dataclass(frozen=True)
class Solid:
    """What lies between two places [m] below a `top` [m] over x."""

    begin: float
    end: float
    top: Callable[[ca.SX], ca.SX]

    def distance(self, x: ca.SX, z: ca.SX) -> ca.SX:
        """How far [m] a point is above or beside it, the greater of both; negative inside."""
        out = z - self.top(x)
        if np.isfinite(self.begin):
            out = larger(out, beside(self.begin - x))
        return larger(out, beside(x - self.end)) if np.isfinite(self.end) else out


class Ground:
    """The ground of lines of terrain; flat at 0 without any.

    Places x [m] are numbers, arrays (n,) or SX; what is found has their form, but for ground that
    is `level`, where height, slope and normal are plain numbers.
    """

    def __init__(self, terrain: Sequence[Terrain] = ()) -> None:
        self.pieces = sorted(terrain, key=lambda t: -np.inf if t.begin is None else t.begin)

    @cached_property
    def level(self) -> float | None:
        """The height [m] of ground that is level everywhere; None where it is not."""
        h = ca.simplify(self._expressions[1])
        return float(h) if h.is_constant() else None

    @cached_property
    def stretches(self) -> Sequence[Solid]:
        """What the ground consists of: one solid where it has no walls, else one between each, with
        its edges."""
        x, _, found = self._expressions
        faces = [*(face for face, _ in found), np.inf]
        tops = [ca.Function("top", [x], [top]) for _, top in found]
        return [Solid(a, b, top) for a, b, top in zip(faces[:-1], faces[1:], tops, strict=True)]

    @cached_property
    def _expressions(self) -> tuple[ca.SX, ca.SX, list[tuple[float, ca.SX]]]:
        """A place x [m], the height there, and where each stretch begins, with its own height."""
        x, h, last = ca.SX.sym("x"), ca.SX(0), ca.SX(0)
        stretches = [(-np.inf, h)]
        for piece in self.pieces:
            at = piece.begin or 0.0
            before = _at(last, x, at)
            new = piece.surface(x, before)
            if new is None:
                continue
            jump = _at(new, x, at) - before
            if piece.begin is None:
                h = new
                stretches = [(-np.inf, h)]
            elif not ca.is_equal(ca.SX(new), ca.SX(last), 3):
                wall = abs(jump) >= LEVEL
                step = rise(x, at - (float(jump > 0) if wall else 0.5) * EDGE) * (new - last)
                h = h + step
                if wall:
                    stretches.append((at - np.sign(jump) * EDGE, ca.SX(new)))
                else:
                    begin, top = stretches[-1]
                    stretches[-1] = begin, top + step
            last = ca.SX(new)
        return x, h, stretches

    @cached_property
    def _functions(self) -> tuple[ca.Function, ca.Function]:
        x, h, _ = self._expressions
        slope = ca.densify(ca.jacobian(h, x))
        return ca.Function("height", [x], [h]), ca.Function("slope", [x], [slope])

    def height(self, x: Any) -> Any:
        """Height [m] at x."""
        return self.level if self.level is not None else called(self._functions[0], x)

    def slope(self, x: Any) -> Any:
        """Its derivative along x [1]."""
        return 0.0 if self.level is not None else called(self._functions[1], x)

    def normal(self, x: Any) -> tuple[Any, Any]:
        """Components (x, z) of the unit vector out of the ground; along the ground, forward, is
        (z, -x)."""
        if self.level is not None:
            return 0.0, 1.0
        slope = self.slope(x)
        size = (1 + slope**2) ** 0.5
        return -slope / size, 1 / size

    def depth(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """How deep [m] points (n,) are in the ground, 0 above it: the way to the nearest point of
        its surface within 10 cm, which at a wall is far less than that to the top."""
        below = np.maximum(self.height(x) - z, 0.0)
        for aside in np.linspace(-0.1, 0.1, 101) if self.level is None else ():
            way = np.hypot(aside, np.maximum(self.height(x + aside) - z, 0.0))
            below = np.minimum(below, way)
        return np.asarray(below)

    def friction(self, x: Any, usual: Any) -> Any:
        """Friction coefficient at x, `usual` where no line says one."""
        mu = last = usual
        for piece in (p for p in self.pieces if p.friction is not None):
            if piece.begin is None:
                mu = piece.friction
            else:
                share = share_of(x, piece.begin - EDGE)
                mu = mu + share * (piece.friction - last)
            last = piece.friction
        return mu

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest height [m] within 5 m of x = 0."""
        if self.level is not None:
            return self.level, self.level
        heights = self.height(np.linspace(-5.0, 5.0, 2001))
        return float(heights.min()), float(heights.max())

    def line(self, a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights (n,) [m] from `a` to `b` that draw it."""
        x = np.linspace(a, b, 2 if self.level is not None else max(2, int((b - a) / EDGE * 4)))
        return x, np.broadcast_to(self.height(x), x.shape)


def _at(expression: Any, x: ca.SX, place: float) -> float:
    return float(ca.Function("at", [x], [ca.SX(expression)])(place))


def share_of(x: Any, begin: float) -> Any:
    """`rise` at places of any form."""
    place = ca.SX.sym("x")
    return called(ca.Function("share", [place], [rise(place, begin)]), x)


def called(function: ca.Function, x: Any) -> Any:
    """A scalar function at a number, at every entry of an array (n,), or of an expression."""
    if isinstance(x, ca.SX):
        return function(x)
    values = np.asarray(x, dtype=float)
    found = np.asarray(function(values.reshape(1, -1))).reshape(values.shape)
    return found if values.ndim else float(found)


Place = Annotated[float, Param("m", lower=-5.0, upper=5.0, doc="place x")]


class Obstacle(Section):
    """A box: nothing of the robot is within `from` to `to` below its `height` above the ground."""

    begin: Place = Field(alias="from")
    to: Place
    height: Annotated[float, Param("m", lower=0.001, upper=2.0, doc="above the ground")]

    @model_validator(mode="after")
    def _has_width(self) -> Obstacle:
        if self.to <= self.begin:
            raise ValueError(f"to {self.to:g} m does not come after from {self.begin:g} m")
        return self

    @property
    def middle(self) -> float:
        """Its place [m]."""
        return (self.begin + self.to) / 2

    def top(self, ground: Ground) -> float:
        """Height [m] of its top; it stands on the ground under its middle."""
        return float(ground.height(self.middle)) + self.height

    def solid(self, ground: Ground) -> Solid:
        """What it takes, as much wider as edges of the ground are where they are half as high."""
        top = self.top(ground)
        return Solid(self.begin - EDGE / 2, self.to + EDGE / 2, lambda x: ca.SX(top))

    def outline(self, ground: Ground) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights (4,) [m] of its corners."""
        low = [float(ground.height(x)) for x in (self.begin, self.to)]
        top = self.top(ground)
        return (
            np.array([self.begin, self.begin, self.to, self.to]),
            np.array([low[0], top, top, low[1]]),
        )


AROUND = 0.03  # m; how far a start guess keeps from an obstacle
POINTS = ("foot", "knee", "hip")  # of a leg; hips are the corners of the body


class Scene(Section):
    """Lines of terrain and obstacles; flat at 0 without any. Equal scenes say the same."""

    terrain: tuple[AnyTerrain, ...] = ()
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

    @property
    def cornered(self) -> bool:
        """Whether there are walls or obstacles, whose corners a motion may cut."""
        return bool(self.obstacles) or len(self.ground.stretches) > 1

    def levelled(self, x: float) -> Scene:
        """The scene without obstacles, its ground as high everywhere as at x [m]."""
        base = float(self.ground.height(x))
        return Scene(terrain=tuple(line.levelled(base) for line in self.terrain))

    def skyline(self, x: np.ndarray) -> np.ndarray:
        """Height [m] of what is lowest for a foot at places x (n,): the ground, or `AROUND` an
        obstacle as much above its top."""
        low = np.broadcast_to(self.ground.height(x), x.shape)
        for box in self.obstacles:
            near = (x > box.begin - AROUND) & (x < box.to + AROUND)
            low = np.where(near, box.top(self.ground) + AROUND, low)
        return low

    def dump(self) -> dict[str, Any]:
        """Its keys as a file writes them."""
        return self.model_dump(mode="json", by_alias=True, exclude_defaults=True)

    def faults(self) -> Iterator[tuple[Location, str]]:
        """What cannot be, and where: lines of terrain or obstacles that overlap."""
        for kind in ("height", "friction"):
            begun: list[tuple[float, int]] = []
            for i, line in enumerate(self.terrain):
                if not (_shaping(line) if kind == "height" else line.friction is not None):
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


def scene_in(meta: Mapping[str, Any], where: str = "") -> Scene:
    """The scene that a sidecar, or the data of a task, says. Raises KembaError where it is wrong,
    at `where`."""
    given = {key: meta[key] for key in Scene.model_fields if meta.get(key)}
    if not given:
        return FLAT
    scene = parse(Document(given, where), Scene)
    for location, what in scene.faults():
        raise KembaError(where, f"{location[0]}[{location[1]}]: {what}")
    return scene


def _shaping(line: Terrain) -> bool:
    return type(line) is not Terrain


def _overlap(kind: str, line: Terrain, other: int) -> str:
    if line.begin is None:
        return f"says the {kind} everywhere, as terrain[{other}] does; give one of them a `from`"
    begins = f"says the {kind} from {line.begin:g} m on"
    return f"{begins}, within the edge of terrain[{other}]; {200 * EDGE:g} cm apart were expected"
