"""Plan, execute and explain jumps of a legged robot with pneumatic knees."""

__version__ = "0.1.0"
