"""The strategy that finds a plan: relaxed pairs, rounded valves, tightened pairs."""
