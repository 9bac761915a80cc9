"""The page on the program's own reliability names tests that are there."""

from pathlib import Path

from kemba.config import load_yaml

ROOT = Path(__file__).parent.parent
POINTS = load_yaml(ROOT / "benchmarks" / "program_points.yaml").data


def test_every_point_names_tests_that_exist() -> None:
    assert [point["number"] for point in POINTS] == list(range(1, 25))
    for point in POINTS:
        assert point["tests"] or point["open"]
        for test in point["tests"]:
            file, _, name = test.partition("::")
            text = (ROOT / file).read_text(encoding="utf-8")
            assert f"def {name}(" in text or not name, test


def test_the_page_is_of_these_points() -> None:
    page = (ROOT / "benchmarks" / "pages" / "reliability-of-the-program.md").read_text(
        encoding="utf-8"
    )
    for point in POINTS:
        assert f"| {point['number']} | {point['defect']} |" in page
