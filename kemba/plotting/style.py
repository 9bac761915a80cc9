"""How figures look: paper width, readable type, colours for colour-blind readers too."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kemba.errors import KembaError
from kemba.files import atomic_path

WIDTH = 7.0  # in, both columns of a paper
DPI = 200  # of a PNG

# Okabe and Ito's palette without its yellow, which is lost on white
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000",
)  # fmt: skip
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
INK, GREY, SHADE = "#333333", "#8C8C8C", "#EBEBEB"
DASHES = (0, (3.2, 1.4))
FORMATS = ("png", "pdf", "svg")

RC: Any = {
    "font.family": "sans-serif",
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "legend.columnspacing": 1.2,
    "legend.borderaxespad": 0.1,
    "lines.linewidth": 1.1,
    "lines.solid_capstyle": "round",
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#D9D9D9",
    "grid.linewidth": 0.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.03,
    "figure.constrained_layout.hspace": 0.0,
    "figure.constrained_layout.wspace": 0.02,
}

paper_style = matplotlib.rc_context(RC)  # a decorator: every call runs under these settings


def colour(index: int) -> str:
    """The colour of the run `index`; they repeat after seven."""
    return COLOURS[index % len(COLOURS)]


def paper_figure(height: float, width: float = WIDTH, figure: Figure | None = None) -> Figure:
    """An empty figure [in], or `figure` (one that pyplot can show) resized."""
    figure = figure or Figure()
    figure.set_size_inches(width, height)
    figure.set_layout_engine("constrained")
    return figure


def figure_name(path: str | Path) -> Path:
    """`path`, whose ending is a format of figures. Raises KembaError where it is not."""
    path = Path(path)
    if path.suffix.lstrip(".").lower() not in FORMATS:
        what = f"no figure format '{path.suffix}'" if path.suffix else "has no ending"
        raise KembaError(str(path), what, "a name ending in .png, .pdf or .svg was expected")
    return path


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG, PDF or SVG by the ending of `path`. Raises KembaError."""
    path = figure_name(path)
    with atomic_path(path) as temporary, matplotlib.rc_context(RC):
        if path.suffix.lower() == ".png":
            _lay_out(figure)
        figure.savefig(temporary, dpi=DPI, facecolor="white")
    return path


def _lay_out(figure: Figure) -> None:
    """Arrange the panels now and for good: `savefig` draws everything twice to do so."""
    engine = figure.get_layout_engine()
    if engine is not None:
        before, figure.dpi = figure.dpi, DPI
        engine.execute(figure)
        figure.set_layout_engine("none")
        figure.dpi = before


def svg_text(figure: Figure) -> str:
    """The figure as an `<svg>` element that fills the width it is given."""
    picture = io.StringIO()
    with matplotlib.rc_context(RC):
        figure.savefig(picture, format="svg")
    text = picture.getvalue()
    start = text.index("<svg")
    end = text.index(">", start)
    return re.sub(r' (?:width|height)="[^"]*"', "", text[start:end]) + text[end:]


def key_above(axes: Axes, columns: int = 4) -> None:
    """The legend of the labelled artists, right above the axes where it hides no data."""
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns)
