"""Figures of a robot's motion."""
