"""What every result can do: say its sentence, draw its figure, show both in a notebook."""

from __future__ import annotations

import base64
import html
import io
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from kemba.errors import KembaError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Result(ABC):
    """An answer with a sentence, a verdict and a figure."""

    @property
    @abstractmethod
    def sentence(self) -> str:
        """The answer in words, as the command prints it."""

    @property
    @abstractmethod
    def good(self) -> bool:
        """Whether the command would exit with 0."""

    @abstractmethod
    def figure(self) -> Figure:
        """The answer drawn. Raises KembaError where there is nothing to draw."""

    def __str__(self) -> str:
        return self.sentence

    def _repr_html_(self) -> str:
        """Sentence and figure, for notebooks."""
        colour = "#1a7f37" if self.good else "#b42318"
        text = f'<p style="color:{colour}">{html.escape(self.sentence)}</p>'
        buffer = io.BytesIO()
        try:
            self.figure().savefig(buffer, format="png", dpi=100)
        except KembaError:  # nothing to draw
            return text
        data = base64.b64encode(buffer.getvalue()).decode()
        return f'{text}<img alt="{html.escape(self.sentence)}" src="data:image/png;base64,{data}">'
