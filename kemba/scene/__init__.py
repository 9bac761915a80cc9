"""What the robot moves in: the ground, its friction, and obstacles."""

from kemba.scene.scene import FLAT, POINTS, Ground, Obstacle, Scene, scene_in
from kemba.scene.terrain import AnyTerrain

__all__ = ["FLAT", "POINTS", "AnyTerrain", "Ground", "Obstacle", "Scene", "scene_in"]
