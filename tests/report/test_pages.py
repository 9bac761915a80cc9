"""`report`, `view` and `export`: what a run looks like elsewhere."""

import json
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner, Result

from kemba.config import shipped_configs
from kemba.identify.logs.reading import read_log
from kemba.logs import load_map, open_log
from kemba.plotting.source import load_source
from kemba.report.view import scene, script_text, stage
from kemba.trajectory import Trajectory
from kemba_cli.main import app


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that ended early: as quick as one can be, with all its files."""
    folder = tmp_path_factory.mktemp("pages") / "early"
    words = ["jump.yaml", "--set", "nodes=24", "--set", "solver.max_iterations=1", "--no-figure"]
    assert call("solve", *words, "--out", str(folder)).exit_code == 1
    return folder


def call(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


class Page(HTMLParser):
    """Tags, and what a page would fetch from elsewhere."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.fetched: list[str] = []
        self.text = path.read_text(encoding="utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        links = {"src", "href", "xlink:href"}
        self.fetched += [v for k, v in attrs if k in links and v and not v.startswith("#")]


def test_a_report_holds_the_whole_run(run: Path) -> None:
    done = call("report", str(run))
    assert (done.exit_code, done.stdout) == (0, f"{run}/report.html\n")
    page = Page(run / "report.html")
    certificate = json.loads((run / "certificate.json").read_text())
    assert page.fetched == [] and {"svg", "canvas", "table"} <= set(page.tags)
    first = page.text.index('<div class="verdict bad"')
    assert page.text.index("FAILED") - first < 100 and first < page.text.index("<section>")
    assert certificate["sentence"].split(";")[0].replace("'", "&#x27;") in page.text
    assert f"{certificate['apex_m']:.4f} m" in page.text
    assert (run / "task.yaml").read_text().splitlines()[-1].strip() in page.text
    assert "SHA-256" in page.text and "casadi" in page.text


@pytest.mark.parametrize("verb", ["report", "view"])
def test_pages_are_kept(verb: str, run: Path) -> None:
    first = Path(call(verb, str(run)).stdout.strip())
    first.write_text("mine")
    second = Path(call(verb, str(run)).stdout.strip())
    assert second != first and first.read_text() == "mine"
    refused = call(verb, str(run), "--out", str(second))
    assert (
        refused.exit_code == 2 and "exists already; give another name, or --force" in refused.stderr
    )
    assert call(verb, str(run), "--out", str(first), "--force").exit_code == 0
    assert first.read_text() != "mine"


def test_a_report_needs_a_run(tmp_path: Path) -> None:
    done = call("report", str(tmp_path))
    assert done.exit_code == 2 and "is not a run folder" in done.stderr


def test_a_view_needs_nothing_else(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "seen" / "motion.html"
    done = call("view", str(run), "--out", str(out), "--json")
    assert json.loads(done.stdout) == {"view": str(out)}
    page = Page(out)
    assert page.fetched == [] and {"canvas", "input", "button", "script"} <= set(page.tags)
    bench = Trajectory(np.arange(3.0), {"piston/x [m]": np.zeros(3)}, {"kind": "bench"})
    bench.write(tmp_path / "bench.csv")
    refused = call("view", str(tmp_path / "bench.csv"))
    assert refused.exit_code == 2 and "cannot be shown" in refused.stderr


def test_the_scene_is_the_robot(run: Path) -> None:
    shown, plan = scene(load_source(run)), Trajectory.read(run / "trajectory.csv")
    (robot,) = shown["motions"]
    hip, knee = (np.array(robot["points"][f"front/{name}"]) for name in ("hip", "knee"))
    assert np.hypot(*(knee - hip).T) == pytest.approx(0.242, abs=2e-4)
    assert np.array(robot["centres"])[-1, 1] == pytest.approx(plan["body/z"][-1], abs=1e-4)
    assert (shown["time"][0], shown["time"][-1]) == (0.0, pytest.approx(plan.time[-1], abs=1e-4))
    assert set(robot["valves"]["rear"]) <= {"00", "01", "10", "11"}


@pytest.mark.parametrize("ending", ["mat", "npz", "json", "csv"])
def test_every_format_holds_the_columns(run: Path, tmp_path: Path, ending: str) -> None:
    out, plan = tmp_path / f"plan.{ending}", Trajectory.read(run / "trajectory.csv")
    assert call("export", str(run), "--out", str(out)).stdout == f"{out}\n"
    wanted = plan["front/hip/tau"]
    if ending == "mat":
        found = loadmat(out, simplify_cells=True)
        assert found["units"]["front_hip_tau"] == "N.m"
        np.testing.assert_array_equal(found["front_hip_tau"], wanted)
    elif ending == "npz":
        np.testing.assert_array_equal(np.load(out)["front/hip/tau"], wanted)
    elif ending == "json":
        columns = json.loads(out.read_text())["columns"]
        assert columns["front/hip/tau [N.m]"] == wanted.tolist()
        assert columns["time [s]"] == plan.time.tolist()
    else:
        np.testing.assert_array_equal(Trajectory.read(out)["front/hip/tau"], wanted)


def test_another_programs_columns_come_back(run: Path, tmp_path: Path) -> None:
    """Written through a map and read through it again, lag and units included."""
    text = shipped_configs("maps")["authors.yaml"].read_text()
    text = text.replace("{source: tm_f}", "{source: tm_f, sign: -1, scale: 0.5, unit: N.mm}")
    text = text.replace("{source: r}", "{source: r, delay: 2.0e-3}")
    (tmp_path / "other.yaml").write_text(text)
    columns, plan = load_map(tmp_path / "other.yaml"), Trajectory.read(run / "trajectory.csv")
    out = tmp_path / "foreign.csv"
    words = ("export", str(run), "--out", str(out), "--map", str(tmp_path / "other.yaml"))
    assert call(*words).exit_code == 0
    again = read_log(out, columns)
    np.testing.assert_allclose(again["front/hip/tau"], plan["front/hip/tau"], atol=1e-12)
    np.testing.assert_allclose(again["rear/hip/q"], plan["rear/hip/q"], atol=1e-12)
    lag = np.gradient(plan["body/pitch"], plan.time)
    assert np.abs(again["body/pitch"] - plan["body/pitch"]).max() <= 4e-3 * np.abs(lag).max() + 1e-9
    figure = tmp_path / "foreign.png"
    drawn = ("plot", str(out), "--map", str(tmp_path / "other.yaml"), "--save", str(figure))
    assert call(*drawn).exit_code == 0 and figure.is_file()
    back = tmp_path / "back.npz"
    given = ("export", str(out), "--source-map", str(tmp_path / "other.yaml"), "--out", str(back))
    assert call(*given).exit_code == 0
    np.testing.assert_allclose(open_log(back)["rear/hip/q"], plan["rear/hip/q"], atol=1e-12)
    page = tmp_path / "foreign.html"
    seen = call("view", str(out), "--map", str(tmp_path / "other.yaml"), "--out", str(page))
    assert seen.exit_code == 0 and "<canvas" in page.read_text(), seen.output


def test_wrong_endings_are_told(run: Path, tmp_path: Path) -> None:
    done = call("export", str(run), "--out", str(tmp_path / "plan.xls"))
    assert done.exit_code == 2
    assert (
        "no format '.xls'; a name ending in .csv, .parquet, .mcap, .mat, .npz or .json was"
        in done.stderr
    )
    done = call("export", str(run), "--out", str(tmp_path / "a.mat"), "--map", "authors.yaml")
    assert done.exit_code == 2 and "goes with .csv only" in done.stderr


def test_no_name_ends_the_script(run: Path, tmp_path: Path) -> None:
    text = script_text({"legs": ["a</script><script>alert(1)"]})
    assert text == '{"legs":["a\\u003c/script>\\u003cscript>alert(1)"]}'
    motion = tmp_path / "a<script>alert(1)<!--.csv"
    shutil.copy(run / "trajectory.csv", motion)
    page = stage(load_source(motion), "planning")
    assert page.count("<script") == page.count("</script") == 1 and "<!--" not in page
