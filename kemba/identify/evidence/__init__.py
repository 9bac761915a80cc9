"""Which effects explain the data: linearised evidence, refits, search, bootstrap."""
