"""Identification from bench logs: x(t) is imposed, the force is the answer."""
