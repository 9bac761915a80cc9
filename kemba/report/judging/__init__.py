"""Plans executed on their own model and on the plant, judged, and made again for the plant."""
