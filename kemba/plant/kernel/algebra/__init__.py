"""Small linear systems, complementarity problems and roots, compiled by numba."""
