"""Walls and obstacles for the program that seeks a plan: on which side of each a point is, and
when.

That a foot, a knee or a hip keeps off a wall means that it is before it, above it or behind it: a
disjunction, on which a gradient says nothing until the right one is chosen. Here the course of the
start guess chooses, node by node; where one side follows another both hold, so that no corner is
cut (as binary variables do in path planning: Richards and How, American Control Conference 2002).
What is left are bounds of places and heights.

Ground that is level between its walls then is one level ground, whose height changes while all feet
fly. What is planned so is judged, and refined, in the scene.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from math import inf
from operator import itemgetter
from typing import Any

import casadi as ca
import numpy as np

from kemba.mechanism.robot import robot_mechanism
from kemba.model import Model
from kemba.ocp.planner import Planner, grids
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.task.expressions import is_expression
from kemba.ocp.task.requirement import Requirement, quantities, quantity_expression
from kemba.ocp.transcription.layout import Layout
from kemba.ocp.transcription.level import GroundRise, ground_after
from kemba.ocp.transcription.symmetry import whole
from kemba.scene.scene import EDGE, Solid
from kemba.trajectory import Array

ROUNDED = 2e-3  # m; farther off a side: distances from corners are up to 1.5 mm less
STANDS = 5e-3  # m; a lower foot of a guess stands
KEPT = re.compile(r"(\w+/\w+)/(distance|room)(\d*)")  # by which a point keeps off a solid
EARLIER = 3  # nodes of the coarsest grid; so much before and after the guess a point may pass
IN_FRONT, OVER, BEHIND = -1, 0, 1  # the sides of a solid
OF_SCENE = ("/z", "/distance", "/room")  # what an expression must not hold: it is another then


def on_level_ground(planner: Planner) -> Planner | None:
    """The planner of the same motion on level ground, with sides for walls and obstacles; None
    where the scene has none, is not level between them, or feet stand on two heights at once."""
    scene, old = planner.task.scene, planner.model
    level = scene.levelled(planner.task.place_x)
    named = [r.quantity.name for r in planner.requirements]
    strange = any(is_expression(name) and any(s in name for s in OF_SCENE) for name in named)
    if not (scene.cornered and planner.coarse) or level.ground.level is None or strange:
        return None
    course = GuessedCourse(planner)
    if not course.flies:
        return None
    mechanism = old.mechanism
    ground = robot_mechanism(mechanism.drawn or mechanism.need_robot(), mechanism.offsets)
    model = Model(ground.on(level, mechanism.origin[0]), old.effects, old.supply, old.name)
    asked = [part for r in planner.requirements for part in course.on_level(r)]
    asked += course.standing()
    return replace(planner, model=model, requirements=asked, scene=planner, rises=course.rises)


@dataclass(frozen=True)
class GuessedCourse:
    """Where the points of a robot are by the start guess, at the nodes of the coarsest grid."""

    planner: Planner

    @cached_property
    def nodes(self) -> int:
        """Steps of that grid."""
        return grids(self.planner.task.nodes, self.planner.task.duration)[0]

    @cached_property
    def places(self) -> dict[str, Array]:
        """x and z (2, nodes + 1) [m] of feet, knees and hips, by the guess without noise."""
        model, asked = self.planner.model, self.planner.requirements
        task = self.planner.task.model_copy(update={"guess_noise": 0.0})
        layout = Layout(model, whole(model.node), task.duration / self.nodes, task.step_variation)
        q = layout.full(automatic_guess(model, task, asked, layout, self.nodes), "q")
        points = [name[:-2] for name in model.mechanism.ports if re.fullmatch(r"\w+/\w+/z", name)]
        at = [quantity_expression(model, f"{point}/{axis}") for point in points for axis in "xz"]
        found = ca.Function("places", [model.node.q], [ca.vertcat(*at)]).map(len(q))(q.T)
        return dict(zip(points, np.split(np.array(found), len(points)), strict=True))

    @cached_property
    def stretches(self) -> list[tuple[Solid, float]]:
        """What the ground consists of, with the heights [m]."""
        solids = self.planner.task.scene.ground.stretches
        return [(solid, float(solid.top(ca.SX(0.0)))) for solid in solids]

    @cached_property
    def under(self) -> Array:
        """The number of the stretch under every foot (legs, nodes + 1)."""
        begins = [solid.begin for solid, _ in self.stretches[1:]]
        feet = [self.places[f"{leg}/foot"][0] for leg in self.planner.model.mechanism.legs]
        return np.asarray(np.searchsorted(begins, feet, side="right"))

    @cached_property
    def gaps(self) -> Array:
        """Heights of the feet above it (legs, nodes + 1) [m]."""
        feet = [self.places[f"{leg}/foot"][1] for leg in self.planner.model.mechanism.legs]
        return np.asarray(feet) - self.ground

    @property
    def ground(self) -> Array:
        """Heights of the ground under the feet (legs, nodes + 1) [m]."""
        tops = np.array([top for _, top in self.stretches])
        return np.asarray(tops[self.under])

    @cached_property
    def rises(self) -> tuple[GroundRise, ...]:
        """When the lowest ground under a foot changes: upwards with the last foot, downwards with
        the first one."""
        changes = np.diff(self.ground.min(axis=0))
        nodes = map(int, np.flatnonzero(changes))
        return tuple(GroundRise((k + 1) / self.nodes, float(changes[k])) for k in nodes)

    @property
    def flies(self) -> bool:
        """Whether all feet are off the ground whenever it changes, and stand on one height."""
        nodes = [round(rise.share * self.nodes) for rise in self.rises]
        clear = self.gaps > STANDS
        lowest = self.ground == self.ground.min(axis=0)
        return bool(clear[:, nodes].all() and (clear | lowest).all())

    def on_level(self, r: Requirement) -> Iterator[Requirement]:
        """What stands for a requirement on level ground."""
        kept = KEPT.fullmatch(r.quantity.name)
        if kept is not None:
            yield from self._sides(r, kept[1], self._solid(kept[2], int(kept[3] or 0)))
        elif r.quantity.name.endswith("/z"):
            yield from self._from_ground(r)
        else:
            yield r

    def _solid(self, kind: str, number: int) -> Solid:
        scene = self.planner.task.scene
        if kind == "distance":
            return self.stretches[number][0]
        return scene.obstacles[number].solid(scene.ground)

    def _sides(self, r: Requirement, point: str, solid: Solid) -> Iterator[Requirement]:
        """Bounds of a point that keeps off a solid; behind the lowest ground it is above another
        one, and so above that too. Feet are not below their ground anyway."""
        known, (x, z) = quantities(self.planner.model), self.places[point]
        away, top = max(r.lower, 0.0) + ROUNDED, float(solid.top(ca.SX(0.0)))
        above = top + (away if r.lower >= 0.0 else r.lower)
        foot = point.endswith("/foot")
        lowest = top <= min(top for _, top in self.stretches)
        side = np.where(x >= solid.end + away, BEHIND, OVER)
        side = np.where(x <= solid.begin - away, IN_FRONT, side)
        side[1:][np.diff(side) == BEHIND - IN_FRONT] = OVER  # no point gets through in one step
        for _ in range(EARLIER):
            near = np.convolve(side == OVER, [1, 1, 1], "same") > 0
            side[near & (z >= above)] = OVER
        nodes = r.nodes(self.nodes)
        for way, first, last in runs(OVER if lowest else side[k] for k in nodes):
            during = self._share(r, nodes, first), self._share(r, nodes, last + 1)
            of = replace(
                r, quantity=known[f"{point}/{'z' if way == OVER else 'x'}"], at=None, during=during
            )
            if way == OVER:
                parts = self._from_ground(replace(of, lower=above))
                yield from (a for a in parts if not foot or a.lower > self.ground[0, 0])
            elif way == BEHIND:
                yield replace(of, lower=solid.end + away)
            else:
                yield replace(of, lower=-inf, upper=solid.begin - away)

    def _share(self, r: Requirement, nodes: Sequence[int], place: int) -> float:
        """The share of the motion at one of the `nodes` of a requirement; before the second and
        behind the last one where it begins and ends itself, which may be between nodes."""
        if r.at is None and not 0 < place < len(nodes):
            return r.during[place > 0]
        return nodes[min(place, len(nodes) - 1)] / self.nodes

    def _from_ground(self, r: Requirement) -> Iterator[Requirement]:
        """A requirement on a height above the ground at the start, as such of heights above the
        ground of their node; one for each ground."""
        before = r.minus is not None and r.minus.name.endswith("/z")
        earlier = ground_after(self.rises, r.minus.at) if r.minus and before else 0.0

        def from_ground(at: float) -> Requirement:
            ground = ground_after(self.rises, at) - earlier
            return replace(r, lower=r.lower - ground, upper=r.upper - ground)

        if r.at is not None:
            yield from_ground(r.at)
            return
        begin, end = r.during
        borders = [begin, *(e.share for e in self.rises if begin < e.share <= end)]
        for first, last in zip(borders, [*(b - BEFORE for b in borders[1:]), end], strict=True):
            yield replace(from_ground(first), during=(first, last))

    def standing(self) -> Iterator[Requirement]:
        """Feet that stand keep to their own ground, which on level ground ends nowhere."""
        known, tops = quantities(self.planner.model), [-inf, *(t for _, t in self.stretches), -inf]
        for leg, under, gaps in zip(
            self.planner.model.mechanism.legs, self.under, self.gaps, strict=True
        ):
            for (i, stands), first, last in runs(zip(under, gaps < STANDS, strict=True)):
                solid, top = self.stretches[i]
                lower = solid.begin + EDGE * (top > tops[i])
                upper = solid.end - EDGE * (top > tops[i + 2])
                if stands and (lower, upper) != (-inf, inf):
                    at = known[f"{leg}/foot/x"]
                    during = first / self.nodes, last / self.nodes
                    yield Requirement(("terrain",), at, None, lower, upper, during)


BEFORE = 1e-6  # of a motion: what ends before a rise ends so much before it


def runs(values: Iterable[Any]) -> Iterator[tuple[Any, int, int]]:
    """Equal values in a row, with the places of the first and the last."""
    for value, run in groupby(enumerate(values), itemgetter(1)):
        places = [place for place, _ in run]
        yield value, places[0], places[-1]
