"""Scenarios: one plan under what may differ from one execution to the next."""
