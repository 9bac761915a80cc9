"""What a simulation writes down: outputs, states, inputs and forces at the sample times."""

from __future__ import annotations

import numpy as np

from kemba.model import Model
from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.events import Advance
from kemba.plant.stepping.stepper import State
from kemba.trajectory import Trajectory


class Recorder:
    """Collects rows of a trajectory."""

    def __init__(self, model: Model, advance: Advance) -> None:
        self.model, self.advance = model, advance
        self.eq = advance.eq
        self._times: list[float] = []
        self._rows: list[Array] = []
        outputs = self.eq.node.output_quantities
        listed = {q.name: q for q in model.mechanism.coordinates + model.mechanism.velocities}
        self._sources = [*listed.values(), *model.states.values(), *model.inputs.values()]
        self._sources += [*model.forces.values(), *outputs]

    def record(self, now: State, sent: Array) -> None:
        """Add the row at `now`, values just after it, with the inputs as `sent` (nu,)."""
        advance = self.advance
        rows = advance.rows(now)
        a, lam = advance.stepper.instant(now, advance.u, rows, advance.longest)
        self._slip(now, lam, rows)
        y = self.eq.measure(q=now.q, v=now.v, a=a, s=now.s, sd=0.0, lam=lam, u=advance.u)["y"]
        self._times.append(now.time)
        self._rows.append(np.concatenate([now.q, now.v, now.s, sent, lam, y]))

    def _slip(self, now: State, lam: Array, rows: Array) -> None:
        """Slip speeds of open feet: the least that keeps their pairs true."""
        for gamma, slips in self.eq.pairs.free_speeds:
            if gamma not in rows:
                P = self.eq.ahead(q=now.q, v=now.v, s=now.s, u=self.advance.u)
                lam[gamma] = np.abs(P["W"][slips] @ now.v).max()

    def trajectory(self) -> Trajectory:
        """All rows as a trajectory; a column named twice is written once."""
        table = np.array(self._rows)
        columns: dict[str, Array] = {}
        for i, quantity in enumerate(self._sources):
            columns.setdefault(quantity.header, table[:, i])
        return Trajectory(np.array(self._times), columns)
