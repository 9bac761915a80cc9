"""Measured logs: reading, checking, thinning."""
