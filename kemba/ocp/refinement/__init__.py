"""Plans that replay: the modes of an implicit Euler plan solved again as smooth phases."""

from kemba.ocp.refinement.refine import Refined, refine

__all__ = ["Refined", "refine"]
