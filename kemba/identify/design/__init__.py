"""The next experiment: standard tests, and tests designed for the rivals of one answer."""
