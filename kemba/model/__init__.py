"""Mechanism and effects become one residual with complementarity pairs."""

from kemba.model.evidence import Evidence
from kemba.model.model import SUPPLY, Model, Node, Row
from kemba.model.spec import ModelSpec, build_model, load_model, load_spec, read_covariance

__all__ = [
    "SUPPLY",
    "Evidence",
    "Model",
    "ModelSpec",
    "Node",
    "Row",
    "build_model",
    "load_model",
    "load_spec",
    "read_covariance",
]
