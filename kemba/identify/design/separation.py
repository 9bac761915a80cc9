"""Which effects an answer leaves in doubt, and how much evidence logs would hold between them.

If A is there and B is fitted, the fit of B stays away from the prediction of A. Half the squared
distance that is left, in units of the noise, is the expected logarithm of the Bayes factor. What
may bend to help B are its own parameters, and within their priors the nominal figures of the model
and how each log begins; all by their slopes. Of 50 pairs on standard tests a fit by three confirmed
steps settled the same (by hand).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.identify.infer.linear import is_shape, priors
from kemba.identify.infer.refit import Frozen, refit
from kemba.identify.problem.problem import Array, Problem, Theta


class ExperimentSettings:
    """The sensors of a rig, and when a question is settled."""

    force_noise = 1.0  # noise of the force sensor [N]: a usual transducer of a rig
    position_noise = 1e-5  # noise of the position sensor [m]: a usual one of a rig
    # force that not even a good model explains [N]: half the noise of the sensor; without it slow
    # errors would be averaged away
    unexplained = 0.5
    memory = 0.03  # time in which that force changes [s]: that of the fastest rise times
    sample = 20000  # rows of noise from which its colour is learnt
    rows = 1000.0  # rows per second of the simulated logs [Hz]
    coarse = 500.0  # the same while the best test is looked for [Hz]
    tests = 12  # most tests of one rig that are simulated to judge it
    # evidence that settles a question [nats]: Kass and Raftery 1995, 'very strong' evidence begins
    # at 5 nats
    clear = 5.0
    repeats = 10  # most runs of one motion: an afternoon
    rivals = 4  # effects that are to be told apart: few


class DesignSearchSettings:
    """The search for the best test: differential evolution."""

    members = 16  # tests of each generation
    generations = 3  # generations after the first
    seed = 1  # seed of the search: the same answer every time
    budget = 60.0  # time after which no new test is tried [s]: a user waits one minute


Values = dict[str, float]


@dataclass(frozen=True)
class Rivals:
    """Effects of which one is there: name -> its parameters, the likeliest first.

    `shared`: parameters of the effects that are there whichever of them it is.
    """

    effects: Mapping[str, Values]
    shared: Mapping[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """The rivals, the likeliest first."""
        return tuple(self.effects)

    def theta(self, name: str) -> Values:
        """Everything that is there if it is this one."""
        return {**self.shared, **self.effects[name]}


def contenders(answer: Mapping[str, Any]) -> Rivals:
    """The effect of an answer that is least sure to be that one, and what else it could be.

    That is the first one that has equivalents, else the first one. Effects that the answer holds
    beside it are taken to be there. Raises KembaError where the answer ranks no effect.
    """
    rows = {row["effect"]: row for row in answer["ranking"]}
    if not rows:
        raise KembaError("answer.json", "has no ranking", "nothing is left to be separated")
    doubtful = [name for name, row in rows.items() if row["equivalent_to"]]
    first = [*doubtful, *rows][0]
    beside = set(answer.get("added", ())) - {first}
    likely = [name for name in rows if name not in beside]
    order = dict.fromkeys([first, *rows[first]["equivalent_to"], *likely])
    chosen = [name for name in order if name in rows][: ExperimentSettings.rivals]
    shared = {k: v for e in beside - set(chosen) if e in rows for k, v in _values(rows[e]).items()}
    return Rivals({name: _values(rows[name]) for name in chosen}, shared)


def _values(row: Mapping[str, Any]) -> Values:
    """Parameters of a row of the ranking, by their names in theta."""
    return {f"{row['effect']}.{p}": v["value"] for p, v in row["parameters"].items()}


@dataclass(frozen=True)
class Separation:
    """Expected evidence [nats] between the first rival and each other one, the lesser of the two
    directions."""

    first: str
    nats: Mapping[str, float]

    @property
    def nearest(self) -> str:
        """The rival that is hardest to tell from the first."""
        return min(self.nats, key=lambda name: self.nats[name])

    @property
    def least(self) -> float:
        """The evidence [nats] between these two."""
        return self.nats[self.nearest]

    @property
    def worth(self) -> float:
        """What a search makes large: evidence counts most where there is little of it."""
        clear = ExperimentSettings.clear
        return float(sum(np.log1p(n / clear) for n in self.nats.values()))


@dataclass(frozen=True)
class JudgedTest(Separation):
    """A test, the evidence that its log is expected to hold, and the seconds of that log."""

    test: Any
    log_s: float

    @property
    def pace(self) -> float:
        """Expected evidence [nats] per second of log."""
        return self.least / self.log_s

    def json(self) -> dict[str, Any]:
        """The figures of the test."""
        return {
            "nats": self.least,
            "nats_by_rival": dict(self.nats),
            "log_s": self.log_s,
            "nats_per_s": self.pace,
        }


@dataclass(frozen=True)
class Proposal(ABC):
    """The best standard test and the designed one; `tried`: how many were looked at."""

    standard: JudgedTest
    designed: JudgedTest
    tried: int

    @property
    def chosen(self) -> JudgedTest:
        """The test that is to be done."""
        return self.designed

    @property
    def nats(self) -> float:
        """Expected evidence [nats] of it between the two effects that are hardest to separate."""
        return self.chosen.least

    @property
    def pair(self) -> tuple[str, str]:
        """These two effects."""
        return self.chosen.first, self.chosen.nearest

    @property
    @abstractmethod
    def sentence(self) -> str:
        """What the test gains, in words."""

    def json(self) -> dict[str, Any]:
        """The figures behind the sentence; `designed` and `standard` have the same keys."""
        return {
            "nats": self.nats,
            "rivals": self.pair,
            "sentence": self.sentence,
            "strength": strength(self.nats),
            "log_s": self.chosen.log_s,
            "designed": self.designed.json(),
            "standard": self.standard.json(),
            "tried": self.tried,
        }


def separation(problem: Problem, rivals: Rivals) -> Separation | None:
    """The evidence between the rivals that logs of this problem's motion would hold.

    None where the logs can show fewer than two of the rivals. What was measured plays no role.
    """
    names = [name for name in rivals.names if name in problem.candidates]
    if len(names) < 2:
        return None
    first, *others = names
    figures = _columns(problem, rivals.theta(first), tuple(problem.nuisance))
    at = {name: problem.residual(rivals.theta(name)) for name in names}
    own = {name: tuple(problem.candidates[name].keys()) for name in names}
    free = {name: _columns(problem, rivals.theta(name), own[name]) for name in names}

    def against(fitted: str, truth: str) -> float:
        """Evidence [nats] against one rival if the other is there."""
        return _left(at[fitted] - at[truth], figures, free[fitted])

    return Separation(first, {o: min(against(o, first), against(first, o)) for o in others})


def _left(gap: Array, figures: Array, free: Array) -> float:
    """Half the squared distance left of a gap (n,) if `figures` bend at their prior's price."""
    count, rows = figures.shape[1], np.hstack([figures, free])
    priced = np.vstack([rows, np.eye(count, rows.shape[1])])
    whole = np.concatenate([gap, np.zeros(count)])
    left = whole - priced @ np.linalg.lstsq(priced, whole, rcond=None)[0]
    return 0.5 * float(left @ left)


def _columns(problem: Problem, theta: Theta, names: tuple[str, ...]) -> Array:
    """Slopes (n, k) of the residual along these parameters, per prior width."""
    value = [theta[name] if is_shape(problem, name) else 1.0 for name in names]
    return np.asarray(problem.jacobian(theta, names) * priors(problem, theta, names)[2] * value)


def best_fit(problem: Problem, rivals: Rivals, name: str) -> dict[str, float]:
    """The best theta of logs if this rival is there, with the effects that all rivals share."""
    theta, names = rivals.theta(name), tuple(problem.nuisance)
    shared = (key.rsplit(".", 1)[0] for key in rivals.shared)
    frozen = Frozen(names, problem.jacobian(theta, names))
    return refit(problem, tuple(sorted({name, *shared})), theta, frozen).theta


def misfit(problem: Problem, theta: Theta) -> float:
    """Half the sum of squares of residuals, and of how far nominal figures are from their values,
    in sigmas."""
    r = problem.residual(theta)
    away = [(theta.get(n, m) - m) / s for n, (m, s) in problem.nuisance.items()]
    return 0.5 * float(r @ r + np.sum(np.square(away)))


def strength(nats: float) -> str:
    """Evidence in words after Kass and Raftery 1995: 1, 3 and 5 nats are their steps."""
    steps = {5.0: "decisive", 3.0: "strong", 1.0: "weak"}
    return next((word for least, word in steps.items() if nats >= least), "almost no")
