"""Plans executed on the plant: controller, replays, repeats, sensors."""
