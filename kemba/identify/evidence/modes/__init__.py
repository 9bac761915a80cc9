"""Where a hypothesis fits best: with a little of all other effects, and within all bounds."""
