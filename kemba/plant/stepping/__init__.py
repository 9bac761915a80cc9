"""One step of the plant: equations, contact forces, impacts."""
