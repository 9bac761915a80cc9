"""Model YAML (configs/models/*.yaml): a robot or rig, a supply pressure, a list of effects.

Models are also changed here: numbers by name, or drawn at random.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from kemba.config import (
    Document,
    Section,
    find_config,
    is_file,
    load_yaml,
    parse,
    shipped_configs,
    with_added,
)
from kemba.effects import AnyEffect, Effect
from kemba.effects.catalogue import CHAMBERS
from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.gas import VesselChamber
from kemba.effects.rigs.axis import DriveAxis
from kemba.effects.rigs.chambers import MeasuredChambers
from kemba.errors import ConfigErrors, KembaError, listed_errors, suggest
from kemba.mechanism import (
    CylinderRig,
    DriveRig,
    OwnRig,
    VesselRig,
    load_robot,
    own_mechanism,
    rig_mechanism,
    robot_mechanism,
)
from kemba.mechanism.robot_file import find_file, robot_files
from kemba.model.evidence import Array, Evidence, located, matrix_in
from kemba.model.model import NOMINAL_SUPPLY, Model
from kemba.quantity import Param
from kemba.scene import FLAT, Scene


def own_model(
    rig: CylinderRig | DriveRig | VesselRig, effects: Iterable[Effect] = (), name: str = "rig"
) -> Model:
    """The rig with its own physics and `effects`; one of the same name replaces it."""
    listed = {e.name: e for e in (brought_along(rig), *effects)}
    return Model(own_mechanism(rig), listed.values(), name=name)


def brought_along(rig: CylinderRig | DriveRig | VesselRig) -> Effect:
    """The physics that every rig of this kind has."""
    if isinstance(rig, CylinderRig):
        return MeasuredChambers(chambers=rig.chambers, travel=rig.stretch)
    if isinstance(rig, DriveRig):
        load, arm = (rig.load.mass, rig.load.arm) if rig.load else (0.0, None)
        return DriveAxis(J=rig.inertia, m=load, arm=arm or 0.0, hangs=arm is not None)
    opening = math.pi / 4 * rig.orifice**2 * rig.discharge
    figures = {"ambient": rig.ambient, "outside": rig.outside}
    return VesselChamber(V=rig.volume, a=opening, wall=rig.area, **figures)


Supply = Annotated[float, Param("Pa", 0.1e6, lower=ATMOSPHERE, doc="supply pressure")]


class ModelSpec(Section):
    """A model as its YAML writes it.

    `base` names another model whose effects come first; one of the same name replaces it.
    `robot` is a path relative to the file that says it, then to the current folder, then a
    shipped name; once loaded, the whole path. `rig`: one of the user's own in the place of a
    robot; without any effects only pressure x area, or inertia, counts. `chambers: orifice` swaps
    the first-order chambers for eq. 1-3.
    """

    name: str = "model"
    base: str | None = None
    robot: str | None = None
    rig: OwnRig | None = None
    supply: Supply | None = None
    chambers: Literal["first_order", "orifice"] | None = None
    effects: tuple[AnyEffect, ...] = Field(default=())
    evidence: Evidence | None = None
    notes: str = ""

    @property
    def adds(self) -> bool:
        """Whether it is another model than its base."""
        return bool(self.robot or self.rig or self.supply or self.chambers or self.effects)


def load_spec(name: str | Path = "planning") -> ModelSpec:
    """The model YAML `name` (a path or a shipped model) with its bases merged in."""
    chain = model_chain(name)
    (_, spec), *bases = chain
    _, evidence = _with_evidence(chain)
    for _, base in bases:
        merged = {e.name: e for e in (*base.effects, *spec.effects)}
        update: dict[str, Any] = {
            key: getattr(spec, key) or getattr(base, key)
            for key in ("robot", "rig", "supply", "chambers")
        }
        spec = spec.model_copy(update={**update, "effects": tuple(merged.values())})
    return spec.model_copy(update={"base": None, "evidence": evidence})


def _with_evidence(chain: list[tuple[Path, ModelSpec]]) -> tuple[Path, Evidence | None]:
    """The file of a chain whose evidence counts, and that: the first one that adds something."""
    path, spec = next(((p, s) for p, s in chain if s.evidence or s.adds), chain[-1])
    return path, spec.evidence


def read_covariance(name: str | Path) -> tuple[tuple[str, ...], Array]:
    """Names (`effect.parameter`) and joint covariance (k, k), in SI units, of what the model YAML
    `name` was found to have.

    Raises KembaError where the model has no evidence or covariance, and at the line that names the
    file where that is missing, malformed, of other parameters or no covariance.
    """
    path, evidence = _with_evidence(model_chain(name))
    if evidence is None or evidence.covariance is None:
        what = "has no covariance of what was found" if evidence else "has no evidence"
        hint = "find it anew with: kemba-opt discover LOG..."
        raise KembaError(str(path), what, "evidence.covariance was expected", hint)
    spec = load_spec(name)
    try:
        known = [f"{e.name}.{p}" for e in spec.effects for p in e.parameters()]
        return matrix_in(path.parent / evidence.covariance, known)
    except KembaError as error:
        raise located(error, load_yaml(path)) from None


def evidence_faults(name: str | Path) -> list[str]:
    """Sentences on logs of the evidence of the model YAML `name` that are gone or have changed."""
    path, evidence = _with_evidence(model_chain(name))
    return evidence.faults(path.parent) if evidence else []


def evidence_folder(name: str | Path) -> Path:
    """The folder from which the evidence of the model YAML `name` names its logs."""
    return _with_evidence(model_chain(name))[0].parent


def model_chain(name: str | Path) -> list[tuple[Path, ModelSpec]]:
    """Files and specs of the model YAML `name`, its base, the base of that, ...; every `robot` is
    a whole path. `A+B` is the model A with what the file B itself adds: A is the base of B there.
    Raises KembaError with every mistake of a file, and where bases form a circle."""
    if (parts := with_added(str(name))) is not None:
        under, ((path, spec), *_) = (model_chain(part) for part in parts)
        joined = f"{under[0][1].name}+{spec.name}"
        return [(path, spec.model_copy(update={"base": parts[0], "name": joined})), *under]
    chain: list[tuple[Path, ModelSpec]] = []
    path = find_config(str(name), "models").resolve()
    while True:
        document = load_yaml(path)
        spec = parse(document, ModelSpec)
        if path in [file for file, _ in chain]:
            raise document.error(("base",), "base: leads back to this file")
        if spec.robot is not None:
            spec = spec.model_copy(update={"robot": _robot(spec.robot, path, document)})
        chain.append((path, spec))
        if spec.base is None:
            return chain
        path = _base(spec.base, path, document)


def model_files(name: str | Path) -> list[Path]:
    """Every file that decides what the model `name` is: its own, its bases', its robot's."""
    robot = load_spec(name).robot
    return [*(path for path, _ in model_chain(name)), *(robot_files(robot) if robot else [])]


def own_robot(name: str | Path) -> str | None:
    """The robot that the user's own files name for a model; None where only shipped ones do."""
    ours = {path.resolve() for path in shipped_configs("models").values()}
    return next((s.robot for path, s in model_chain(name) if s.robot and path not in ours), None)


def _robot(name: str, path: Path, document: Document) -> str:
    try:
        return str(find_file(name, "robots", path.parent))
    except KembaError as error:
        what = f"robot: {error.what}"
        raise document.error(("robot",), what, error.expected, error.hint) from None


def _base(name: str, path: Path, document: Document) -> Path:
    """The file of a base: beside the file that names it, then as given, then shipped."""
    beside = path.parent / (name if name.endswith(".yaml") else f"{name}.yaml")
    near = beside if is_file(beside) and beside.resolve() != path else name
    try:
        return find_config(near, "models").resolve()
    except KembaError as error:
        what = f"base: '{name}': {error.what}"
        raise document.error(("base",), what, error.expected, error.hint) from None


def build_model(
    spec: ModelSpec,
    extra: Iterable[Effect] = (),
    supply: float | None = None,
    rig: bool = False,
    scene: Scene = FLAT,
    at: float = 0.0,
) -> Model:
    """The model of a spec: `extra` effects added, `supply` [Pa] instead of the spec's, standing
    `at` a place [m] of a `scene`.

    `rig`: the same effects on the piston of the bench; effects whose ports it lacks are left out.
    Raises KembaError where the spec names no robot, or a file or an effect is wrong.
    """
    if spec.rig is not None:
        return own_model(spec.rig, (*spec.effects, *extra), spec.name)
    if spec.robot is None:
        expected = "robot: a robot's file, or base: a model that names one, was expected"
        raise KembaError(f"model {spec.name}", "robot: missing", expected)
    robot = load_robot(spec.robot)
    mechanism = rig_mechanism(robot.cylinder) if rig else robot_mechanism(robot).on(scene, at)
    listed: Sequence[Effect] = _listed(spec)
    if rig:
        listed = [e for e in listed if set(e.ports) <= {"piston"} and e.kind != "end_stop"]
    named = {e.name: e for e in (*listed, *extra)}
    return Model(mechanism, named.values(), supply or spec.supply or NOMINAL_SUPPLY, spec.name)


def load_model(
    name: str | Path = "planning",
    extra: Iterable[Effect] = (),
    supply: float | None = None,
    rig: bool = False,
    scene: Scene = FLAT,
    at: float = 0.0,
) -> Model:
    """Load and build in one step. Raises KembaError with every mistake of the YAML."""
    spec = load_spec(name)
    try:
        return build_model(spec, extra, supply, rig, scene, at)
    except KembaError as error:
        raise _at_its_line(error, name) from None


def _at_its_line(error: KembaError, name: str | Path) -> KembaError:
    """An error about `effects.NAME` at the line of the file that lists this effect, one about the
    whole model at its file."""
    for path, spec in model_chain(name):
        for i, effect in enumerate(spec.effects):
            if error.where == f"effects.{effect.name}":
                what = f"effects.{effect.name}: {error.what}"
                document = load_yaml(path)
                return document.error(("effects", i), what, error.expected, error.hint)
    if error.where == f"model {load_spec(name).name}":
        return KembaError(str(name), error.what, error.expected, error.hint)
    return error


Changes = Mapping[str, Mapping[str, Any]]


def changed_effects(
    model: str | Path, changes: Changes, document: Document | None = None
) -> list[Effect]:
    """The effects of the model YAML `model` that `changes` names, with their parameters changed.

    A key of `changes` is the name of an effect (`contact`, `valve_delay:front`) or its place in
    the model's list, from 0, with those of its bases first. `document`: the task, whose places
    are named in messages. Raises ConfigErrors with every effect that there is not and every wrong
    parameter.
    """
    if not changes:
        return []
    source = document or Document({"effects": dict(changes)})
    listed = _listed(load_spec(model))
    found: dict[str, Effect] = {}
    errors: list[KembaError] = []
    for key, values in changes.items():
        try:
            effect = _named(listed, key, str(model), source)
            effect = found.get(effect.name, effect)
            found[effect.name] = parse(_part(source, key, effect, values), type(effect))
        except KembaError as error:
            errors += listed_errors(error)
    if errors:
        raise ConfigErrors(errors)
    return list(found.values())


def _listed(spec: ModelSpec) -> tuple[Effect, ...]:
    """The effects of a model: those on its list, then those of its chambers."""
    names = {effect.name for effect in spec.effects}
    chambers = CHAMBERS[spec.chambers or "first_order"]()
    return (*spec.effects, *(effect for effect in chambers if effect.name not in names))


def _named(listed: tuple[Effect, ...], key: str, model: str, source: Document) -> Effect:
    """The effect of a list by its name or place."""
    if key.isdigit() and int(key) < len(listed):
        return listed[int(key)]
    found = [effect for effect in listed if effect.name == key]
    if found:
        return found[0]
    names = [effect.name for effect in listed]
    what = f"effects: the model '{model}' has no effect '{key}'"
    expected = f"0 to {len(names) - 1}, or a name on its list, was expected"
    raise source.error(("effects", key), what, expected, suggest(key, names))


def _part(source: Document, key: str, effect: Effect, values: Mapping[str, Any]) -> Document:
    """One changed effect as a document of its own; its parts keep their places in the task."""
    at = ("effects", key)
    kept = {p[2:]: mark for p, mark in source.marks.items() if p[:2] == at}
    told = {p[2:]: text for p, text in source.overrides.items() if p[:2] == at}
    data = {**effect.model_dump(exclude_unset=True), "kind": effect.kind, **values}
    return Document(data, source.source, source.lines, kept, told)


DRAWN = 40  # models: the spread is then known to a tenth


def drawn_models(model: Model, name: str | Path, count: int = DRAWN) -> list[Model]:
    """So many models drawn from the covariance of the model YAML `name` about `model`.

    Parameters stay within their bounds. Raises KembaError where the covariance is missing or none.
    """
    names, covariance = read_covariance(name)
    known = {e.name: e for e in model.effects}
    middle = np.array([_value(known, n) for n in names])
    size, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(size, 0.0))
    steps = np.random.default_rng(0).standard_normal((count, len(names))) @ root.T
    return [_with(model, dict(zip(names, middle + step, strict=True))) for step in steps]


def _value(known: Mapping[str, Effect], name: str) -> float:
    effect, _, parameter = name.rpartition(".")
    return float(known[effect].value(parameter)) if effect in known else 0.0


def _with(model: Model, values: Mapping[str, float]) -> Model:
    """The model with parameters changed, each within its bounds."""
    effects = []
    for effect in model.effects:
        declared = effect.parameters()
        own = {}
        for name, value in values.items():
            owner, _, parameter = name.rpartition(".")
            if owner == effect.name:
                bounds = declared.get(parameter)
                own[parameter] = (
                    float(np.clip(value, bounds.lower, bounds.upper)) if bounds else value
                )
        effects.append(effect.bind(own) if own else effect)
    return Model(model.mechanism, effects, model.supply, model.name)
