"""Machines that differ from their model as a discovery believes that they do.

Its test of nothing draws such machines too: nominal figures off within the tolerances that the
model declares, and every effect of the catalogue and every sensor fault there with the small share
of its size that the spike allows. The machine here is the twin of tests/twin: other code, and not
linearised.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from twin import figures
from twin.catalogue import CATALOGUE, hidden
from twin.figures import Robot
from twin.measure import Sensors, fault_channels, sensor_fault

from kemba.identify.infer.linear import SpikeSlabSettings
from kemba.identify.problem.candidates import effect_candidates, nominal_figures, sensor_candidates
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


def robot(seed: int) -> Robot:
    """A robot whose nominal figures are off as its model declares."""
    rng, nominal = np.random.default_rng([seed, 11]), Robot()
    share, air = rng.choice(SpikeSlabSettings.tolerances), nominal.air.copy()
    for name, (_, tolerance) in nominal_figures(load_model(rig=True)).items():
        air[:, COLUMN[name]] *= 1.0 + share * tolerance * rng.standard_normal()
    return replace(nominal, air=air)


def small_effects(
    seed: int, sensors: Sensors, times: bool, except_for: str | None = None
) -> list[dict[str, Any]]:
    """Every effect and sensor fault with a small share of its size, as `bench_case` takes them;
    delays and lags among them only with `times`."""
    rng, model = np.random.default_rng([seed, 12]), load_model(rig=True)
    noise = {channel: sensors.spread(channel) for channel in fault_channels("bench")}
    candidates = effect_candidates(model) | sensor_candidates(noise, model)
    spike = SpikeSlabSettings.spike
    wanted = [c for c in candidates.values() if times or c.lead.unit != "s"]
    found = [_small(c, spike * rng.standard_normal()) for c in wanted]
    return [effect for effect in found if effect and effect["kind"] != except_for]


def _small(candidate: Candidate, size: float) -> dict[str, Any] | None:
    """An effect of so many sizes; None where it is none."""
    lead = candidate.lead
    step = lead.size * (size if lead.signed else abs(size))
    if candidate.sensor:
        return sensor_fault(candidate.effect, **{lead.name: lead.off + step})
    if CATALOGUE[candidate.effect].unit[lead.name] == "s" and not lead.signed and step < STIFF:
        return None
    return hidden(candidate.effect, **{lead.name: lead.off + step})
