"""Steps as long as the motion allows."""

import subprocess
import sys

import numpy as np
from plant.scripts import drop, jump, planning

from kemba.events import peak
from kemba.model import load_model
from kemba.plant.simulate import run


def test_chosen_steps_are_as_exact_as_short_ones() -> None:
    for motion, model in ((jump, None), (drop, None), (jump, load_model("plant"))):
        chosen = motion(model, step=None).trajectory
        short = motion(model, step=2.5e-5).trajectory
        high = peak(chosen.time, chosen["body/z"])[1], peak(short.time, short["body/z"])[1]
        assert abs(high[0] - high[1]) < 2e-5
        assert np.abs(chosen["body/z"] - short["body/z"]).max() < 1e-4


def test_touchdowns_of_chosen_steps_are_in_time() -> None:
    chosen, short = drop(step=None).impacts[0], drop(step=2.5e-5).impacts[0]
    assert chosen.labels == short.labels
    assert abs(chosen.time - short.time) < 1e-6


def test_the_kernel_is_compiled_once_for_every_model() -> None:
    """Other models, controllers and sizes are numbers to it, not types."""
    from kemba.plant.kernel.play import play

    run(planning(), {}, None, 0.01)
    run(load_model("plant"), {}, None, 0.01, sample=np.array([0.0, 0.01]))
    jump(duration=0.05)
    assert len(play.__dict__["dispatcher"].overloads) == 1


def test_planning_does_not_import_the_compiler() -> None:
    code = "import sys, kemba.plant, kemba.report.solving; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
