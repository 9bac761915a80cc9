"""The answer to "which effect is missing?", as people and scripts read it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from kemba.errors import KembaError, enumerated
from kemba.files import read_json
from kemba.identify.infer.windows import excess

Verdict = Literal["missing", "partly", "nothing", "unknown", "bad-data"]
HELD_OUT = "held-out logs"  # what an answer's errors are split by where logs were kept aside
PROBABILITY = (
    "The probability of an effect is that of its being among the missing ones. Several effects can "
    "be missing at once, so that the probabilities need not add up to 100 %."
)


@dataclass(frozen=True)
class Value:
    """An estimate with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        width = max(self.high - self.low, 1e-12 * max(abs(self.value), 1e-12))
        digits = 2 + int(np.ceil(np.log10(max(abs(self.value) / width, 1.0))))
        digits = min(digits, 5)
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.value:.{digits}g}{unit} ({self.low:.{digits}g} to {self.high:.{digits}g})"


@dataclass(frozen=True)
class Ranked:
    """One effect of the ranking."""

    effect: str
    probability: float
    parameters: dict[str, Value]
    equivalent_to: tuple[str, ...] = ()
    error_before: float = float("nan")
    error_after: float = float("nan")
    holdout_gain_nats: float = float("nan")


@dataclass(frozen=True)
class Covariance:
    """JointFit covariance of parameters (`effect.parameter`), in SI units, row by row."""

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]


@dataclass
class Answer:
    """What `discover` answers; `json()` is its machine-readable form.

    Errors are of data that the fit has not seen, in units of the noise; `ranking`, `ladder` and
    sentence show the same number. `added`: what `model` has; `sure`: what of it is sure. `figures`
    of the model's own that were fitted as well, and those of single legs and links of the
    `machine`; `covariance` of all that is written, and its `evidence`. `rest`: where the error sits
    that is left; `next`: what to measure to learn more. `alike`: groups of effects that these logs
    cannot tell apart, though each would show at its usual size.
    """

    verdict: Verdict
    p_value_nothing: float = float("nan")
    sentence: str = ""
    ranking: Sequence[Ranked] = ()
    added: tuple[str, ...] = ()
    error_before: float = float("nan")
    error_after: float = float("nan")
    noise_floor: float = 1.0
    smallest_detectable: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    alike: Sequence[Sequence[str]] = ()
    formula: str | None = None
    split_by: str = ""
    model: str | None = None
    runtime_s: float = 0.0
    remarks: Sequence[str] = ()
    ladder: Sequence[tuple[str, float]] = ()  # step, held-out error
    rest: str = ""
    next: str = ""
    sure: tuple[str, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)
    machine: Mapping[str, float] = field(default_factory=dict)
    covariance: Covariance | None = None
    evidence: Mapping[str, Any] | None = None
    idle: bool = False  # left-out data gained nothing by what would fit

    @property
    def excess_before(self) -> float:
        """Error beyond the noise of the model as it is."""
        return excess(self.error_before)

    @property
    def excess_after(self) -> float:
        """Error beyond the noise that the best answer leaves."""
        return excess(self.error_after)

    @property
    def writes(self) -> bool:
        """Whether a model is written: something was found, or figures were fitted anew."""
        return bool(self.added or self.figures or self.machine)

    def drop_model(self) -> None:
        """Take back what was found: with it quoted logs are predicted worse than without."""
        named = f"{enumerated(self.added)} would" if self.added else "figures fitted anew would"
        raised = (
            f"{named} raise the quoted error from {self.error_before:.2f} to {self.error_after:.2f}"
        )
        self.remarks = [f"{raised}: no model is written", *self.remarks]
        if self.added:
            whole = self.error_before <= VerdictSettings.whole
            self.verdict = "nothing" if whole else "unknown"
        self.added, self.sure, self.covariance = (), (), None
        self.figures, self.machine = {}, {}
        self.error_after = self.error_before

    def rescaled_from(self, before: tuple[float, float]) -> None:
        """Tell the errors of steps and ranking by the scale of `error_before` and `error_after`,
        which were `before` so far, and the sentence anew."""
        old, new = before, (self.error_before, self.error_after)
        scale = (new[0] - new[1]) / (old[0] - old[1]) if abs(old[0] - old[1]) > 1e-9 else 1.0

        def there(error: float) -> float:
            return max(new[1] + scale * (error - old[1]), 0.0)

        self.ladder = [(step, there(error)) for step, error in self.ladder]
        self.ranking = [
            replace(r, error_before=new[0], error_after=there(r.error_after)) for r in self.ranking
        ]
        self.sentence = phrase(self)

    def json(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        more = {"excess_before": self.excess_before, "excess_after": self.excess_after}
        return {**asdict(self), **more, "probabilities": PROBABILITY}


FEW = 2  # parameters of an effect that a sentence has room for
ENDED = "the time limit ended the search; with a larger --time-limit it goes on"


def phrase(answer: Answer) -> str:
    """The verdict in one plain sentence."""
    if answer.verdict == "nothing":
        what = "Nothing is missing as far as these data can tell"
        if answer.p_value_nothing <= DiscoverSettings.significant:
            what = f"What differs {'may be chance' if answer.idle else 'is too small to matter'}"
        before, after = f"{answer.error_before:.2f}", f"{answer.error_after:.2f}"
        told = f"{what} (p = {answer.p_value_nothing:.2g}); the error is {after} times the noise"
        fitted = f" with figures fitted within their tolerance ({before} as they were)"
        return f"{told}{fitted if answer.writes and after != before else ''}."
    if answer.verdict == "unknown":
        more = f" A formula that fits: {answer.formula}." if answer.formula else ""
        why = f": {answer.remarks[0]}" if answer.remarks else ""
        if answer.next:  # only where the logs are too short
            return f"Something differs, but these logs are too short to tell what{why}. Next: " + (
                f"{answer.next}, with strokes and pulses as they are used."
            )
        tried = "effect that was tried" if ENDED in answer.remarks else "effect of the catalogue"
        return f"Something is missing that no {tried} explains{why}.{more}"
    if answer.verdict == "partly":
        return _partly(answer)
    parts, likely = _told(answer)
    named = enumerated([_named(r) for r in parts])
    before, after = f"{answer.error_before:.2f}", f"{answer.error_after:.2f}"
    falls = f"falls from {before} to {after}"
    if float(after) >= float(before):
        falls = f"was {before} and is {after}"
    also = f" Likely as well: {enumerated([_named(r) for r in likely])}." if likely else ""
    text = f"Missing: {named}; the {_error(answer)} {falls} times the noise."
    return f"{text}{_doubt(parts)}{also}"


def _error(answer: Answer) -> str:
    """What the quoted error is called: held-out where the fit has not seen its logs."""
    return "held-out error" if answer.split_by == HELD_OUT else "error"


def _told(answer: Answer) -> tuple[list[Ranked], list[Ranked]]:
    """Rows of the ranking that are sure, and those that are likely."""
    sure = [r for r in answer.ranking if r.effect in answer.sure]
    return sure, [r for r in answer.ranking if r.effect in set(answer.added) - set(answer.sure)]


def _partly(answer: Answer) -> str:
    """What is sure, what is likely, how much of the error it explains, and where the rest sits."""
    (sure, likely), parts = _told(answer), []
    if sure:
        parts.append(f"Missing, among others: {enumerated([_named(r) for r in sure])}.")
    if likely:
        names = enumerated([_named(r) for r in likely])
        parts.append(f"Likely, but not sure: {names}.{_doubt(likely)}")
    goes = f"{_error(answer)} goes from {answer.error_before:.2f} to {answer.error_after:.2f}"
    share = 1.0 - answer.excess_after / max(answer.excess_before, 1e-9)
    together = "Together they explain" if len(answer.added) > 1 else "It explains"
    explained = f"{100 * max(share, 0.0):.0f} % of the error beyond the noise"
    parts.append(f"{together} {explained} (the {goes} times the noise).")
    parts += [f"Still unexplained: {answer.rest}." if answer.rest else ""]
    parts += [f"Next: {answer.next}." if answer.next else ""]
    return " ".join(part for part in parts if part)


def _named(ranked: Ranked) -> str:
    """An effect with its figures; of many only how many, since the ranking lists them."""
    if len(ranked.parameters) > FEW:
        return f"{ranked.effect} ({len(ranked.parameters)} parameters)"
    values = ", ".join(f"{name} = {value}" for name, value in ranked.parameters.items())
    return f"{ranked.effect} ({values})"


def _doubt(parts: Sequence[Ranked]) -> str:
    alike = ((r.effect, ", ".join(r.equivalent_to)) for r in parts if r.equivalent_to)
    return "".join(f" These data cannot tell {effect} from {others}." for effect, others in alike)


def read_answer(folder: str | Path) -> dict[str, Any]:
    """The answer.json of a folder that discover wrote. Raises KembaError where there is none."""
    file = Path(folder) / "answer.json" if Path(folder).is_dir() else Path(folder)
    if not file.is_file():
        hint = "make one with: kemba-opt discover LOG... --out answer"
        raise KembaError(str(folder), "holds no answer.json", hint=hint)
    found = read_json(file)
    known = found if isinstance(found, dict) else {}
    if not (isinstance(known.get("verdict"), str) or isinstance(known.get("ranking"), list)):
        raise KembaError(str(file), "is no answer", "the answer.json of discover was expected")
    return known


class DiscoverSettings:
    """When an effect is called missing, and when its answer is doubted."""

    # p-value of nothing up to which something is missing: three false alarms in a hundred clean
    # data sets (counted by benchmarks/calibration.py)
    significant = 0.03
    matters = 0.2  # an effect below this share of its size is not reported
    apart = 1.96  # sigmas by which an effect differs from none: its 95 % interval
    # length of the blocks whose signs are redrawn by the bootstrap [s]: three times the memory of
    # its coloured forces
    fine = 0.1
    searching = 0.8  # share of the time limit after which the search ends


class VerdictSettings:
    """When an answer is complete (`missing`), and when it is a part of one (`partly`)."""

    whole = 1.5  # error, in noise units, that a whole answer may leave
    whole_share = 0.2  # or share of the error beyond the noise
    # p-value of nothing from which an error that no effect explains is no chance: two of 200 clean
    # machines of benchmarks/calibration.py have p-values of 0.017 and 0.02 with errors of 1.7 and
    # 2.1 times the noise
    unexplained = 0.01
    # error from which something is missing whatever that says: those machines leave 2.1 at most, a
    # rise time 14 % too long beside orifices 2.9 (benchmarks/blind)
    plain = 2.5
    part = 0.1  # smallest share of the error beyond the noise that a part of an answer explains
    # the same where more than `whole` is left and repeats itself, or a figure drifts
    part_of_structure = 0.5
    sure = 0.95  # probability from which an effect is sure: 95 %

    @classmethod
    def is_whole(cls, before: float, after: float) -> bool:
        """Whether an answer that leaves the error `after` of `before` [noise units] is complete."""
        return after <= cls.whole or excess(after) <= cls.whole_share * excess(before)
