"""Everything that is not air: rods, hips, body, boom, ground."""
