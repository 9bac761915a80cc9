"""Windows, for those who asked for one; everything else is drawn without pyplot."""

from __future__ import annotations

from matplotlib.figure import Figure

from kemba.errors import KembaError


def open_window() -> Figure:
    """An empty figure that `show_windows` will show. Raises KembaError without a display."""
    from matplotlib import pyplot

    figure = pyplot.figure()  # settles the backend: Agg where there is no display
    if figure.canvas.required_interactive_framework is None:
        pyplot.close(figure)
        hint = "leave --show out and open the saved picture"
        raise KembaError("--show", "there is no display for a window", hint=hint)
    return figure


def show_windows() -> None:
    """Show the windows and wait until they are closed."""
    from matplotlib import pyplot

    pyplot.show()
