"""The conditions of an execution on a model: other effects, another first pose."""

from __future__ import annotations

from collections.abc import Mapping

from kemba.config import parse
from kemba.effects import Effect
from kemba.effects.catalogue import BY_KIND
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.events import STANDS
from kemba.model import Model
from kemba.plant.replay import first_row
from kemba.quantity import to_si
from kemba.scenarios.schema import Conditions
from kemba.trajectory import Trajectory


def changed_effects(model: Model, conditions: Conditions) -> list[Effect]:
    """The effects that differ from the plant's. Raises KembaError for unknown kinds."""
    changed: list[Effect] = [Payload(m=conditions.payload)] if conditions.payload else []
    for kind, parameters in conditions.effects.items():
        if kind not in BY_KIND:
            raise KembaError(f"effects.{kind}", "no such effect", hint=suggest(kind, BY_KIND))
        listed = next((e for e in model.effects if e.name == kind), None)
        own = listed.model_dump() if listed else {}
        try:
            changed.append(parse({**own, "kind": kind, **parameters}, BY_KIND[kind]))
        except KembaError as error:
            raise KembaError(f"effects.{kind}", error.what, error.expected, error.hint) from None
    return changed


def start_offsets(model: Model, conditions: Conditions) -> dict[str, float]:
    """Offsets of the first pose in SI units. Raises KembaError for what is no coordinate."""
    mechanism = model.mechanism
    knees = {f"{leg}/knee/q" for leg in mechanism.legs}  # their pistons are easier to picture
    units = {c.name: c.unit for c in mechanism.coordinates if c.name not in knees}
    units |= {f"{leg}/piston/x": "m" for leg in mechanism.legs}
    offsets = {}
    for name, value in conditions.start.items():
        if name not in units:
            raise KembaError(f"start.{name}", "no such coordinate", hint=suggest(name, units))
        try:
            offsets[name] = to_si(value, units[name])
        except ValueError as error:
            raise KembaError(f"start.{name}", str(error)) from None
    return offsets


def standing(model: Model, table: Trajectory, offsets: Mapping[str, float]) -> dict[str, float]:
    """The table's first pose, moved; a lower foot that stands is put on the ground again."""
    from kemba.plant.simulate import initial_values, lowest_foot

    if not offsets:
        return {}
    pose = first_row(model, table)
    moved = {name: pose.get(name, 0.0) + offset for name, offset in offsets.items()}
    if lowest_foot(model, pose) > STANDS:
        return moved  # it is dropped: held in the air as the table says
    q, *_ = initial_values(model, pose | moved)
    height = q[[c.name for c in model.mechanism.coordinates].index("body/z")]
    lowest = lowest_foot(model, pose | moved)
    return moved | {"body/z": float(height - lowest)}
