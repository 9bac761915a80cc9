"""Results of all cases as tables and sentences."""
