"""Write benchmarks/pages/reliability-of-the-program.md from what was really run.

    python benchmarks/program_page.py

Reads benchmarks/program.json (kept by fuzz.py, faults.py, calibration.py, redrawn_noise.py and
mutants.py), benchmarks/random_mutants.jsonl with .yaml, and benchmarks/program_points.yaml (24
defects that were found once, and the tests that watch them).
"""

import json
from pathlib import Path
from statistics import median
from typing import Any

from program import load
from random_mutants import listed
from scipy.stats import kstest

from kemba.config import load_yaml
from kemba.errors import enumerated
from kemba.identify.answer import DiscoverSettings
from kemba.scenarios.share import wilson

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "benchmarks" / "pages" / "reliability-of-the-program.md"
POINTS = Path(__file__).with_name("program_points.yaml")
SAME = Path(__file__).with_name("random_mutants.yaml")
REQUIREMENTS = Path(__file__).with_name("requirements.json")
LOGS = (
    "sidecars",
    "bench logs",
    "mapped logs",
    "other formats",
    "foreign logs",
    "robot logs",
    "what could be seen",
    "compare",
    "discover",
)
FORMATS = (  # binary ones, each tried by itself
    "our npz", "our mat", "our parquet", "our mcap", "mdf", "tdms", "tdms with times", "ulog",
    "bag", "mcap of ros", "simulink", "simulink 7.3", "parquet",
)  # fmt: skip
HEAD = """# Reliability of the program

Does the program answer every input, lose nothing when it is stopped, and claim only what is so?
This page says what was tried and what came out. It is written by `benchmarks/program_page.py` from
records of what was really run; numbers that are still small are shown as they are.
"""
Counts = dict[str, dict[str, int]]


def table(head: list[str], rows: list[list[Any]]) -> str:
    """A table of the page."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def of_code(commits: dict[str, list[str]]) -> str:
    """Which code was tried last; older records name none."""
    names = list(dict.fromkeys(name for part in commits.values() for name in part))
    if not names:
        return ""
    return f" The newest counts are of commit {', '.join(f'`{name}`' for name in names)}."


def fuzz(found: Counts, commits: dict[str, list[str]]) -> str:
    """Broken inputs: how many, and how many broke the rule."""
    logs = {*LOGS, *FORMATS}
    groups = [(set(found) - logs, "YAML files"), (set(found) & logs, "logs")]
    keys = ("inputs", "crash", "hang", "no place")
    head = ["tried", "crashes", "hangs", "no place"]
    text = table(
        ["broken inputs", *head, "slowest"],
        [_counted([found[n] for n in sorted(names)], title, keys) for names, title in groups],
    )
    formats = table(
        ["of these logs", *head, "silent", "slowest"],
        [_counted([found[n]], n, (*keys, "silent")) for n in FORMATS if n in found],
    )
    return f"""## Broken inputs

Files made from the JSON Schemas, shipped files with damage, and sound logs with damage, our own and
of fourteen other programs and formats, drawn by hypothesis (`tests/fuzz`). The rule: exit code 2
with the place of the mistake, or 1 with a reason, never "failed unexpectedly", never more than 10 s
of CPU time (dry runs of `solve` 30 s, `compare` 60 s, `discover` 120 s). What is found is
mended and kept in `tests/fuzz`; the counts are of inputs drawn anew after that.{of_code(commits)}

{text}

Each binary format by itself, with other readings than the sound file has as *silent* where no word
is said of it. What no format tells is not counted: of files without checksums (all but NPZ, MCAP,
MATLAB's version 7 and our own Parquet) a changed reading is read as it stands, and a ULog that ends
between two messages is as good as a whole one. Earlier draws found a crash (a NaN that signals),
and readings that were lost or made up without a word in MDF, TDMS, ULog, bags and MATLAB files;
formats in which one was found were drawn anew after its mending.

{formats}

More: `python benchmarks/fuzz.py --examples 1000 --seed 7`, and `--formats`.
"""


def _counted(parts: list[dict[str, int]], title: str, keys: tuple[str, ...]) -> list[Any]:
    """A row of what became of inputs."""
    totals = [sum(part.get(key, 0) for part in parts) for key in keys]
    slowest = max((part.get("slowest_ms", 0) for part in parts), default=0)
    return [title, *totals, f"{slowest / 1e3:.1f} s"]


def requirements() -> str:
    """Requirements at random: how many are kept, how many are told to fail, how many neither."""
    found = json.loads(REQUIREMENTS.read_text(encoding="utf-8"))
    counts, silent = found["counts"], len(found["silent"])
    tried = sum(counts[status] for status in counts if status != "solved, kept")
    told = ", ".join(
        f"{counts[status]} {status}" for status in ("infeasible", "limit", "acceptable", "stalled")
    )
    return f"""## Requirements at random

Each draw adds four random requirements to one of eight tasks: a quantity at the end, at a moment,
during an interval or always, near what the plain plan has or well away. The answer of `solve` is
compared with the written `trajectory.csv`, read by the csv module alone. Of {tried} requirements
{counts["solved"]} are of tasks that are `solved`, and {counts["solved, kept"]} of these are kept;
the others are of tasks that are told to fail ({told}; four at random seldom go together, and a
solve had 40 s beside other work). Missed without a word: {silent}, at most
{found["wilson"][1]:.1%} (Wilson, 95 %).

More: `python benchmarks/requirements.py --draws 125 --each 4 --seed 4`.
"""


def faults(found: Counts, commits: dict[str, list[str]]) -> str:
    """Faults in the middle of work."""
    keys = ("faults", "killed", "ended", "interrupted", "disk full", "clock back", "shut", "wrong")
    rows = [[f"`{name}`", *(part.get(key, 0) for key in keys)] for name, part in found.items()]
    rows.append(["all", *(sum(part.get(key, 0) for part in found.values()) for key in keys)])
    head = ["verb", "faults", "SIGKILL", "SIGTERM", "SIGINT", "disk full", "clock back"]
    head += ["not writable", "wrong"]
    return f"""## Faults in the middle of work

Signals at random moments, disks that fill up at random sizes, a clock that goes back, and folders
that cannot be written (`tests/faults`; two commands in one folder and a user without a home are
tested there, too). After each: no half-written file under a final name; results whole, or clearly
partial and completed by the same command; the same results as without the fault. *wrong* counts the
faults after which one of these did not hold.{of_code(commits)}

{table(head, rows)}

More: `python benchmarks/faults.py --faults 50 --seed 3`.
"""


MACHINES = {
    "near": "figures off by 1 %, no effect; before the mending",
    "declared": "figures off by the declared tolerances, no effect; before",
    "imperfect before": "the same, and every effect and sensor fault at about 5 %, but no delay or "
    "lag; before",
    "imperfect": "the same after it, machines of other seeds; before hypotheses were scored at "
    "their mode",
    "late before": "the same with delays and lags; before",
    "late old slopes": "the same since then; before intervals were taken from slopes that hold",
    "late": "the same since hypotheses are scored at their mode, and intervals are taken from "
    "slopes that hold, machines of other seeds",
    "late figures": "the same since nominal figures count where left-out data are asked, machines "
    "of other seeds",
}

LEVEL = "clean late level 0.05"  # answers at this level tell of all below it


def calibration(found: dict[str, dict[str, Any]], redrawn: dict[str, dict[str, Any]]) -> str:
    """False alarms, p-values and intervals."""
    clean = [_clean(title, found.get(f"clean {name}", {})) for name, title in MACHINES.items()]
    hidden = [_hidden(title, found.get(f"missing {name}", {})) for name, title in MACHINES.items()]
    noise, levels = _redrawn(redrawn.get("as drawn", {})), _levels(found.get(LEVEL, {}))
    alarms = ["machines", "logs of", "false alarms", "95 %", "sure and wrong", "median p"]
    alarms += ["p <= 0.02", "KS"]
    truths = ["machines", "one effect missing", "named alone", "others named", "interval holds"]
    return f"""## Are p-values and intervals what they say?

The p-value of "nothing is missing" counts how often machines in which nothing is missing look as
bad. Such a machine is not its drawing: its figures are off within the tolerances that the model
declares, and every effect may be there with 5 % of its size. So p-values are uniform on machines
drawn like this, and on no others. On a linear problem they are: of 200 machines p-values are
uniform (Kolmogorov-Smirnov), at most 3 % are false alarms, and 93 to 97 % of the 95 % intervals
hold the truth (`tests/identify/infer/test_significance.py`).

Bench logs of the twin of the tests, two of 2 s each (`benchmarks/calibration.py`; KS: p of
Kolmogorov-Smirnov, below 0.05 the p-values are not uniform). p-values are multiples of 1/401, the
share of 400 simulated logs: a step far below the 0.1 by which the distribution of 200 of them must
be off to be noticed, so that the usual test of continuous values is used as it is.

{table(alarms, [row for row in clean if row])}

{table(truths, [row for row in hidden if row])}

Before the last row, intervals were those of slopes that hold for the model as it is, and 9 of 21
of delays did not hold the truth: beside a small lag of the hose, which acts 2 ms later where valves
open 2 ms later, and beside sensors that are late by parts of a row. Intervals are now taken from
slopes at the best fit, with nothing read off between rows
(`kemba/identify/infer/joint.py`).

Something is missing up to a p-value of {DiscoverSettings.significant:g}. {levels}

Where no effect is there at all, p-values are larger than uniform ones and intervals wider than
needed: the test is careful.

On machines drawn as the test believes them to be p-values were too small. A cause was the
noise of the simulated logs: the fit that tells it from physics has some sixty figures, and takes
slow noise for effects. {noise}

Delays of a fraction of a row were worst: an edge falls before or after a reading, while a slope
over a row tells of neither. A refitted delay had the residual of its own size, and the model
without it had not. Every hypothesis is now scored where it fits best, small effects included, by
the residual there (`kemba/identify/infer/null_model.py`), and logs and simulated logs
are asked the same: what the slopes about the best fit of nothing say of single effects.
The verdict also rests on another rule: an effect below a fifth of its size is no finding.
"""


def _redrawn(found: dict[str, Any]) -> str:
    """How much of the noise the simulated logs have."""
    if not found:
        return "The noise of a block is now what a fit to the other blocks leaves of it."
    return f"""Along the effects the noise of {found["pairs"]} pairs of logs of a machine as
drawn has {found["noise"]:.1f} times the power of white noise (`benchmarks/redrawn_noise.py`).
Redrawn from what the fit of all blocks leaves it had {found["redrawn from all"]:.1f}. The noise of
a block is now what a fit to the other blocks leaves of it: {found["redrawn from others"]:.1f}."""


def _clean(title: str, cases: dict[str, dict[str, Any]]) -> list[Any]:
    """A row about machines in which nothing is missing."""
    if not cases:
        return []
    alarms = sum(c["verdict"] != "nothing" for c in cases.values())
    low, high = (100 * x for x in wilson(alarms, len(cases)))
    p = [c["p"] for c in cases.values() if isinstance(c["p"], float)]
    rare = f"{sum(x <= 0.02 for x in p)} of {len(p)}"
    uniform = f"{kstest(p, 'uniform').pvalue:.2g}"
    return [
        title,
        len(cases),
        alarms,
        f"{low:.0f} to {high:.0f} %",
        sum(c["verdict"] == "missing" for c in cases.values()),
        f"{median(p):.2f}",
        rare,
        uniform,
    ]


def _levels(cases: dict[str, dict[str, Any]]) -> str:
    """False alarms on the same machines by the level of the p-value."""
    told = [c for c in cases.values() if c["verdict"] != "nothing"]
    levels = (0.02, 0.03, 0.05)
    counts = [f"{sum(c['p'] <= level for c in told)} at {level:g}" for level in levels]
    return f"""By this level, so
many of {len(cases)} further machines with delays and lags are called faulty:
{enumerated(counts)}."""


def _hidden(title: str, cases: dict[str, dict[str, Any]]) -> list[Any]:
    """A row about machines in which one effect is missing."""
    if not cases:
        return []
    named = [h for h in cases.values() if h["named"]]
    others = sum(h["verdict"] == "missing" and not h["named"] for h in cases.values())
    inside = sum(bool(h["inside"]) for h in named)
    return [title, len(cases), len(named), others, f"{inside} of {len(named)}"]


def mutants(found: dict[str, Any]) -> str:
    """How many one-line bugs the tests notice."""
    done: dict[str, str] = found.get("outcomes", {})
    killed, tried = sum(v == "killed" for v in done.values()), len(done)
    text = f"{found.get('listed', 0)} bugs are listed; none was tried."
    if tried:
        low, high = (100 * x for x in wilson(killed, tried))
        text = (
            f"{found.get('listed', 0)} bugs are listed; of the {tried} that were tried, the tests\n"
            f"noticed {killed}: {100 * killed / tried:.0f} % "
            f"(95 %: {low:.0f} to {high:.0f} %)."
        )
    alive = "\n".join(f"- survived: {name}" for name, v in sorted(done.items()) if v != "killed")
    return f"""## Would the tests notice?

One-line bugs are put into the code, one by one, and the tests nearest to them must fail
(`benchmarks/mutants.py`, `benchmarks/mutants.yaml`). {text}

{alive}
"""


PARTS = {"kemba/logs": "readers", "kemba/identify": "inference", "kemba/solve": "loop"}


def part_of(file: str) -> str:
    """Which part of the code a file is of."""
    return next((name for path, name in PARTS.items() if file.startswith(path)), "motions, rest")


def at_random() -> str:
    """One-line bugs at random places: run, equivalent, noticed at once, noticed since, by draw and
    by part of the code."""
    bugs = [bug for bug in listed() if "outcome" in bug]
    same = {(bug["file"], bug["now"]): bug["why"] for bug in load_yaml(SAME).data}
    draws = list(dict.fromkeys(bug["seed"] for bug in bugs))
    counts = {(seed, part): [0] * 4 for seed in draws for part in ("all",)}
    told: list[str] = []
    for bug in bugs:
        why = same.get((bug["file"], line(bug)))
        before = not why and bug["outcome"] == "killed"
        since = before or (not why and bug.get("again") == "killed")
        for part in (part_of(bug["file"]), "all"):
            row = counts.setdefault((bug["seed"], part), [0] * 4)
            for i, counted in enumerate((True, why, before, since)):
                row[i] += bool(counted)
        if why:
            told.append(f"- equivalent: `{bug['file']}`: `{line(bug)}` ({why})")
        elif not since:
            told.append(f"- survives: `{bug['file']}`: `{line(bug)}`")
    head = ["seed, code", "run", "equivalent", "noticed", "noticed since"]
    rows = [[f"{seed}, {part}", *row] for (seed, part), row in sorted(counts.items()) if row[0]]
    whole = [sum(row[i] for (_, part), row in counts.items() if part == "all") for i in range(4)]
    rows.append(["all", *whole])
    judged = whole[0] - whole[1]
    drawn = "\n".join(_draw([bug for bug in bugs if bug["seed"] == seed], same) for seed in draws)
    return f"""## Would they notice bugs that nobody chose?

Changes of one line at random places of newer code (comparisons, signs, constants, branches,
keywords, order of arguments: `benchmarks/random_mutants.py`, `benchmarks/mutations.py`). Each is
run against quick tests that run its line, and, where coverage does not see them or was not at hand,
against those of its module, by hand. Of seed 64 these were tests of at most 4 s each and 60 s
together, and by hand others of its part of the code, all as they were before the draw. What is
noticed since, with the tests that were added for the survivors, was aimed at, and says nothing of
bugs that were not run: of these about as many are noticed as at once.

{drawn}
- All together, {judged} that are not equivalent: at once {share(whole[2], judged)};
  since then {share(whole[3], judged)}.
- An earlier list (seed 57) met only the tests near each file: 20 of 45 were noticed, and tests for
  the others written.

{table(head, rows)}

{chr(10).join(sorted(told))}

What survives are mostly figures of searches and scales, changed by a tenth or by one: no test calls
another value of theirs wrong.
"""


def _draw(bugs: list[dict[str, Any]], same: dict[tuple[str, str], str]) -> str:
    """What became of the bugs of one draw."""
    judged = [bug for bug in bugs if (bug["file"], line(bug)) not in same]
    before = sum(bug["outcome"] == "killed" for bug in judged)
    since = before + sum(bug.get("again") == "killed" for bug in judged)
    of = f", on lines newer than `{bugs[0]['since']}`" if bugs[0].get("since") else ""
    drawn = sum(bug["seed"] == bugs[0]["seed"] for bug in listed())
    left = (
        f" ({drawn - len(bugs)} more were drawn, most of slow modules)" if drawn > len(bugs) else ""
    )
    return f"""- Seed {bugs[0]["seed"]}: of {bugs[0]["places"]} changes{of}, {len(bugs)} were
  run{left}. Of the {len(judged)} that are not equivalent, by hand, the tests noticed
  {share(before, len(judged))}; since then
  {share(since, len(judged))}."""


def line(bug: dict[str, Any]) -> str:
    """The changed line of a bug at random."""
    return bug["now"].splitlines()[-1].strip()


def share(killed: int, of: int) -> str:
    """How many were noticed, with the interval of their share."""
    low, high = (100 * end for end in wilson(killed, max(of, 1)))
    return f"{killed} ({100 * killed / max(of, 1):.0f} %; 95 %: {low:.0f} to {high:.0f} %)"


def reached(whole: dict[str, dict[str, Any]]) -> str:
    """What was aimed at, and how much of it was really run."""
    inputs = whole.get("fuzz", {})
    counts = {name: part.get("inputs", 0) for name, part in inputs.items()}
    logs = sum(count for name, count in counts.items() if name in (*LOGS, *FORMATS))
    files = sum(counts.values()) - logs
    known = whole.get("calibration", {})
    rows = [
        ["broken YAML files", 5000, files],
        ["broken logs", 1500, logs],
        ["broken logs of each binary format", 300, min(counts.get(name, 0) for name in FORMATS)],
        ["faults", 100, sum(part.get("faults", 0) for part in whole.get("faults", {}).values())],
        ["clean machines, by today's test", 200, len(known.get(LEVEL, {}))],
        ["one-line bugs", 150, len(whole.get("mutants", {}).get("all", {}).get("outcomes", {}))],
    ]
    short = [[*row, "yes" if row[2] >= row[1] else "**no**"] for row in rows]
    return f"""## What was aimed at

Where the last column says no, the figures of this page are from fewer cases than was aimed at, and
rates of one in a hundred cannot be told from them. The scripts add to their records.

{table(["", "aimed at", "run", "reached"], short)}
"""


def points() -> str:
    """The defects that were found once, each with its tests."""
    rows = []
    for point in load_yaml(POINTS).data:
        tests = ", ".join(f"`{test}`" for test in point["tests"])
        rows.append([point["number"], point["defect"], tests or point["open"]])
    lines = [["", "defect", "watched by"], ["---:", "---", "---"], *rows]
    text = "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
    return f"""## What was found once

Fuzzing, fault injection and a security read of an early version found these. Each has tests that
failed before it was mended.

{text}
"""


def main() -> None:
    whole = load()
    code = whole.get("code", {})
    parts = [
        HEAD,
        reached(whole),
        fuzz(whole.get("fuzz", {}), code.get("fuzz", {})),
        requirements(),
        faults(whole.get("faults", {}), code.get("faults", {})),
        calibration(whole.get("calibration", {}), whole.get("redrawn noise", {})),
        mutants(whole.get("mutants", {}).get("all", {})),
        at_random(),
        points(),
    ]
    text = "\n".join(parts)
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
