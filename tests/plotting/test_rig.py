"""The paper's figures of the bench rigs, from simulated data sets."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from kemba.errors import KembaError
from kemba.plant.rigs import DynamometerRig, LockedRig, RandomRig, Rig, bench_model, run_rig
from kemba.plotting import plot_rig
from kemba.trajectory import Trajectory
from kemba_cli.main import app


def logs(rig: Rig, model: str = "planning") -> dict[str, Trajectory]:
    return dict(run_rig(rig, lambda supply: bench_model(model, supply)))


def texts(figure: Figure) -> str:
    return " ".join(text.get_text() for axes in figure.axes for text in axes.texts)


def test_locked_chamber_with_its_first_order_answer() -> None:
    """Fig. 3: two states, every test, and a dashed fit that lies on first-order data."""
    figure = plot_rig(logs(LockedRig(name="locked", supplies=(0.6e6, 0.8e6))))
    filling, venting = figure.axes
    assert (filling.get_title("left"), venting.get_title("left")) == ("filling", "venting")
    solid = [
        line for line in filling.lines if line.get_linestyle() == "-" and len(line.get_xdata())
    ]
    dashed = [line for line in filling.lines if line.get_linestyle() == "--"]
    assert (len(solid) - 1, len(dashed)) == (4, 2)  # and the line at the command
    fit = np.interp(30.0, dashed[0].get_xdata(), dashed[0].get_ydata())
    test = next(line for line in solid if len(line.get_xdata()) > 2)
    assert np.interp(30.0, test.get_xdata(), test.get_ydata()) == pytest.approx(fit, abs=0.01)
    assert "0 mm: 8.0 ms" in texts(figure) and "70 mm: 37.0 ms" in texts(figure)


def test_five_volumes_show_a_straight_line() -> None:
    """Fig. 4: rise times grow linearly with the volume."""
    figure = plot_rig(logs(LockedRig(name="volumes", positions=(0.0, 0.02, 0.035, 0.05, 0.07))))
    *_, right = figure.axes
    assert right.get_legend_handles_labels()[1] == ["filling, R² 1.000", "venting, R² 1.000"]
    assert len(right.lines[0].get_xdata()) == 5


def test_force_over_speed_in_every_mode() -> None:
    """Fig. 6, at the nominal supply."""
    speeds = dict.fromkeys(("extend", "retract", "both", "none"), (0.4, 0.8))
    rig = DynamometerRig(name="dynamometer", speeds=speeds, supplies=(0.6e6, 0.7e6))
    figure = plot_rig(logs(rig))
    assert figure.axes[0].get_legend_handles_labels()[1] == ["extend", "retract", "both", "none"]
    assert "324 - 97 v" in texts(figure) and "-260 - 84 v" in texts(figure)


def test_random_motion_beside_the_approximate_model() -> None:
    """Fig. 7: fit told and drawn; a model predicts itself."""
    rig = RandomRig(name="random", duration=1.0)
    itself = plot_rig(logs(rig)).axes[0]
    assert itself.get_title("left") == "R² 1.000, RMS 0.0 N"
    top, bottom = plot_rig(logs(rig, "plant")).axes
    assert [label.get_text() for label in bottom.get_yticklabels()] == ["retract", "extend"]
    r2 = float(top.get_title("left").split()[1].rstrip(","))
    assert 0.9 < r2 < 1.0
    assert top.get_legend_handles_labels()[1][1] == "approximate model"


def test_what_is_no_data_set_is_told() -> None:
    locked = logs(LockedRig(name="a", supplies=(0.7e6,), positions=(0.0,)))
    moving = logs(DynamometerRig(name="b", speeds={"extend": (0.5,)}))
    with pytest.raises(KembaError, match="logs of several rigs cannot share a figure"):
        plot_rig(locked | moving)
    still = next(iter(locked.values())).with_columns({"valve/extend [1]": np.zeros(701)})
    with pytest.raises(KembaError, match="shows no test of a known rig"):
        plot_rig({"still": still.with_columns({"piston/F [N]": np.zeros(701)})})


def test_from_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> str:
        done = CliRunner().invoke(app, [*words])
        assert done.exit_code == 0, done.output
        return done.stdout

    Path("short.yaml").write_text("rig: {kind: locked, name: short, duration: 0.3 s}\n")
    Path("chance.yaml").write_text("rig: {kind: random, name: chance, duration: 0.5 s}\n")
    for name in ("short", "chance"):
        run("simulate", f"{name}.yaml", "--model", "planning")
        assert run("plot", f"bench/{name}") == f"bench/{name}/figure.png\n"
        assert Path(f"bench/{name}/figure.png").is_file()
    shown = run("characterise", "bench/short", "bench/chance", "--figures", "drawn")
    assert "Fitted model against logs" in shown and "RMS N" in shown
    assert {path.name for path in Path("drawn").iterdir()} == {"short.png", "chance.png"}
