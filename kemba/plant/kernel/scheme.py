"""The numbers of the integration scheme, see `step`."""

GAMMA = 1.0 - 0.5**0.5  # of ROS2: L-stable
PULL_BACK = 0.2  # share of a gap's drift that one step removes
SHORTEST = 1e-5  # s; pulling back within less would turn rounding into speed
FASTEST = 0.05  # m/s; a foot that starts below the ground comes out no faster
