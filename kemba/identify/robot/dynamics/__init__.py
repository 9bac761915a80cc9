"""A robot model along measured motion: forces, air, tolerances, linearisation."""
