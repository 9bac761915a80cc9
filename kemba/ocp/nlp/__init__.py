"""Nonlinear programs with exact sparse derivatives, and IPOPT that solves them."""
