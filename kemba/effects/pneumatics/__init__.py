"""Air: chambers, valves, hoses, supply (paper, eq. 1-8)."""
