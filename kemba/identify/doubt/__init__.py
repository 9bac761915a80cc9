"""Reasons not to believe an answer: left-out data, runs that disagree, unexplained error."""
