"""A robot model along measured motion: forces, air, linearisation."""
