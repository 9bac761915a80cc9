"""Motions by name and seed.  Planning one takes seconds, so each is kept on disk once made."""

import os
from functools import lru_cache
from pathlib import Path

import numpy as np

from .jit import kept
from .motions import MOTIONS, sane
from .run import simulate
from .scripts import Script, Start

TILT = 0.35  # rad; more than this in the nominal run and the plan is thrown away


@lru_cache(maxsize=64)
def motion(name: str, seed: int, rate: float = 1000.0, jitter: float = 0.0) -> Script:
    """A motion that the nominal robot survives when it runs open loop; redrawn until it does."""
    path = kept("motions") / f"{name}-{seed}-{rate:g}-{jitter:g}.npz"
    if path.exists():
        return _load(path)
    for attempt in range(20):
        rng = np.random.default_rng([seed, attempt, sum(name.encode())])
        draft = MOTIONS[name](rng, rate=rate, jitter=jitter)
        truth = simulate(draft)
        if sane(truth) and np.abs(truth.y[:, 2]).max() < TILT:
            _save(path, draft)
            return draft
    raise RuntimeError(f"{name} {seed}: no draw kept its feet")


def _save(path: Path, motion: Script) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_suffix(f".{os.getpid()}.npz")
    start = motion.start
    pose = [start.x, start.z, start.pitch, *start.hips, *start.pistons, *start.rates]
    np.savez(
        scratch, name=motion.name, ticks=motion.ticks, refs=motion.refs, sent=motion.sent, pose=pose
    )
    scratch.replace(path)


def _load(path: Path) -> Script:
    with np.load(path) as data:
        p = [float(v) for v in data["pose"]]
        start = Start(p[0], p[1], p[2], (p[3], p[4]), (p[5], p[6]), tuple(p[7:]))
        return Script(str(data["name"]), data["ticks"], data["refs"], data["sent"], start)
