"""Compare with measurements, find the missing physics."""
