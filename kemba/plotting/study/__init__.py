"""Figures of comparisons, discoveries and sweeps."""
