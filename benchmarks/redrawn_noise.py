"""Does the test of nothing redraw as much noise as there is? Bench logs of a machine as drawn.

    python benchmarks/redrawn_noise.py              # 12 pairs of logs, about a minute of CPU
    python benchmarks/redrawn_noise.py --cases 30

The machine of tests/twin lacks nothing and no figure of it is off, so that what the model leaves of
a log is noise. Along every effect of the catalogue, less what nominal figures can explain: the
power of that noise, and the power of what random signs of its blocks make of it, once from what the
fit of all effects leaves, and once from what a fit to the other blocks leaves. One is the power of
white noise. Means over effects and logs are put into benchmarks/program.json.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import numpy as np
from calibration import LENGTH, NOISES, RUNS
from program import put
from twin.cases import bench_case
from twin.figures import Robot
from twin.measure import Sensors

from kemba.identify.answer import DiscoverSettings
from kemba.identify.infer.linear import time_blocks
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import left_out_noise
from kemba.identify.logs.reading import read_logs
from kemba.identify.problem.problem import Array
from kemba.identify.workflow import admitted, model_of

SEED = 9_000


def powers(seed: int, folder: Path) -> tuple[float, float, float]:
    """Power of the noise of a pair of logs; redrawn from what all blocks leave, and from others."""
    paths, _ = bench_case(
        folder, [], seed=seed, runs=RUNS, duration=LENGTH,
        sensors=Sensors(noise=NOISES[seed % len(NOISES)]), robot=Robot(),
    )  # fmt: skip
    logs = read_logs(paths, None)
    search = Search(admitted(logs, model_of(logs, "planning"))[0])
    search.start()
    base, problem = search.base, search.problem
    mode, jacobian = base.point.mode, base.jacobian
    linear = mode.linear
    left = mode.residual + jacobian @ (linear.best() - linear.at)
    blocks = time_blocks(problem, shortest=DiscoverSettings.fine)
    along = directions(jacobian, base.ranker(linear).nuisance)
    plain = np.stack([jacobian[blocks == b].T @ left[blocks == b] for b in np.unique(blocks)])
    others = left_out_noise(jacobian, left, linear.width, blocks)
    true = (along.T @ (jacobian.T @ problem.residual({}))) ** 2
    redrawn = [np.sum((pieces @ along) ** 2, axis=0) for pieces in (plain, others)]
    return float(true.mean()), float(redrawn[0].mean()), float(redrawn[1].mean())


def directions(jacobian: Array, nuisance: Array) -> Array:
    """Of every effect the combination (k, c) of columns that is its own, with a length of one."""
    found = []
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-30)
    known = jacobian[:, nuisance] / scale[nuisance]
    for i in np.flatnonzero(~nuisance):
        share = np.linalg.lstsq(known, jacobian[:, i], rcond=None)[0]
        length = float(np.linalg.norm(jacobian[:, i] - known @ share))
        if length > 1e-9 * scale[i]:
            one = np.zeros(len(scale))
            one[i], one[nuisance] = 1.0, -share / scale[nuisance]
            found.append(one / length)
    return np.stack(found, axis=1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=12)
    found = []
    for number in range(parser.parse_args().cases):
        with tempfile.TemporaryDirectory() as folder:
            found.append(powers(SEED + number, Path(folder)))
        print(number, *(f"{power:.2f}" for power in found[-1]), flush=True)
    names = ("noise", "redrawn from all", "redrawn from others")
    means = {
        name: round(float(x), 2) for name, x in zip(names, np.mean(found, axis=0), strict=True)
    }
    put("redrawn noise", "as drawn", {"pairs": len(found), **means})
    print(means)
    return 0


if __name__ == "__main__":
    sys.exit(main())
