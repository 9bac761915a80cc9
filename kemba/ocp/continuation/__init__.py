"""A plan for changed figures from the plan of an earlier run, on its own phases."""
