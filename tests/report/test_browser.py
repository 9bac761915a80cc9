"""Pages in a real browser: nothing is fetched, nothing fails, keyboard, paper and phone work."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from kemba_cli.main import app

pytestmark = pytest.mark.slow

SIZES = {"desk": {"width": 1200, "height": 900}, "phone": {"width": 390, "height": 844}}
KINDS = ("review", "report", "view", "answer")
AA = 4.5  # least contrast of text (WCAG 2.1, 1.4.3)

CONTRASTS = """() => {
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const numbers = (text) => (text.match(/[\\d.]+/g) || [0, 0, 0, 0]).map(Number);
  const behind = (node) => {
    for (let n = node; n; n = n.parentElement) {
      const c = numbers(getComputedStyle(n).backgroundColor);
      if (c.length === 3 || c[3] > 0.99) return c;
    }
    return [255, 255, 255];
  };
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text = walker.nextNode(); text; text = walker.nextNode()) {
    const node = text.parentElement;
    if (!text.data.trim() || ["SCRIPT", "STYLE"].includes(node.tagName)) continue;
    const style = getComputedStyle(node);
    const ink = node.closest("svg") ? style.fill : style.color;
    const [a, b] = [light(numbers(ink)), light(behind(node))];
    found.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), text.data.trim().slice(0, 40)]);
  }
  return found;
}"""


@dataclass
class Opened:
    """A page that is open, and what went wrong or out of it."""

    page: Any
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


@pytest.fixture(scope="module")
def pages(jump: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One page of each kind."""
    folder = tmp_path_factory.mktemp("seen")
    out = {kind: folder / f"{kind}.html" for kind in KINDS}
    answer = {
        "verdict": "missing", "added": ["seal_friction"], "error_before": 3.0, "error_after": 1.1,
        "ladder": [["model as it is", 3.0], ["seal_friction", 1.1]], "model": "model.yaml",
        "ranking": [{"effect": "seal_friction", "probability": 0.98}],
    }  # fmt: skip
    (folder / "answer.json").write_text(json.dumps(answer), encoding="utf-8")
    logs = sorted(str(log) for log in (jump / "logs").glob("*.csv"))
    own = ["--run", str(jump), "--answer", str(folder)]
    call("review", *logs, *own, "--out", str(out["review"]))
    call("report", str(jump), "--out", str(out["report"]))
    call("view", str(jump), "--out", str(out["view"]))
    call("review", "--answer", str(folder), "--out", str(out["answer"]))
    return out


def call(*words: str) -> None:
    done = CliRunner().invoke(app, list(words))
    assert done.exit_code == 0, done.stderr


@pytest.fixture(params=SIZES)
def size(request: pytest.FixtureRequest) -> Any:
    return SIZES[request.param]


def opened(browser: Any, path: Path, size: dict[str, int]) -> Iterator[Opened]:
    found = Opened(browser.new_page(viewport=size))
    wrong = ("error", "warning")
    found.page.on("console", lambda m: m.type in wrong and found.complaints.append(m.text))
    found.page.on("pageerror", lambda error: found.complaints.append(str(error)))
    found.page.on("request", lambda request: found.requests.append(request.url[:60]))
    found.page.goto(path.as_uri())
    yield found
    found.page.close()


@pytest.fixture
def review(browser: Any, pages: dict[str, Path]) -> Iterator[Opened]:
    yield from opened(browser, pages["review"], SIZES["desk"])


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_opens_without_complaint(
    browser: Any, pages: dict[str, Path], kind: str, size: dict[str, int]
) -> None:
    """No message, no request, nothing wider than the window, every text readable."""
    for seen in opened(browser, pages[kind], size):
        seen.page.wait_for_timeout(200)
        assert seen.complaints == []
        assert [url for url in seen.requests if not url.startswith("data:")] == [
            pages[kind].as_uri()[:60]
        ]
        assert seen.page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        faint = [(ratio, text) for ratio, text in seen.page.evaluate(CONTRASTS) if ratio < AA]
        assert faint == []
        nameless = "[...document.querySelectorAll('img, canvas[role], .chart, svg[role]')]"
        nameless += ".filter((n) => !(n.alt || n.getAttribute('aria-label'))).length"
        assert seen.page.evaluate(nameless) == 0


def inked(page: Any, colour: str, selector: str = ".chart canvas") -> int:
    """How many pixels of a chart have a colour, to within some rounding."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return int(
        page.eval_on_selector(
            selector,
            """(c, [r, g, b]) => {
              const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
              let n = 0;
              for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 200 && Math.abs(d[i] - r)
                + Math.abs(d[i + 1] - g) + Math.abs(d[i + 2] - b) < 24) n += 1;
              return n;
            }""",
            [red, green, blue],
        )
    )


def test_plan_robot_and_logs_are_drawn_over_each_other(review: Opened) -> None:
    """Each in its colour; a button takes one away."""
    page = review.page
    for colour in ("#0072b2", "#d55e00", "#009e73"):
        assert inked(page, colour) > 20, colour
    charts = page.evaluate("+document.documentElement.dataset.charts")
    assert charts == page.locator(".chart").count() == page.locator(".chart .uplot").count() > 20
    page.get_by_role("button", name="plan", exact=True).click()
    assert inked(page, "#0072b2") == 0
    assert page.locator("button[data-track='0']").get_attribute("aria-pressed") == "false"


def test_arrow_keys_read_the_curves(review: Opened) -> None:
    page = review.page
    page.locator(".chart").first.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    first = page.locator(".key output").first.text_content()
    page.keyboard.press("Shift+ArrowRight")
    assert page.locator(".key output").first.text_content() != first
    said = page.locator("figcaption output").first.text_content()
    assert len(said.replace(".", "")) > 4, said
    page.keyboard.press("End")
    assert page.locator(".key output").first.text_content().endswith(" s")


def test_dragging_zooms_all_and_escape_returns(review: Opened) -> None:
    page = review.page
    box = page.locator(".chart .u-over").first
    box.scroll_into_view_if_needed()
    area = box.bounding_box()
    page.mouse.move(area["x"] + 0.3 * area["width"], area["y"] + 20)
    page.mouse.down()
    page.mouse.move(area["x"] + 0.6 * area["width"], area["y"] + 30, steps=4)
    before = inked(page, "#0072b2")
    page.mouse.up()
    page.wait_for_timeout(100)
    zoomed = inked(page, "#0072b2")
    assert zoomed != before
    page.locator(".chart").first.focus()
    page.keyboard.press("Escape")
    page.wait_for_timeout(100)
    assert inked(page, "#0072b2") == pytest.approx(before, rel=0.2)


@pytest.mark.parametrize("kind", ["review", "view"])
def test_wheel_and_space_scroll_the_page(browser: Any, pages: dict[str, Path], kind: str) -> None:
    """Also over the picture in 3-D; there the wheel comes nearer only with Ctrl."""
    for seen in opened(browser, pages[kind], {"width": 800, "height": 350}):
        page = seen.page
        page.keyboard.press("Space")
        page.wait_for_function("scrollY > 0")
        page.wait_for_timeout(400)  # Space scrolls smoothly, until it is done
        page.evaluate("scrollTo(0, 0)")
        page.wait_for_function("scrollY == 0")
        box = page.locator(".stage canvas").bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 20)
        page.mouse.wheel(0, 100)
        page.wait_for_function("scrollY > 0")


def test_the_viewer_has_its_controls(browser: Any, pages: dict[str, Path]) -> None:
    for seen in opened(browser, pages["view"], SIZES["desk"]):
        page = seen.page
        page.locator("[data-do=play]").click()
        assert page.locator("[data-do=play]").text_content() == "Play"
        stopped = page.locator(".stage output").text_content()
        page.wait_for_timeout(200)
        assert page.locator(".stage output").text_content() == stopped
        shots = set()
        for camera in ("side", "oblique", "front", "above", "nearer"):
            page.locator(f"[data-do={camera}]").click()
            shots.add(page.locator(".stage canvas").screenshot())
        page.locator(".stage canvas").focus()
        page.keyboard.press("ArrowLeft")
        shots.add(page.locator(".stage canvas").screenshot())
        assert len(shots) == 6
        page.locator(".stage select").select_option("1")
        page.locator("[data-do=play]").click()
        page.wait_for_timeout(300)
        assert page.locator(".stage output").text_content() != stopped


def test_feet_that_stand_are_seen(browser: Any, pages: dict[str, Path]) -> None:
    """Green at the start, when both stand; not in the air."""
    for seen in opened(browser, pages["view"], SIZES["desk"]):
        page = seen.page
        move = "(n, v) => { n.value = v * n.max; n.dispatchEvent(new Event('input')); }"
        page.locator(".stage input").evaluate(move, 0.05)
        assert inked(page, "#009e73", ".stage canvas") > 100
        page.locator(".stage input").evaluate(move, 0.55)
        assert inked(page, "#009e73", ".stage canvas") == 0


@pytest.mark.parametrize("kind", ["review", "report", "answer"])
def test_a_page_prints_on_two_sheets(browser: Any, pages: dict[str, Path], kind: str) -> None:
    for seen in opened(browser, pages[kind], SIZES["desk"]):
        seen.page.wait_for_timeout(200)
        paper = seen.page.pdf(prefer_css_page_size=True)
        assert paper.count(b"/Type /Page\n") <= 2


def test_a_failed_plan_is_red_and_first(browser: Any, tmp_path: Path) -> None:
    words = ["solve", "jump.yaml", "--set", "nodes=24", "--set", "solver.max_iterations=1"]
    run = tmp_path / "early"
    CliRunner().invoke(app, [*words, "--no-figure", "--out", str(run)])
    call("report", str(run))
    for seen in opened(browser, run / "report.html", SIZES["phone"]):
        first = seen.page.locator(".verdict .first")
        assert first.text_content().startswith("FAILED")
        assert first.evaluate("(n) => getComputedStyle(n).color") == "rgb(176, 0, 32)"
        assert first.bounding_box()["y"] < 120
