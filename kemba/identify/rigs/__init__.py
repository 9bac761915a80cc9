"""Logs of the user's own rigs as whitened residuals: cylinder and drive, vessel."""
