"""One simulation: what the kernel is given, and what it gives back."""

from collections.abc import Mapping

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.commands import (
    Commands,
    JointControl,
    Profile,
    among,
    breaks,
    find_input,
    input_names,
    input_table,
    merged,
    ticks,
)
from kemba.plant.equations import Equations
from kemba.plant.kernel.events import MOST, NOTICED, Impacts
from kemba.plant.kernel.lcp import NoSolutionError
from kemba.plant.kernel.machine import (
    FIRST_STEP,
    LONGEST_STEP,
    SHORTEST_STEP,
    TOLERANCE,
    Array,
    memory,
    state,
)
from kemba.plant.kernel.play import ASK, BURIED, DONE, EXPLODED, Law, Marks, NextMark, play
from kemba.plant.kernel.step import Pace
from kemba.plant.record import Impact, recorded

SMALLER = "try a smaller step, or look for a start that is impossible"
ROOM = 8 * MOST  # impacts kept in the kernel before they are fetched


class Player:
    """A model with its start and its commands, ready to be played.

    `acting`: the profiles as they reach the model, valves late; `samples` [s]. After `play`,
    `times` (m,) and the rows of `table` are the record. Raises KembaError on unknown inputs.
    """

    def __init__(
        self,
        model: Model,
        equations: Equations,
        start: tuple[Array, Array, Array],
        commands: Commands,
        acting: Mapping[str, Profile],
        samples: Array,
        duration: float,
    ) -> None:
        self.model, self.equations, self.commands = model, equations, commands
        self.pairs, self.machine = equations.pairs, equations.machine
        m, nu = self.machine, len(model.inputs)
        columns = len(recorded(model, equations))
        sizes = 2 * m.n + m.ns + nu + m.nl
        free = equations.values(model)
        self.memory = memory(m, nu, len(free), columns - sizes)
        self.memory.x[2 * m.n + m.ns + nu :][: len(free)] = free
        self.now, self.spare = state(m), state(m)
        self.now.y[:] = np.concatenate(start)
        self.schedule = _schedule(model, commands, acting, samples, duration)
        self.law = _law(model, commands.feedback, self.schedule.time)
        recording = self.schedule.row >= 0
        self.times, self.table = self.schedule.time[recording], np.empty((recording.sum(), columns))
        self.impacts: list[Impact] = []
        count, (times, lost) = np.zeros(1, dtype=int), np.zeros((2, ROOM))
        rates = np.zeros((ROOM, len(m.gaps)))
        self._log = Impacts(count, times, lost, np.zeros((ROOM, m.nl)), rates)
        self._progress = NextMark(np.zeros(1, dtype=int), np.zeros(1, dtype=bool))
        self._sensed = [quantity.name for quantity in model.state]
        self._inputs = {name: i for i, name in enumerate(input_names(model))}

    def play(self, step: float | None) -> None:
        """Fill the record, in steps of up to `step` [s]; None: as long as the motion allows. Raises
        KembaError."""
        if step is None:
            pace = Pace(np.array([FIRST_STEP]), SHORTEST_STEP, LONGEST_STEP, TOLERANCE)
        else:
            pace = Pace(np.array([step]), step, step, np.inf)
        why = -1
        while why != DONE:
            try:
                why = play(
                    self.machine, self.memory, self.now, self.spare, self.schedule, self.law,
                    pace, self._log, self.table, self._progress,
                )  # fmt: skip
            except NoSolutionError as error:
                raise self._failed(str(error)) from None
            self._fetch_impacts()
            if why == BURIED:
                deepest = int(np.argmin(self.now.gap))
                label, depth = self.pairs.labels[self.pairs.gaps[deepest]], -self.now.gap[deepest]
                raise KembaError("initial", f"{label} starts {1e3 * depth:.1f} mm too deep")
            if why == EXPLODED:
                raise self._failed("the motion explodes")
            if why == ASK:
                self._answer()

    def _failed(self, what: str) -> KembaError:
        return KembaError(self.model.name, f"{what} at {self.now.time[0]:.4f} s", hint=SMALLER)

    def _fetch_impacts(self) -> None:
        log, gaps = self._log, self.pairs.gaps
        for i in range(log.number[0]):
            hit = log.impulse[i][gaps] > NOTICED
            labels = tuple(self.pairs.labels[row] for row in gaps[hit])
            speeds = tuple((-log.rate[i][hit]).tolist())
            self.impacts.append(Impact(float(log.time[i]), labels, float(log.lost[i]), speeds))
        log.number[0] = 0

    def _answer(self) -> None:
        """Ask the controller outside the kernel."""
        feedback, first = self.commands.feedback, len(self.now.y)
        assert callable(feedback)
        sense = dict(zip(self._sensed, self.now.y.tolist(), strict=True))
        time = float(self.schedule.time[self._progress.mark[0]])
        for name, value in feedback(time, sense).items():
            place = self._inputs.get(name)
            if place is None:
                place = find_input(self.model, name, "feedback")  # raises
            self.memory.x[first + place] = value
        self._progress.answered[0] = True


def _schedule(
    model: Model, commands: Commands, acting: Mapping[str, Profile], samples: Array, duration: float
) -> Marks:
    edges = breaks([*acting.values(), *commands.profiles.values()], 0.0, duration)
    beats = ticks(commands, duration)
    ends = np.array([0.0, duration])
    marks = merged(ends, samples, edges, beats)
    wanted = among(marks, samples)
    return Marks(
        time=marks,
        u=input_table(model, acting, marks),
        sent=input_table(model, commands.profiles, marks),
        tick=among(marks, np.r_[0.0, beats]) & (commands.feedback is not None),
        row=np.where(wanted, np.cumsum(wanted) - 1, -1),
        asks=callable(commands.feedback),
    )


def _law(model: Model, feedback: object, marks: Array) -> Law:
    if not isinstance(feedback, JointControl):
        none = np.zeros(0, dtype=int)
        return Law(0.0, 0.0, none, none, none, np.zeros((0, 3)), np.zeros((len(marks), 0, 3)))
    mechanism = model.mechanism
    states = [c.name for c in (*mechanism.coordinates, *mechanism.velocities)]
    first = len(states) + len(model.states)
    return Law(
        feedback.K_p,
        feedback.K_d,
        np.array([states.index(f"{joint}/q") for joint in feedback.joints]),
        np.array([states.index(f"{joint}/w") for joint in feedback.joints]),
        np.array([first + find_input(model, f"{j}/tau", "feedback") for j in feedback.joints]),
        feedback.limits,
        feedback.at(marks),
    )
