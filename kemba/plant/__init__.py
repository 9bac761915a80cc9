"""The plant: fine simulation of a model with hard contact, controller, rigs and sensors."""
