"""Scenarios: what may differ from one execution to the next, and how often a plan succeeds."""
