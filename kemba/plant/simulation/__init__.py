"""From initial values and commands to a simulated trajectory."""
