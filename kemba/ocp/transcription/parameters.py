"""The parameters of a transcription's program, as a schedule sets them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameters:
    """What one solve of a schedule sets.

    `eps`: relaxation of the pairs (body weights times metres or m/s). Weights in the cost:
    `valve` of u(1 - u) and `switching` of squared changes of u (both per node of the grid's mean),
    `pairs` of every pair's product, `forces` of squared scaled forces, `proximal` of half the
    squared distance from the start (scaled variables; not a parameter of the program itself).
    """

    eps: float
    valve: float = 0.0
    switching: float = 0.0
    pairs: float = 0.0
    forces: float = 0.0
    proximal: float = 0.0

    def vector(self, nodes: int) -> list[float]:
        """The program's parameters p (5,) on a grid of `nodes`."""
        return [self.eps, self.valve / nodes, self.switching / nodes, self.pairs, self.forces]
