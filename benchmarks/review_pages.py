"""Pictures of the review page for the documentation, as a browser shows it.

    python benchmarks/review_pages.py docs/images

Plans the shipped jump, executes it three times on the plant with noisy sensors, asks what the
planning model lacks, and photographs the page: wide, and as wide as a phone.
"""

import argparse
import io
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright
from typer.testing import CliRunner

from kemba_cli.main import app

SHOTS = {  # name -> width, what is shown, and from which heading on
    "review-top": (1100, 1500, ""),
    "review-model": (1100, 1500, "Where the model fails"),
    "review-phone": (390, 1250, ""),
}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def main() -> None:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    folder: Path = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        page = write(Path(scratch))
        for name, data in photographs(page).items():
            picture = Image.open(io.BytesIO(data)).convert("RGB")
            picture.save(folder / f"{name}.png", optimize=True)


def write(folder: Path) -> Path:
    """The review of a jump, with logs and an answer."""
    run = folder / "jump-1"
    call("solve", "jump.yaml", "--out", str(run), "--no-figure")
    call("simulate", str(run), "--repeat", "3", "--noise")
    logs = sorted(str(log) for log in (run / "logs").glob("*.csv"))
    call("discover", *logs, "--out", str(folder / "answer"), "--no-figure")
    page = folder / "review.html"
    own = ["--run", str(run), "--answer", str(folder / "answer"), "--out", str(page)]
    call("review", *logs, *own)
    text = page.read_text(encoding="utf-8").replace(f"{folder}/", "")  # names as a user has them
    page.write_text(text, encoding="utf-8")
    return page


def photographs(page: Path) -> dict[str, bytes]:
    """PNGs by name."""
    found = {}
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as started:
        opened = started.chromium.launch(executable_path=browser)
        for name, (width, height, heading) in SHOTS.items():
            tab = opened.new_page(viewport={"width": width, "height": 900})
            tab.goto(page.as_uri())
            tab.locator("[data-do=play]").click()
            tab.locator(".stage input").evaluate(
                "(n) => { n.value = 0.6 * n.max; n.dispatchEvent(new Event('input')); }"
            )
            at = tab.get_by_role("heading", name=heading).first if heading else tab.locator("h1")
            top = at.evaluate("(n) => n.getBoundingClientRect().top + scrollY") - 8
            tab.add_style_tag(content=".key { position: static !important; }")
            clip = {"x": 0, "y": max(0, top), "width": width, "height": height}
            found[name] = tab.screenshot(full_page=True, clip=clip)
            tab.close()
        opened.close()
    return found


def call(*words: str) -> None:
    """A command of kemba-opt, which must succeed."""
    done = CliRunner().invoke(app, list(words))
    if done.exit_code:
        raise SystemExit(f"kemba-opt {' '.join(words)} failed:\n{done.output}")


if __name__ == "__main__":
    main()
