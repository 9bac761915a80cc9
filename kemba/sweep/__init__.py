"""Sweeps: many tasks to plan, or many executions of one plan, on Dask."""

from kemba.sweep.cases.blocks import expand
from kemba.sweep.cases.case import Case
from kemba.sweep.cases.expand import load_sweep
from kemba.sweep.cases.schema import Sweep
from kemba.sweep.table.results import open_folder, write_results
from kemba.sweep.workers.farm import check_scheduler, run_cases
from kemba.sweep.workers.machine import machine

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
