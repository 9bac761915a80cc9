"""Where the examples put their pictures: `pictures/` here, or the folder KEMBA_PICTURES."""

import os
import sys
from pathlib import Path

from matplotlib.figure import Figure

from kemba.plotting.source import load_machine, load_source
from kemba.plotting.sticks import save_animation


def save(figure: Figure) -> None:
    """Save the picture of the script that runs, under its name."""
    path = _named(".png")
    figure.savefig(path, dpi=80)
    print(path)


def animate(run: Path) -> None:
    """Save the motion of a run as a GIF, under the name of the script that runs."""
    print(save_animation(load_source(run), load_machine("planning"), _named(".gif")))


def _named(ending: str) -> Path:
    folder = Path(os.environ.get("KEMBA_PICTURES", "pictures"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{Path(sys.argv[0]).stem}{ending}"
