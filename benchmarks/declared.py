"""Machines drawn from what a discovery believes of machines in which nothing is missing.

Its test of nothing draws such machines too: nominal figures off within the tolerances that the
model declares, every effect of the catalogue and every sensor fault there with the small share of
its size that the spike allows. The machine here is the twin of tests/twin: other code, not
linearised.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from twin import figures
from twin.catalogue import CATALOGUE, hidden
from twin.figures import Robot
from twin.measure import Sensors, fault_channels, sensor_fault

from kemba.identify.evidence.spike_slab import SpikeSlabSettings
from kemba.identify.problem.candidates import effect_candidates, sensor_candidates
from kemba.identify.problem.nominal import nominal_figures
from kemba.identify.problem.problem import Candidate
from kemba.model.spec import load_model

COLUMN = {  # of the twin's table of figures, by nominal figure of the rig's model
    "chamber.F_extend": figures.N_FE,
    "chamber.F_retract": figures.N_FR,
    "chamber.fill[0]": figures.N_TF0,
    "chamber.fill[1]": figures.N_TF1,
    "chamber.vent[0]": figures.N_TV0,
    "chamber.vent[1]": figures.N_TV1,
    "mode_damping.c_none": figures.N_C00,
    "mode_damping.c_extend": figures.N_C10,
    "mode_damping.c_retract": figures.N_C01,
    "mode_damping.c_both": figures.N_C11,
}
STIFF = 1e-4  # s; a lag shorter than this is none: the twin cannot integrate it


def machine(seed: int, sensors: Sensors) -> tuple[Robot, list[dict[str, Any]]]:
    """A robot and its small effects, sensor faults among them, as `bench_case` takes them."""
    rng, prior = np.random.default_rng([seed, 11]), SpikeSlabSettings.current()
    model = load_model(rig=True)
    share, robot = rng.choice(prior.tolerances), Robot()
    air = robot.air.copy()
    for name, (_, tolerance) in nominal_figures(model).items():
        air[:, COLUMN[name]] *= 1.0 + share * tolerance * rng.standard_normal()
    noise = {channel: sensors.spread(channel) for channel in fault_channels("bench")}
    candidates = effect_candidates(model) | sensor_candidates(noise, model)
    small = [_small(candidate, prior.spike * rng.standard_normal()) for candidate in
             candidates.values()]  # fmt: skip
    return replace(robot, air=air), [effect for effect in small if effect]


def _small(candidate: Candidate, size: float) -> dict[str, Any] | None:
    """An effect of so many sizes; None where it is none."""
    lead = candidate.lead
    step = lead.size * (size if lead.signed else abs(size))
    if candidate.sensor:
        return sensor_fault(candidate.effect, **{lead.name: lead.off + step})
    if CATALOGUE[candidate.effect].unit[lead.name] == "s" and not lead.signed and step < STIFF:
        return None
    return hidden(candidate.effect, **{lead.name: lead.off + step})
