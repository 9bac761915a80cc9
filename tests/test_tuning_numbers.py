"""Numbers at the top of a module have a comment that says what they are."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import kemba

ROOT = Path(kemba.__file__).parent
DRAWN = (
    "plotting/",
    "report/",
)  # lengths, colours and speeds of pictures

# Numbers at a module's top level that are explained here and not by a comment beside them.
CONSTANTS = {  # file -> names, why
    # physics
    "effects/pneumatics/flow.py": (
        "ATMOSPHERE KAPPA GAS TEMPERATURE CHOKED SUBSONIC SOFT",
        "constants of air; the critical pressure ratio; smoothing",
    ),
    "effects/pneumatics/chamber.py": ("OF_A_KIND ENTRY", "tolerances of an effect's figures"),
    "effects/pneumatics/switching.py": ("ON", "what a valve takes for a command"),
    "effects/pneumatics/valve.py": ("EARLIEST", "nothing switches before its command"),
    "effects/mechanics/boom.py": ("V_BOOM W_PITCH", "smoothing widths of formulas"),
    "effects/pneumatics/gas.py": ("ROUND", "rounds a root, as SOFT does"),
    "effects/mechanics/piston.py": ("V_COULOMB", "smoothing width of a formula"),
    "effects/mechanics/ground.py": ("SMOOTH", "smoothing width of a formula"),
    "effects/mechanics/hip.py": ("W_COULOMB", "smoothing width of a formula"),
    "effects/base.py": ("REMEASURED", "tolerance of what a discovery has measured"),
    "effects/sensors.py": ("CHANNELS", "noise of the robot's sensors"),
    "mechanism/robot.py": (
        "HIP_RANGE COUNTER_CLOCKWISE DOWN",
        "geometry: where the knee would rise above the body; directions",
    ),
    "plant/published.py": ("PAPER_RISE PAPER_FORCE PAPER_DEAD_TIME", "the paper's figures"),
    "plant/rigs.py": (
        "FORCE_NOISE VALVES SPEEDS",
        "noise of a force transducer; what a bench test does unless its file says more",
    ),
    "plant/characterise.py": ("MODES", "names of valve modes"),
    "plant/certificate.py": (
        "DIGITS SLOW",
        "digits of numbers in a file; slower impacts are not told",
    ),
    "plant/repeat.py": (
        "ENCODERS VALVE_SCATTER",
        "steps of the robot's encoders; scatter of the robot's valves",
    ),
    "plant/controller.py": ("PERIOD", "rate of the robot's controller"),
    "ocp/mpcc/solve.py": (
        "PATHS FACTOR OFF LONG BRANCH SCALED TRIED MARGIN SWITCHES PAYS SLOPE COMPARED WORTH "
        "RESIDUAL STEP LONGEST",
        "figures of a general method, chosen on NOSBENCH (benchmarks/pages/nosbench.md)",
    ),
    "ocp/nlp/ending.py": ("USUAL", "iterations of which a median is taken"),
    "ocp/controller.py": ("PERIOD", "rate of the robot's controller"),
    "effects/rigs/axis.py": ("PLATE", "tolerance of an effect's figures"),
    "effects/mechanics/geometry.py": ("SIZES", "sizes of an effect's parameters"),
    "mechanism/own_rigs.py": ("GRAVITY", "of the earth"),
    "mechanism/knee.py": ("REACH", "rounding: the slope of an angle stays finite"),
    # formulas and formats
    "logs/formats/__init__.py": ("LARGEST", "a limit, with its reason"),
    "logs/formats/mat_child.py": ("MEMORY DEEPEST", "the same limit, with room to read; depth"),
    "logs/formats/mcap.py": ("NS", "nanoseconds of a second"),
    "logs/draft/matching.py": (
        "STEP ABSOLUTE NOTHING ENOUGH SAID_TOO UNRELATED ASKED_FOR STRANGER SURE",
        "steps and pressures that tell a column; how the words of a name are weighed",
    ),
    "logs/draft/clock.py": (
        "RISING REPEATED STAMPED ALIKE NEAR PLOTTER NAMED MENTIONED BY_UNIT UNNAMED COUNTER "
        "LARGEST",
        "how clocks are ranked by their names; units",
    ),
    "logs/draft/words.py": ("UNIT_NORM", "rounding of a quaternion's norm"),
    "logs/times.py": ("FULL LONGEST DAY HOUR", "what one rate and no gap mean; seconds of them"),
    "logs/draft/draft.py": ("LINES NEARLY", "how a table is looked at"),
    "ocp/transcription/stage.py": ("ANGLE_ARM COST_SCALE AIM", "units of moments and costs"),
    "ocp/task/requirement.py": ("SCALES ROUND", "units; rounding"),
    "contract/cases.py": ("OWN_RIGS", "figures of example rigs"),
    "identify/robot/physics.py": ("FOLDED", "how far a knee folds at most"),
    "identify/rigs/rig_log.py": ("GAIN", "a Gaussian's cut"),
    "events.py": ("PLANNED", "what the solver's tolerance leaves of a closed gap"),
    "plant/kernel/machine.py": ("GAMMA", "coefficient of the integration scheme"),
    "ocp/phases/radau.py": ("RADAU3 RADAU5 RADAU9", "stages of the integration schemes"),
    "identify/bench/prediction.py": ("V_NODES V_MIDDLE", "nodes of a Gauss-Hermite formula"),
    "identify/bench/clocks.py": ("OWNERS", "signs of a rate, by whose clock it is"),
    "identify/answer.py": ("FEW", "what a sentence has room for"),
    "identify/infer/joint.py": (
        "LOOSE ALIKE FAR ROUNDS BLOCKS DISAGREE TELLS OF_A_RUN",
        "as good as none; one; three sigmas; counts; a p-value",
    ),
    "rounds/correction.py": ("TURNED", "beyond any other error"),
    "identify/workflow.py": ("QUOTED AROUND", "logs of which one is kept aside; of a speed"),
    "identify/infer/selection.py": ("ANY STRONG SAME", "evidence; rounding of a fit"),
    "model/evidence.py": ("ROUNDING WIDER", "rounding; noise of a span's ends"),
    "identify/logs/reading.py": ("RANGES", "physical limits of channels, by name"),
    "identify/robot/forces.py": ("BODY", "places of channels among the coordinates"),
    "ocp/functions/code.py": ("SHAPING", "numbers that CasADi simplifies"),
    "ocp/transcription/layout.py": ("STEP", "unit of steps, shared by all grids"),
    "ocp/phases/modes.py": ("OPEN HELD AHEAD BACK", "names of modes"),
    "plant/kernel/play.py": ("DONE FULL ASK EXPLODED BURIED", "names of endings"),
    "plant/kernel/events.py": ("FREE TOUCHED TOO_LONG", "names of endings"),
    # rounding and sizes of memory
    "ocp/transcription/first_node.py": ("SAME", "rounding"),
    "plant/player.py": ("ROOM", "size of memory"),
    # limits of files, messages and reports
    "effects/expression.py": ("TRIED TRIED_AT_LEG", "values at which a formula is tried"),
    "effects/formula.py": ("LONGEST DEEPEST", "longest text that is read"),
    "config/parsing.py": ("MOST SHOWN", "length of messages"),
    "config/document.py": (
        "WIDE LONGEST NAME WIDTH",
        "length of messages; longest name; width of lines",
    ),
    "logs/foreign.py": ("LONGEST", "length of messages"),
    "logs/formats/arrays.py": ("LONGEST", "time in which a file must be read"),
    "config/reader.py": ("LONGEST_NUMBER", "longest text that is read"),
    "identify/design/rig.py": ("STEEPEST", "the shape of a cubic"),
    "identify/design/robot.py": ("STANDARD", "the motion that others are compared with"),
    "errors.py": ("LISTED PART FEW", "length of messages"),
    "folders.py": ("PROBE MANY", "free space that a run takes; length of messages"),
    "ocp/refinement/start.py": ("WORST", "violations that a report lists"),
    "sweep/farm.py": ("ENVIRONMENT", "environment of workers"),
    "units.py": ("USUAL", "powers and sizes of units"),
}


def numbers(node: ast.expr) -> Iterator[float]:
    """Numbers in an expression."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and type(part.value) in (int, float):
            yield part.value


@cache
def constants() -> dict[str, dict[str, bool]]:
    """File -> names at its top level to which an expression with a number is assigned, and whether
    a comment stands on the line or above it."""
    found: dict[str, dict[str, bool]] = {}
    for path in sorted(ROOT.rglob("*.py")):
        file, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
        lines = text.splitlines()
        for node in ast.parse(text).body:
            above, own = lines[max(0, node.lineno - 2)], lines[node.lineno - 1 : node.end_lineno]
            told = above.startswith("#") or any("# " in line for line in own)
            if file.startswith(DRAWN) or not isinstance(node, ast.Assign | ast.AnnAssign):
                continue
            if node.value is None or isinstance(node.value, ast.Subscript):  # a type
                continue
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]
            if list(numbers(node.value)) and names:
                found.setdefault(file, {}).update(dict.fromkeys(names, told))
    return found


def test_no_tuning_number_hides_at_the_top_of_a_module() -> None:
    explained = {file: set(names.split()) for file, (names, _) in CONSTANTS.items()}
    found = [
        f"{file}: {name}"
        for file, names in constants().items()
        for name, told in names.items()
        if not told and name not in explained.get(file, ())
    ]
    assert not found, f"say in a comment what these are: {found}"


def test_no_explanation_outlives_its_constant() -> None:
    told = {f"{file}: {name}" for file, (names, _) in CONSTANTS.items() for name in names.split()}
    there = {f"{file}: {name}" for file, names in constants().items() for name in names}
    assert sorted(told - there) == []
