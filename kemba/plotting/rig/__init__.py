"""Figures of bench logs and rigs."""
