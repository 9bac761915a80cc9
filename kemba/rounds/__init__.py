"""Learning from executions: one round from logs of a run to the next run."""
