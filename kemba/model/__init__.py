"""Mechanism and effects become one residual with complementarity pairs."""

from kemba.model.model import SUPPLY, Model
from kemba.model.node import Node, Row
from kemba.model.spec import ModelSpec, build_model, load_model, load_spec

__all__ = [
    "SUPPLY",
    "Model",
    "ModelSpec",
    "Node",
    "Row",
    "build_model",
    "load_model",
    "load_spec",
]
