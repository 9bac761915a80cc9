"""`review`: the words and numbers of the page; how it looks is tested in a browser."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from kemba.files import read_json
from kemba.identify.answer import ENDED, read_answer
from kemba.mechanism import load_robot
from kemba.plotting.source import Source, load_machine
from kemba.report.charts import Track, gather, grid_of, in_plans_clock, on_grid, start_of
from kemba.report.limits import air_drawn, event_table, motor_share, supply_share
from kemba.report.model_error import answer_parts
from kemba.report.motion import Events, events_of
from kemba.report.verdict import of_answer, of_logs, of_plan
from kemba.runs import PLANT_RUN, load_run, newest_run
from kemba.trajectory import Trajectory
from kemba_cli.main import app

WORDS = {"answer": "answer", "logs": "log.csv"}


def call(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


@pytest.fixture(scope="module")
def page(jump: Path) -> tuple[dict[str, str], str]:
    """What `review` says of the jump, and its page."""
    logs = [str(path) for path in sorted((jump / "logs").glob("*.csv"))]
    done = call("review", *logs, "--run", str(jump), "--json")
    assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)
    return said, Path(said["review"]).read_text(encoding="utf-8")


def test_the_plants_motion_is_kept_with_the_run(jump: Path) -> None:
    """In the plan's clock, with the figures of the certificate."""
    plan, plant = load_run(jump).trajectory, Trajectory.read(jump / PLANT_RUN)
    facts = load_run(jump).certificate["plant_replay"]
    higher = plant["body/z"].max() - plan["body/z"].max()
    assert higher == pytest.approx(facts["apex_error_m"], abs=1e-4)
    assert plant.time[0] == pytest.approx(start_of(load_run(jump).controller))
    assert plant.meta["kind"] == "simulation"
    assert all(impact["energy_J"] >= 0.0 for impact in plant.meta["impacts"])


def test_the_verdict_comes_first_and_names_the_next_step(page: tuple[dict[str, str], str]) -> None:
    said, text = page
    body = text.index("<body>")
    assert said["sentence"] in text
    assert text.index('class="first"', body) < text.index("<section>", body)
    assert said["verdict"] in ("good", "fair")
    assert re.search(r"m(, \d+ mm (above|below) the plan,| as planned) and", said["sentence"])
    assert said["command"].startswith("kemba-opt discover ") or not said["command"]


def test_all_motions_are_on_the_page(page: tuple[dict[str, str], str]) -> None:
    data = json.loads(page[1].split("charts(")[-1].split(");</script>")[0])
    assert [t["name"] for t in data["tracks"]] == ["plan", "simulated robot", "log-1", "log-2"]
    height = data["charts"][0]
    assert [line["label"] for line in height["lines"]] == [t["name"] for t in data["tracks"]]
    assert [line["track"] for line in data["charts"][1]["lines"]] == [1, 2, 3]
    assert all(len(line["v"]) == len(data["time"]) for c in data["charts"] for line in c["lines"])
    assert {track for _, track in data["marks"]} == {0, 1, 2, 3}
    assert any(chart["band"] for chart in data["charts"])
    for words in ("Where the model fails", "torque against speed", "friction cone", "air drawn"):
        assert words in page[1]


def test_logs_are_put_on_the_plans_clock(jump: Path) -> None:
    """Whenever the log was started: the valve commands tell."""
    run = load_run(jump)
    log = Trajectory.read(jump / "logs" / "log-1.csv")
    late = Trajectory(log.time + 5.0, {h: log[n] for h, n in zip(log.headers, log.names)})  # noqa: B905
    shown = in_plans_clock(late, run.controller)
    assert shown.time[0] == pytest.approx(start_of(run.controller), abs=2e-3)
    tracks = gather(run, [Trajectory(late.time, {"body/z [m]": late["body/z"]}, {"name": "a"})])
    assert tracks[-1].t.time[0] == pytest.approx(start_of(run.controller), abs=1e-9)


def test_the_grid_holds_steps_as_they_act(jump: Path) -> None:
    track = gather(load_run(jump), [])[1]
    grid = grid_of([track])
    valve = on_grid(track, "front/valve/extend", grid, steps=True)
    assert set(np.unique(valve[np.isfinite(valve)])) <= {0.0, 1.0}
    assert 500 < len(grid) <= 1001


def test_apex_and_touchdown_are_those_of_the_certificate(jump: Path) -> None:
    run = load_run(jump)
    plan, plant = gather(run, [])
    machine = load_machine()
    planned, there = events_of(plan, machine), events_of(plant, machine)
    assert planned is not None and there is not None
    facts = run.certificate["plant_replay"]
    assert there.apex - planned.apex == pytest.approx(facts["apex_error_m"], abs=3e-4)
    down = [min(t for times in e.touchdowns.values() for t in times) for e in (planned, there)]
    assert down[1] - down[0] == pytest.approx(facts["touchdown_error_s"], abs=4e-3)
    assert there.fault is None


def test_a_robot_that_tips_over_is_told_in_red(jump: Path) -> None:
    log = Trajectory.read(jump / "logs" / "log-1.csv")
    falls = np.clip((log.time - 0.8 * log.time[-1]) * 8.0, 0.0, 1.2)
    fallen = log.with_columns({"body/pitch [rad]": log["body/pitch"] + falls})
    machine = load_machine()
    events = [events_of(Track("a", "log", Source("a", t)), machine) for t in (log, fallen)]
    said = of_logs(list(zip(("log-1", "log-2"), events, strict=True)), None, None, None, WORDS)
    assert (said.grade, said.sentence) == (
        "bad",
        "FAILED: in log-2 the robot tips over (1 of 2 logs).",
    )
    assert 'class="verdict bad"' in said.html()


def test_impossible_logs_still_give_a_page(jump: Path, tmp_path: Path) -> None:
    log = Trajectory.read(jump / "logs" / "log-1.csv")
    log.with_columns({"front/piston/x [m]": 1e3 * log["front/piston/x"]}).write(tmp_path / "mm.csv")
    done = call("review", str(tmp_path / "mm.csv"), "--run", str(jump))
    assert done.exit_code == 1 and "is it in millimetres" in done.stderr
    assert f"kemba-opt check {tmp_path}/mm.csv" in done.stderr
    assert "FAILED: a log cannot be right" in (tmp_path / "review.html").read_text()


def test_without_anything_the_newest_run_is_taken(
    jump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = call("review")
    assert done.exit_code == 2 and "kemba-opt solve jump.yaml" in done.stderr
    shutil.copytree(jump, "runs/jump-1", ignore=shutil.ignore_patterns("review*.html"))
    Path("runs/jump-1/logs/review.html").touch()
    done = call("review")
    assert (
        "the newest run: runs/jump-1\nwith its newest logs: 2 in runs/jump-1/logs\n" in done.stderr
    )
    assert done.stdout == "runs/jump-1/logs/review-2.html\n"
    assert call("review", "--out", "runs/jump-1/logs/review.html").exit_code == 2


def test_the_newest_is_the_one_begun_last(jump: Path, tmp_path: Path) -> None:
    for name, began in (("a", "2030-01-02"), ("b", "2030-01-01")):
        shutil.copytree(jump, tmp_path / name)
        manifest = read_json(tmp_path / name / "manifest.json") | {"started": began}
        (tmp_path / name / "manifest.json").write_text(json.dumps(manifest))
    assert newest_run(folder=tmp_path).name == "a"


ANSWER = {
    "verdict": "missing",
    "sentence": "Missing: seal_friction (F_c = 9 N).",
    "added": ["seal_friction"],
    "error_before": 3.0,
    "error_after": 1.1,
    "model": "model.yaml",
    "ladder": [["model as it is", 3.0], ["seal_friction", 1.1]],
    "ranking": [
        {
            "effect": "seal_friction",
            "probability": 0.98,
            "parameters": {"F_c": {"value": 9.0, "low": 8.0, "high": 10.0, "unit": "N"}},
            "error_after": 1.1,
            "equivalent_to": [],
        }
    ],
}


def test_an_answer_is_a_page_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "answer.json").write_text(json.dumps(ANSWER))
    done = call("review", "--answer", str(tmp_path))
    assert done.exit_code == 0, done.stderr
    text = (tmp_path / "review.html").read_text(encoding="utf-8")
    assert "The model lacks seal_friction; with it the error falls from 3.00 to 1.10" in text
    assert "98.0 %" in text and "F_c = 9 N (8 to 10)" in text and "Ladder" in text
    assert f"kemba-opt solve jump.yaml --model {tmp_path}/model.yaml" in text


def test_a_fault_of_a_sensor_is_not_planned_with() -> None:
    said = of_answer({**ANSWER, "added": ["sensor_bias:body/z"]}, WORDS)
    assert said.next.startswith("correct the sensors") and not said.command


@pytest.mark.parametrize("verdict", ["missing", "partly", "nothing", "unknown"])
def test_what_is_for_the_robot_is_not_advised_for_a_rig(verdict: str) -> None:
    """No jump is planned with its model, and no test of the robot's is designed."""
    said = of_answer({**ANSWER, "verdict": verdict}, {**WORDS, "rig": "log.csv --model a.yaml"})
    found = verdict in ("missing", "partly")
    assert said.command == ("kemba-opt compare log.csv --model a.yaml" if found else "")
    assert "jump" not in said.next


@pytest.mark.parametrize("verdict", ["partly", "nothing", "unknown", "bad-data", "something new"])
def test_every_verdict_gets_a_next_step(verdict: str, tmp_path: Path) -> None:
    answer = {**ANSWER, "verdict": verdict, "excess_before": 2.8, "excess_after": 0.5}
    said = of_answer(answer, WORDS)
    assert said.sentence and said.next
    assert (said.grade == "bad") == (verdict == "bad-data")
    text = "".join(answer_parts(answer, tmp_path, pictures=True))
    assert "2.80 before, 0.50 after" in text


def test_a_formula_is_said_once(tmp_path: Path) -> None:
    answer = {**ANSWER, "verdict": "unknown", "formula": "F = -3*v"}
    for sentence in (
        "Something is missing. A formula that fits: F = -3*v.",
        "Something is missing.",
    ):
        text = "".join(answer_parts({**answer, "sentence": sentence}, tmp_path, pictures=False))
        assert text.count("F = -3*v") == 1


def test_only_with_a_plan_there_is_its_clock() -> None:
    time = np.linspace(0.0, 1.0, 11)
    body = Source("a", Trajectory(time, {"body/z [m]": 0.2 + 0.0 * time}))
    flown = Events(0.5, 0.2)
    for role, said in (("plan", True), ("log", False)):
        assert ("clock" in event_table([Track(role, role, body)], [flown])) is said


def test_a_search_that_the_time_ended_goes_on() -> None:
    said = of_answer({"verdict": "unknown", "remarks": [ENDED]}, WORDS)
    assert said.command == f"kemba-opt discover {WORDS['logs']} --time-limit 900"


@pytest.mark.parametrize("text", ["[]", "{}", '{"verdict": 3}'])
def test_what_is_no_answer_is_told(tmp_path: Path, text: str) -> None:
    (tmp_path / "answer.json").write_text(text)
    done = call("review", "--answer", str(tmp_path))
    assert done.exit_code == 2 and "is no answer" in done.stderr


def test_an_answer_with_gaps_is_shown(tmp_path: Path) -> None:
    (tmp_path / "answer.json").write_text('{"verdict": "nothing", "ranking": [{}]}')
    assert "".join(answer_parts(read_answer(tmp_path), tmp_path, pictures=True))


def test_a_plan_that_asks_too_much_is_told_what_can_be_reached() -> None:
    relax = {"requirement": "height", "asked": 0.9, "reachable": 0.61, "unit": "m"}
    certificate = {"status": "infeasible", "good": False, "sentence": "FAILED: too high; more"}
    said = of_plan({**certificate, "relax": [relax]}, "runs/a", None)
    assert (said.grade, said.sentence) == ("bad", "FAILED: too high.")
    assert "height asks 0.9 m, and 0.61 m can be reached" in said.next


def test_a_plan_that_needs_feedback_says_so() -> None:
    feedback = {"by": "edges", "alone": "the simulated robot tips over"}
    certificate = {"status": "solved", "good": True, "sentence": "solved", "apex_m": 0.5}
    said = of_plan({**certificate, "feedback": feedback}, "runs/a", None)
    assert said.grade == "good" and "with feedback by edges the simulated robot" in said.sentence
    assert said.doubt == "by controller.csv alone the simulated robot tips over."
    assert "policy.npz" in said.next and "simulate runs/a --policy" in said.command


def test_the_motor_gives_less_at_speed() -> None:
    from kemba.effects.mechanics.hip import Motor

    motor = Motor()
    torque = np.array([motor.tau_peak, motor.tau_rated, -motor.tau_rated])
    speed = np.array([0.0, motor.w_rated, motor.w_rated])
    share = motor_share(motor, torque, speed)
    assert share[:2] == pytest.approx([1.0, 1.0])
    assert share[2] == pytest.approx(motor.tau_rated / motor.tau_peak)


def test_air_is_counted_from_what_the_chambers_hold() -> None:
    """From one to seven atmospheres in the dead volume: six times its air."""
    cylinder, time = load_robot("kemba").cylinder, np.linspace(0.0, 0.1, 101)
    filled = np.clip(time / 0.05, 0.0, 1.0)
    columns = {
        "front/piston/x [m]": np.zeros(101),
        "front/chamber/extend/P [Pa]": 101325.0 * (1.0 + 6.0 * filled),
        "front/valve/extend [1]": np.where(time < 0.0995, 1.0, 0.0),
    }
    track = Track("log", "log", Source("log", Trajectory(time, columns)))
    wanted = 6.0 * 101325.0 * cylinder.tube / (287.0 * 293.0)
    assert air_drawn(track, "front", cylinder) == pytest.approx(wanted, rel=1e-6)


def test_the_supply_is_a_share_of_that_at_the_start() -> None:
    """Gauge pressure; an overshoot above the start does not count as the start."""
    time = np.linspace(0.0, 0.1, 101)
    fall = np.interp(time, [0.0, 0.03, 0.05, 0.09, 0.1], [1.0, 1.0, 0.5, 1.1, 1.0])
    gauge = Trajectory(time, {"supply/P [Pa]": 101325.0 + 7e5 * fall})
    share = Trajectory(time, {"supply/line/s [1]": fall})
    for measured in (gauge, share):
        assert supply_share(measured) == pytest.approx(fall)
    assert supply_share(Trajectory(time, {"body/z [m]": time})) is None


@pytest.mark.slow
def test_a_rig_has_its_page_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's bench and a drive of the user's own, with every column they have."""
    monkeypatch.chdir(tmp_path)
    assert call("simulate", "random.yaml", "--noise", "--out", "bench").exit_code == 0
    done = call("review", "bench")
    assert done.exit_code == 0 and done.stdout == "bench/review.html\n", done.stderr
    text = Path("bench/review.html").read_text(encoding="utf-8")
    assert "Force of the piston rod" in text and "Motion in 3-D" not in text
    Path("own.yaml").write_text(
        "rig: {kind: drive, motion: linear, inertia: 95 kg}\neffects: []\n", encoding="utf-8"
    )
    drive_log(tmp_path / "axis.csv")
    done = call("review", "axis.csv", "--model", "own.yaml")
    assert done.exit_code == 0, done.stderr
    assert "kemba-opt discover axis.csv --model own.yaml" in done.stderr
    assert "axis/tau" in Path("review.html").read_text(encoding="utf-8")


def drive_log(path: Path) -> None:
    """95 kg on a drive, with friction that the model lacks."""
    rng, step = np.random.default_rng(0), 0.002
    time = np.arange(0.0, 3.0, step)
    force = 150.0 * np.sin(2 * np.pi * time) + 60.0 * np.sin(9.0 * time)
    place, speed = np.zeros(len(time)), 0.0
    for i in range(1, len(time)):
        speed += step * (force[i] - 40.0 * np.tanh(speed / 0.01)) / 95.0
        place[i] = place[i - 1] + step * speed
    noisy = place + rng.normal(0.0, 1e-5, len(time))
    Trajectory(time, {"axis/q [m]": noisy, "axis/tau [N]": force}).write(path)


def test_heights_of_different_motions_are_no_average() -> None:
    events = [(name, Events(0.3, apex)) for name, apex in (("hop", 0.35), ("jump", 0.501))]
    assert of_logs(events, None, None, None, WORDS).sentence == (
        "The robot's body reaches 0.350 to 0.501 m."
    )
    assert "reaches 0.350 m." in of_logs(events[:1], None, None, None, WORDS).sentence


def test_folders_are_taken_for_what_they_hold(jump: Path, tmp_path: Path) -> None:
    (tmp_path / "answer").mkdir()
    (tmp_path / "answer" / "answer.json").write_text(json.dumps(ANSWER))
    out = tmp_path / "all.html"
    done = call(
        "review", str(jump), str(jump / "logs"), str(tmp_path / "answer"), "--out", str(out)
    )
    assert done.exit_code == 0, done.stderr
    text = out.read_text(encoding="utf-8")
    assert "2 logs" in text and "The robot reaches" in text and "lacks seal_friction" in text


def test_a_page_takes_no_library_that_it_does_not_need() -> None:
    """`scipy.signal` and `scipy.stats` take half a second each."""
    code = (
        "import sys, kemba.report.review;"
        "heavy = {'matplotlib', 'scipy.stats', 'scipy.signal', 'dask', 'pandas', 'numba'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
