"""The noise of the logs: its colour, and how much of it a fit took for effects."""
