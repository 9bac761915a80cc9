"""Shipped plans of the shipped robot, from which near tasks begin."""
