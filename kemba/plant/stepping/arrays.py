"""The type of arrays of numbers or of truth values."""

from typing import Any

from numpy.typing import NDArray

Array = NDArray[Any]
