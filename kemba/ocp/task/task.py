"""Tasks: what a motion should do, by quantity name, as their YAML writes it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, field_validator, model_validator

from kemba.config import Document, FileName, Section, beside, parse
from kemba.config.document import written
from kemba.model.spec import Supply
from kemba.quantity import Param, to_si
from kemba.scene import AnyTerrain, Obstacle, Scene

Value = float | str
CENTRE = "of the body's centre: at 0.45 m the feet of the shipped robot rise 1 cm"


class Bound(Section):
    """A value or a range of one quantity. A bare value means `equals`.

    Values carry units (`0.5 m`), are bare SI, or name a top-level key of the task (`height`).
    """

    equals: Value | None = None
    at_least: Value | None = None
    at_most: Value | None = None

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, data: Any) -> Any:
        return data if isinstance(data, dict) else {"equals": data}


Share = Annotated[float, Param("1", lower=0.0, upper=1.0, doc="share of the nodes")]


Moment = Share | str  # a share of the nodes, or a moment by name, see `moments`


class Goal(Section):
    """What one quantity should be at a moment, or during a part of the motion.

    `quantity` may be an expression, `front/foot/x - rear/foot/x`, also between two moments,
    `at(end, body/x) - at(start, body/x)`. `at`: start, middle, end, a fraction of the nodes or an
    event of `contacts`, `touchdown front`; `during`: two of them, from and to.
    `maximise`, `minimise`: as large or as small as possible, besides what else is asked of it.
    """

    quantity: str
    at: Moment = "end"
    during: tuple[Moment, Moment] | None = None
    equals: Value | None = None
    at_least: Value | None = None
    at_most: Value | None = None
    maximise: bool = False
    minimise: bool = False

    @model_validator(mode="after")
    def _sensible(self) -> Goal:
        if self.maximise and self.minimise:
            raise ValueError("'maximise' does not go with 'minimise'")
        if self.during is not None:
            shares = [moment for moment in self.during if not isinstance(moment, str)]
            if len(shares) == 2 and shares[0] > shares[1]:
                raise ValueError("'during' goes from an earlier to a later part of the motion")
            if "at" in self.model_fields_set:
                raise ValueError("'during' does not go with 'at'")
            if self.maximise or self.minimise:
                raise ValueError("'maximise' and 'minimise' need a moment, 'at', not 'during'")
        return self


class Stance(Section):
    """A part of the motion in which the same feet stand: `on` names their legs, `[]` is flight.

    Bare in a list: `rear`, `[rear, front]`, `air`. `share`: of the nodes; parts without one share
    the rest equally. How long a part lasts is found within the task's `step_variation`.
    """

    on: tuple[str, ...]
    share: Share | None = None

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, data: Any) -> Any:
        legs = data.get("on") if isinstance(data, dict) else data
        legs = [] if legs == "air" else [legs] if isinstance(legs, str) else legs
        return {**(data if isinstance(data, dict) else {}), "on": legs}


class Periodic(Section):
    """The motion ends in the state in which it begins, every coordinate, rate, force and valve;
    `except`: quantities that may differ. `periodic: true` leaves out `body/x`."""

    excepted: tuple[str, ...] = Field(("body/x",), alias="except")

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, data: Any) -> Any:
        return {} if data is True else data


class Part(Section):
    """A motion of a sequence: the file of its task, how often in a row, and changed keys."""

    motion: str
    repeat: Annotated[int, Field(ge=1, le=100)] = 1
    set: dict[str, float | int | str] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, data: Any) -> Any:
        return {"motion": data} if isinstance(data, str) else data


class CostTerm(Section):
    """The time integral of an expression of quantities, `front/hip/w^2`, times `weight`."""

    expression: str
    weight: Annotated[float, Param("1", lower=0.0)] = 1.0


class Landing(Section):
    """How softly the motion lands."""

    impact_speed: (
        Annotated[
            float,
            Param(
                "m.s-1", lower=0.15, doc="at most, of feet on the ground and of legs at their stops"
            ),
        ]
        | None
    ) = None


class Solver(Section):
    """How hard to try. `options` go to IPOPT."""

    time_limit: Annotated[float, Param("s", lower=0.1, doc="wall time")] = 300.0
    max_iterations: Annotated[int, Field(ge=1)] = 3000
    symmetry: bool = True
    coarse: bool = True
    complementarity: Annotated[float, Param("1", lower=1e-7, upper=1e-3)] = 1e-6
    options: dict[str, float | int | str] = Field(default_factory=dict)


class Tolerances(Section):
    """What the certificate accepts: residuals of the plan, and how far its executions may miss.

    `apex`, `touchdown` and `final` hold for the replay on the same model, `table_...` for the
    controller's table on that model, `plant_...` for the table on the plant; a plan that ends
    standing must land upright on all three. A plant whose apex is off by what is allowed touches
    down earlier or later by that length over the speed of the landing: so much is allowed unless
    `plant_touchdown` says otherwise, 25 ms at most.
    """

    complementarity: Annotated[float, Param("1", lower=0.0)] = 1e-6
    dynamics: Annotated[float, Param("1", lower=0.0)] = 1e-6
    bounds: Annotated[float, Param("1", lower=0.0)] = 1e-6
    apex: Annotated[float, Param("m", lower=0.0, doc="replayed apex against plan")] = 0.002
    touchdown: Annotated[float, Param("s", lower=0.0, doc="replayed touchdown")] = 0.002
    final: Annotated[float, Param("m", lower=0.0, doc="where the replay ends")] = 0.03
    table_apex: Annotated[float, Param("m", lower=0.0, doc="apex of the table")] = 0.002
    table_touchdown: Annotated[float, Param("s", lower=0.0, doc="touchdown of the table")] = 0.003
    table_final: Annotated[float, Param("m", lower=0.0, doc="where the table ends")] = 0.03
    plant_apex: Annotated[float, Param("m", lower=0.0, doc="apex on the plant")] = 0.05
    plant_touchdown: (
        Annotated[float, Param("s", lower=0.0, doc="touchdown on the plant; see above")] | None
    ) = None
    plant_final: Annotated[float, Param("m", lower=0.0, doc="where the plant ends")] = 0.05


OF_A_MOTION = (
    "start",
    "end",
    "bounds",
    "goals",
    "contacts",
    "periodic",
    "cost",
    "duration",
    "nodes",
)


class Task(Section):
    """A motion to plan: grid, requirements at start and end, bounds on the way, goals, costs.

    `task`: the version of this language, 2. `step_variation`: each step lasts duration/nodes within
    this fraction. `start` and `end` map quantities to values; `rest: true` there means that all
    rates are zero, `settled: true` that every state of an effect is at its value at rest. `hold`:
    for so long before the plan the controller keeps the first pose, valves closed, so that the
    robot settles.
    `grip`: the share of the ground's friction that sticking feet may use in the plan; its model and
    the plant keep all of it.
    `folding`: whether legs may have to fold for `clearance`; if not, a low jump has what stretched
    legs leave.
    `height` is that of the body's centre, which stands above the feet by a leg; `feet` asks instead
    how high the feet are at the top, and `height` is that and a stretched leg.
    `effects` changes parameters of the model's effects, by name or by place in its list:
    `{contact: {mu: 0.6}}`.
    `sequence`: other tasks in a row, planned to meet; then this one has neither start nor end.
    `contacts`: which feet stand, in order; without it the solver finds that. `periodic`: the end is
    the start of the next stride.
    `terrain`, `obstacles`: what the robot moves in; the ground is level at 0 without.
    `robust`: by how many scenarios, drawn from the file `uncertainties`, plans are chosen.
    """

    name: FileName = "task"
    language: Annotated[int, Field(alias="task")] = 2
    notes: str = ""
    model: str = "planning"
    plant: str = "plant"
    height: Annotated[float, Param("m", lower=0.0, doc=CENTRE)] | None = None
    feet: Annotated[float, Param("m", lower=0.0, doc="of the feet at the top")] | None = None
    distance: Annotated[float, Param("m", doc="forward")] | None = None
    supply: Supply | None = None
    effects: dict[str, dict[str, Any]] = Field(default_factory=dict)
    payload: Annotated[float, Param("kg", lower=0.0, doc="at the body's centre")] = 0.0
    clearance: Annotated[float, Param("m", lower=0.0, doc="of the feet in flight")] | None = None
    folding: bool = True
    grip: Annotated[float, Param("1", lower=0.0, upper=1.0, doc="of the friction, at most")] = 1.0
    landing: Landing = Field(default_factory=Landing)
    hold: Annotated[float, Param("s", lower=0.0, upper=10.0, doc="before plan time 0")] = 0.0
    duration: Annotated[float, Param("s", lower=0.01, upper=20.0, doc="nominal")] = 0.5
    nodes: Annotated[int, Field(ge=4, le=2000)] = 100
    step_variation: Annotated[float, Param("1", lower=0.0, upper=0.9)] = 0.2
    start: dict[str, Bound] = Field(default_factory=dict)
    end: dict[str, Bound] = Field(default_factory=dict)
    bounds: dict[str, Bound] = Field(default_factory=dict)
    goals: dict[str, Goal] = Field(default_factory=dict)
    contacts: tuple[Stance, ...] = ()
    sequence: tuple[Part, ...] = ()
    periodic: Periodic | None = None
    terrain: tuple[AnyTerrain, ...] | None = None
    obstacles: tuple[Obstacle, ...] | None = None
    cost: dict[str, float | CostTerm] = Field({"torque_squared": 1.0})
    robust: Annotated[int, Field(ge=0, le=10_000)] = 0
    uncertainties: str = "usual"
    guess: Literal["automatic", "standing"] = "automatic"
    guess_noise: Annotated[float, Param("1", lower=0.0, upper=1.0)] = 0.0
    seed: int = 0
    min_dwell: Annotated[float, Param("s", lower=0.0, doc="of a valve between switches")] = 0.01
    method: Literal["relaxation", "penalty", "penalty_ramped"] = "relaxation"
    refine: Literal["none", "radau"] = "radau"
    solver: Solver = Field(default_factory=Solver)
    _retired: tuple[str, ...] = PrivateAttr(default=())
    _places: dict[str, str] = PrivateAttr(default_factory=dict)  # of `PLACED` in the task's file
    tolerances: Tolerances = Field(default_factory=Tolerances)

    @model_validator(mode="after")
    def _only_a_sequence(self) -> Task:
        own = [key for key in OF_A_MOTION if key in self.model_fields_set]
        if self.sequence and own:
            raise ValueError(f"'{own[0]}' belongs into the motions of a sequence, not beside it")
        return self

    @field_validator("language")
    @classmethod
    def _known(cls, version: int) -> int:
        if version not in (1, 2):
            raise ValueError(f"tasks of version {version} need a later kemba; this one reads 2")
        return version

    @model_validator(mode="after")
    def _one_height(self) -> Task:
        if self.height is not None and self.feet is not None:
            raise ValueError("'feet' does not go with 'height': both say how high the robot jumps")
        return self

    def __repr__(self) -> str:
        what = f"{len(self.sequence)} motions in a row" if self.sequence else f"{self.duration:g} s"
        high = f", {self.height:g} m high" if self.height is not None else ""
        return f"Task({self.name}: {what}{high}, {self.nodes} nodes, model {self.model})"

    def __eq__(self, other: object) -> bool:
        """Whether two tasks ask the same, wherever their files ask it."""
        return isinstance(other, Task) and self.__dict__ == other.__dict__

    def place(self, key: str) -> str:
        """Where the file asks for a `key` of `PLACED`, `jump.yaml:9`; empty where it does not."""
        return self._places.get(key, "")

    @property
    def scene(self) -> Scene:
        """The ground and its obstacles."""
        return Scene(terrain=self.terrain or (), obstacles=self.obstacles or ())

    @property
    def place_x(self) -> float:
        """Place x [m] at which the body is to start; 0 where the task does not say it."""
        asked = self.start.get("body/x", Bound()).equals
        try:
            return to_si(asked or 0.0, "m")
        except ValueError:
            return 0.0

    @property
    def step(self) -> float:
        """Nominal step [s]."""
        return self.duration / self.nodes

    @property
    def remarks(self) -> list[str]:
        """Figures that are given, but change nothing."""
        bounds = [
            b for part in (self.start, self.end, self.bounds, self.goals) for b in part.values()
        ]
        named = {value for b in bounds for value in (b.equals, b.at_least, b.at_most)}
        given = (n for n in ("height", "distance") if getattr(self, n) is not None)
        hint = "changes nothing: no goal, bound, start or end refers to it"
        idle = [f"`{name}` {hint}, as in `equals: {name}`" for name in given if name not in named]
        return [*self._retired, *idle]


def _last_height(document: Document) -> Document:
    """The document without its own `height` where `feet` is set by an option, and the reverse."""
    for own, rival in (("height", "feet"), ("feet", "height")):
        if (rival,) in document.overrides and (own,) not in document.overrides:
            data = {k: v for k, v in document.data.items() if k != own}
            return replace(document, data=data)
    return document


# keys that ask something of a motion by themselves
PLACED = ("duration", "min_dwell", "landing.impact_speed", "grip", "contacts", "clearance")
# keys of earlier versions: what an old file is told
RETIRED = {
    ("fit_air",): "plans are no longer bent to the simulated robot; learn from logs instead, or "
    "plan with `model: orifice`, which has the air of the simulated robot",
    ("landing", "air"): "it served plans that were bent to the simulated robot",
}


def _without_retired(document: Document) -> tuple[Document, tuple[str, ...]]:
    """The document without keys of earlier versions, and a remark for each."""
    remarks = []
    for location, why in RETIRED.items():
        *parents, key = location
        holder = document.data
        for parent in parents:
            holder = holder.get(parent) if isinstance(holder, dict) else None
        if not isinstance(holder, dict) or key not in holder:
            continue
        place = document.place(location)
        remarks.append(f"{place + ': ' if place else ''}`{written(location)}` is ignored: {why}")
        kept = {k: v for k, v in holder.items() if k != key}
        data = {**document.data, parents[0]: kept} if parents else kept
        document = replace(document, data=data)
    return document, tuple(remarks)


def parse_task(document: Document) -> Task:
    """The task of a document; its own models are looked for beside it first. Raises KembaError."""
    document, retired = _without_retired(_last_height(document))
    task = parse(document, Task)
    task._retired = retired
    task._places = {key: document.place(tuple(key.split("."))) for key in PLACED}
    if not document.source:
        return task
    folder = Path(document.source).parent
    named = ("model", "plant", "uncertainties")
    models = {key: beside(getattr(task, key), folder) for key in named}
    return task.model_copy(update=models)
