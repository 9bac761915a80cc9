"""What the tool says of logs, as lines of Markdown."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from kemba.config import dump_yaml
from kemba.identify.answer import Answer
from kemba.identify.rigs.characterise import characterise_logs
from kemba.identify.workflow import discover_logs

Logs = Sequence[Path]
SECONDS = 900.0  # for one search; the machine may be busy


def said(answer: Answer) -> str:
    """The answer's sentence, as a quotation."""
    return f"> {answer.sentence}"


def answered(logs: Logs, model: str, scratch: Path) -> list[str]:
    """The answer of `discover`: sentence and ranking."""
    answer, _ = discover_logs(logs, (), model, time_limit=SECONDS)
    lines = [said(answer), "", f"Verdict: `{answer.verdict}`.", ""]
    if answer.ranking:
        lines += ["| effect | probability | parameters | error after |", "|---|---|---|---|"]
    for row in answer.ranking[:6]:
        values = "; ".join(f"{name} = {value}" for name, value in row.parameters.items())
        share = f"{100 * row.probability:.0f} %"
        lines.append(f"| `{row.effect}` | {share} | {values} | {row.error_after:.2f} |")
    return [*lines, ""]


def fitted(logs: Logs, model: str, effects: Iterable[str], scratch: Path) -> list[str]:
    """What `characterise` finds with these effects listed."""
    path = scratch / "listed.yaml"
    dump_yaml({"base": model, "effects": [{"kind": kind} for kind in effects]}, path)
    found = characterise_logs(logs, str(path))
    lines = ["| figure | given | fitted | 95 % | unit |", "|---|---|---|---|---|"]
    lines += [
        f"| `{f.name}` | {f.given:.4g} | {f.value:.4g} | {f.low:.4g} to {f.high:.4g} | {f.unit} |"
        for f in found.figures
    ]
    error = f"{found.error_before:.3g} to {found.error_after:.3g}"
    return [*lines, "", f"The error falls from {error} times the noise of the sensors.", ""]


def listed(notes: Iterable[str]) -> list[str]:
    """Notes as a list."""
    return [f"- {note}" for note in notes]
