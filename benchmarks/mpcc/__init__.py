"""Programs with complementarity pairs from the literature, and kemba's schedule on them."""
