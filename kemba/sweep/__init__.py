"""Sweeps: many tasks to plan, or many executions of one plan, on Dask."""

from kemba.sweep.cases import Case, Sweep, load_sweep
from kemba.sweep.execution import expand
from kemba.sweep.farm import check_scheduler, machine, run_cases
from kemba.sweep.results import open_folder, write_results

__all__ = [
    "Case",
    "Sweep",
    "check_scheduler",
    "expand",
    "load_sweep",
    "machine",
    "open_folder",
    "run_cases",
    "write_results",
]
