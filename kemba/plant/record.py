"""From the record of the kernel to a trajectory and impacts."""

from dataclasses import dataclass

from kemba.model import Model
from kemba.plant.equations import Equations
from kemba.plant.kernel.machine import Array
from kemba.quantity import Quantity
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Impact:
    """An inelastic impact: when [s], at which pairs, the kinetic energy lost [J], and how fast the
    gap of each pair was closing before [m/s]."""

    time: float
    labels: tuple[str, ...]
    lost: float
    speeds: tuple[float, ...]


def recorded(model: Model, equations: Equations) -> list[Quantity]:
    """What a row of the record holds: states, inputs as sent, forces, outputs."""
    mechanism = model.mechanism
    listed = {q.name: q for q in mechanism.coordinates + mechanism.velocities}
    sources = [*listed.values(), *model.states.values(), *model.inputs.values()]
    return [*sources, *model.forces.values(), *equations.node.output_quantities]


def trajectory(model: Model, equations: Equations, times: Array, table: Array) -> Trajectory:
    """The record (m, columns) as a trajectory; a column named twice is written once."""
    columns: dict[str, Array] = {}
    for i, quantity in enumerate(recorded(model, equations)):
        columns.setdefault(quantity.header, table[:, i].copy())
    return Trajectory(times, columns)
