"""Structures that a search may build in: their parameters are found by the name of their kind."""

from kemba.identify.problem.candidates import LINE, LineResistance, line_candidates
from kemba.model import Model, load_model


def test_the_supply_line_of_a_search_has_the_parameters_of_its_candidate() -> None:
    """It is looked for where chambers publish their flow and no line is there yet."""
    plant = load_model("plant")
    assert not line_candidates(plant)
    effects = [effect for effect in plant.effects if effect.kind != LINE]
    bare = Model(plant.mechanism, effects, plant.supply, plant.name)
    candidate = line_candidates(bare)[LINE]
    assert set(candidate.keys()) <= set(bare.with_effects([LineResistance()]).parameters)
