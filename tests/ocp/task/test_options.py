"""IPOPT's options are accepted within what IPOPT itself documents, ends of a range included."""

from typing import Any

import pytest

from kemba.config import Document
from kemba.ocp.task.resolve import option_errors


@pytest.mark.parametrize(
    ("name", "accepted", "refused"),
    [
        ("mu_linear_decrease_factor", (0.5,), (0.0, 1.0, 1.5)),
        ("max_iter", (0, 3000), (-1, 2.5, True)),
        ("max_soc", (0,), (-1,)),
        ("tol", (1e-9,), (0.0, -1.0)),
        ("mu_strategy", ("adaptive", "monotone"), ("adaptiv", 1)),
        ("linear_solver", ("mumps",), ("ma97",)),
        ("output_file", (), ("log.txt",)),
    ],
)
def test_values_are_accepted_as_documented(
    name: str, accepted: tuple[Any, ...], refused: tuple[Any, ...]
) -> None:
    document = Document({}, "task.yaml")
    for value in accepted:
        assert not option_errors({name: value}, document), value
    for value in refused:
        (error,) = option_errors({name: value}, document)
        assert f"solver.options.{name}" in str(error) or f"unknown option '{name}'" in str(error)
