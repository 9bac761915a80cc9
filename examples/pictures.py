"""Where the examples put their pictures: `pictures/` here, or the folder KEMBA_PICTURES."""

import os
import sys
from pathlib import Path

from matplotlib.figure import Figure


def save(figure: Figure) -> None:
    """Save the picture of the script that runs, under its name."""
    folder = Path(os.environ.get("KEMBA_PICTURES", "pictures"))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{Path(sys.argv[0]).stem}.png"
    figure.savefig(path, dpi=80)
    print(path)
