"""Where the model fails on the logs, and what it lacks."""
