"""Real measured data of others: what the tool says of them, untuned."""
