"""Plans that replay: the modes of an implicit Euler plan solved again as smooth phases."""

from kemba.ocp.refinement.refine import Order, Refined, order_of, refine

__all__ = ["Order", "Refined", "order_of", "refine"]
