"""Programs with complementarity pairs: 0 <= G, 0 <= H, G H = 0."""
