"""What the robot moves in: the ground, its friction, and obstacles."""

from kemba.scene.scene import FLAT, POINTS, AnyTerrain, Ground, Obstacle, Scene, scene_in

__all__ = ["FLAT", "POINTS", "AnyTerrain", "Ground", "Obstacle", "Scene", "scene_in"]
