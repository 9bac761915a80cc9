"""Sweeps: many tasks to plan, or many executions of one plan, on Dask."""

from kemba.sweep.blocks import expand
from kemba.sweep.case import Case
from kemba.sweep.expand import load_sweep
from kemba.sweep.farm import check_scheduler, run_cases
from kemba.sweep.machine import machine
from kemba.sweep.results import open_folder, write_results
from kemba.sweep.schema import Sweep

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
