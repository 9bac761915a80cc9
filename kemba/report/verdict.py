"""The first line of the page: the verdict in one plain sentence, and what to do next."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Literal

from kemba.errors import enumerated
from kemba.identify.answer import ENDED
from kemba.identify.compare.compare import Comparison
from kemba.identify.compare.words import place_of
from kemba.report.motion import Events
from kemba.units import short

Facts = Mapping[str, Any]
Grade = Literal["good", "fair", "bad"]
LONGER = 900  # s of a search for which the usual time was too short


@dataclass(frozen=True)
class ReviewVerdict:
    """`bad` is red: do not go on with this. `fair`: usable, but something is to be done."""

    grade: Grade
    sentence: str
    next: str
    command: str = ""
    doubt: str = ""

    def doubted(self, doubt: str, logs: str, run: str) -> ReviewVerdict:
        """The verdict with what speaks against it: logs that belong to another `run`."""
        grade: Grade = "bad" if self.grade == "bad" else "fair"
        command = f"kemba-opt review {logs} --run {shlex.quote(run)}"
        aim = "review these logs with the run that they execute:"
        return ReviewVerdict(grade, self.sentence, aim, command, doubt)

    def json(self) -> dict[str, str]:
        """As `review` and `report` print it with `--json`."""
        own = {name: getattr(self, name) for name in ("sentence", "doubt", "next", "command")}
        return {"verdict": self.grade, **own}

    def html(self) -> str:
        """As the first thing on the page."""
        doubt = f'<p class="doubt"><b>But:</b> {escape(self.doubt)}</p>' if self.doubt else ""
        command = f" <code>{escape(self.command)}</code>" if self.command else ""
        return (
            f'<div class="verdict {self.grade}" role="status"><p class="first">'
            f"{escape(self.sentence)}</p>{doubt}"
            f"<p><b>Next:</b> {escape(self.next)}{command}</p></div>"
        )


def of_plan(certificate: Facts, run: str, events: Events | None) -> ReviewVerdict:
    """Whether the plan may go to the robot."""
    sentence = str(certificate["sentence"]).split(";")[0]
    if not certificate.get("good", certificate["status"] == "solved"):
        if not sentence.startswith("FAILED"):
            sentence = f"FAILED: {sentence}"
        return ReviewVerdict("bad", _stop(sentence), _after_failure(certificate))
    rise = events.feet if events else None
    feet = "" if rise is None else f"; the feet rise {100 * rise:.1f} cm"
    plant = certificate.get("plant_replay")
    robot = "no simulated robot has tried it"
    if plant:
        error = 1e3 * plant["apex_error_m"]
        side = "higher" if error >= 0 else "lower"
        lands = "lands and " if plant.get("landed") and not plant.get("end") else ""
        robot = f"the simulated robot {lands}reaches {abs(error):.0f} mm {side}"
    feedback = certificate.get("feedback")
    if feedback:
        robot = f"with feedback by {feedback['by']} the simulated robot keeps to it"
    height = certificate["apex_m"]
    sent, policy = ("policy.npz", "--policy ") if feedback else ("controller.csv", "")
    return ReviewVerdict(
        "good",
        f"The plan is good: the body's centre reaches {height:.3f} m{feet}; {robot}.",
        f"send {sent} to the robot, or execute it on the simulated one:",
        f"kemba-opt simulate {shlex.quote(run)} {policy}--repeat 3 --noise",
        f"by controller.csv alone {feedback['alone']}." if feedback else "",
    )


def _after_failure(certificate: Facts) -> str:
    relax = certificate.get("relax") or []
    if relax:
        one = relax[0]
        return (
            f"ask for less: {one['requirement']} asks {one['asked']:.4g} {one['unit']}, and "
            f"{one['reachable']:.4g} {one['unit']} can be reached."
        )
    if certificate["status"] == "acceptable":
        return (
            "do not send it to the robot. See below where the simulated robot leaves the plan, "
            "change the task (another height, duration or landing), and solve it again."
        )
    return (
        "do not send it to the robot. See the worst violations below, change the task, "
        "and solve it again."
    )


def of_logs(
    events: Sequence[tuple[str, Events | None]],
    plan: Events | None,
    found: Comparison | None,
    answer: Facts | None,
    words: Mapping[str, str],
) -> ReviewVerdict:
    """What the logs show; `words`: names of files for the commands: `logs`, `answer`, `task`, and
    `rig`, the logs of a rig of the user's own with the model of the answer."""
    fallen = [(name, e.fault) for name, e in events if e and e.fault]
    if fallen:
        name, fault = fallen[0]
        more = f" ({len(fallen)} of {len(events)} logs)" if len(events) > 1 else ""
        return ReviewVerdict(
            "bad",
            f"FAILED: in {name} the robot {fault}{more}.",
            "see below where it leaves the plan; then ask what the model lacks:",
            f"kemba-opt discover {words['logs']}",
        )
    parts = [_flown([e for _, e in events if e], plan)]
    if answer:
        said = of_answer(answer, words)
        return ReviewVerdict(said.grade, _joined([*parts, said.sentence]), said.next, said.command)
    if found is None:
        aim = "compare it with a model:"
        return ReviewVerdict("fair", _joined(parts), aim, "kemba-opt compare")
    ratio = f"{short(found.noise_ratio)} times the noise"
    if found.good:
        text = f"the model explains the logs to within the noise ({ratio})"
        aim = f"nothing is to be added to the model{_jump(words)}."
        return ReviewVerdict("good", _joined([*parts, text]), aim)
    if found.tolerable:
        text = f"the model errs by {ratio}, no more than its nominal figures may be off"
        aim = "go on with this model, or identify its figures:"
    else:
        bad = found.worst
        where = f"; worst: {place_of(bad)} ({short(bad.ratio)} times)" if bad else ""
        text = f"the model {found.grade} the logs: its error is {ratio}{where}"
        aim = "find what the model lacks:"
    command = f"kemba-opt discover {words['logs']}"
    return ReviewVerdict("fair", _joined([*parts, text]), aim, command)


def of_bad_data(text: str, words: Mapping[str, str]) -> ReviewVerdict:
    """Logs that cannot be right."""
    return ReviewVerdict(
        "bad",
        f"FAILED: a log cannot be right: {_stop(text)}",
        "correct the log, or map its columns with --map; then check it:",
        f"kemba-opt check {words['logs']}",
    )


def of_answer(answer: Facts, words: Mapping[str, str]) -> ReviewVerdict:
    """What `discover` answered. A verdict that is not known here is given in its own words."""
    verdict, folder = str(answer["verdict"]), words["answer"]
    own = str(answer.get("sentence") or verdict).split(". ")[0].rstrip(".") + "."
    if verdict in ("missing", "partly"):
        added = [str(name) for name in answer.get("added") or ()]
        names = enumerated(added) or "an effect"
        before, after = answer.get("error_before"), answer.get("error_after")
        falls = ""
        if isinstance(before, int | float) and isinstance(after, int | float):
            them, error = "them" if len(added) > 1 else "it", f"{before:.2f} to {after:.2f}"
            falls = f"; with {them} the error falls from {error} times the noise"
        rest = ", and something more that is not known" if verdict == "partly" else ""
        said = f"The model lacks {names}{rest}{falls}."
        if not answer.get("model"):
            return ReviewVerdict("fair", said, "take more logs.")
        if added and all(name.startswith("sensor_") for name in added):
            aim = "correct the sensors, or their columns with a map (--map); no plan changes."
            return ReviewVerdict("fair", said, aim)
        if "rig" in words:
            aim = "see what the corrected model leaves of the error:"
            return ReviewVerdict("fair", said, aim, f"kemba-opt compare {words['rig']}")
        command = f"kemba-opt solve {words.get('task', 'jump.yaml')} --model {folder}/model.yaml"
        return ReviewVerdict("fair", said, "plan again with the corrected model:", command)
    if verdict == "nothing":
        return ReviewVerdict("good", own, f"nothing is to be added to the model{_jump(words)}.")
    if verdict == "bad-data":
        return ReviewVerdict("bad", f"FAILED: {own}", "correct the logs, and run discover again.")
    if verdict == "unknown" and ENDED in (answer.get("remarks") or ()):
        logs = words.get("logs") or "LOG..."
        command = f"kemba-opt discover {logs} --time-limit {LONGER}"
        return ReviewVerdict("fair", own, "let the search go on for longer:", command)
    if "rig" in words:
        return ReviewVerdict("fair", own, "take logs of other motions, and run discover again.")
    aim = "design the test that tells more:"
    return ReviewVerdict("fair", own, aim, f"kemba-opt experiment {folder}")


def _jump(words: Mapping[str, str]) -> str:
    return "" if "rig" in words else "; plan the next jump with it"


def _flown(events: Sequence[Events], plan: Events | None) -> str:
    """The robot's jumps in words; empty without any."""
    if not events:
        return ""
    heights = [e.apex for e in events]
    if plan is None:  # the logs may be of different motions
        ends = dict.fromkeys(f"{height:.3f}" for height in (min(heights), max(heights)))
        return f"The robot's body reaches {' to '.join(ends)} m"
    mean = sum(heights) / len(heights)
    error = 1e3 * (mean - plan.apex)
    side = "above" if error > 0 else "below"
    off = f", {abs(error):.0f} mm {side} the plan," if round(error) else " as planned"
    return f"The robot reaches {mean:.3f} m{off} and stays upright"


def _joined(parts: Sequence[str]) -> str:
    shown = [part.rstrip(".") for part in parts if part]
    first, *others = shown
    text = "; ".join([first, *(other[:1].lower() + other[1:] for other in others)])
    return text[:1].upper() + text[1:] + "."


def _stop(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."
