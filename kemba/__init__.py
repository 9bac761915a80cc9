"""Plan, execute and explain jumps of a legged robot with pneumatic knees.

import kemba
jump = kemba.plan("jump.yaml", height="0.48 m")     # a run folder with a certified plan
done = kemba.simulate(jump, repeat=3, noise=True)   # logs, as on hardware
print(kemba.compare(done.logs).sentence)            # where does the model fail?
print(kemba.discover(done.logs).sentence)           # which effect does it lack?
"""

import os
from importlib import import_module
from typing import Any

__version__ = "0.1.0"
_HOMES = {
    **dict.fromkeys(("adopt", "compare", "discover", "learn"), "api.learning"),
    **dict.fromkeys(("load_log", "load_model", "load_task", "plan", "simulate"), "api.planning"),
    "solve_mpcc": "ocp.mpcc.solve",
}
__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """The library's functions, imported when first asked for: `--help` must not wait for them."""
    if name in _HOMES:
        # many small matrices: more BLAS threads only wait for each other
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        return getattr(import_module(f"kemba.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'kemba' has no attribute '{name}'")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
