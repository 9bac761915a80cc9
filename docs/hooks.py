"""Pages that are made when the site is built, and the way onwards from those that scripts write."""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

# the last line of pages that a script writes from results
NEXT = {
    "cli.md": "[plan a jump](plan.md), or [how files are written](files.md)",
    "effects.md": "[an effect of your own](extending.md), or [the physics](physics.md)",
}

# a link to what a study has measured, which stays in the repository
RECORD = re.compile(r"\[([^\]]+)\]\(\.\./benchmarks/pages/([\w-]+\.md)(?:#[\w-]+)?\)")

TYPES = {
    "boolean": "true or false",
    "integer": "whole number",
    "number": "number",
    "object": "group of keys",
    "string": "text",
}


def on_files(files: Any, config: Any) -> Any:
    """The reference of the command line, from the command itself."""
    from mkdocs.structure.files import File

    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "cli.md"
        command = [sys.executable, "-m", "typer", "kemba_cli.main", "utils", "docs"]
        options = ["--name", "kemba-opt", "--output", str(page)]
        subprocess.run([*command, *options], check=True, capture_output=True)
        text = whole_summaries(page.read_text(encoding="utf-8"))
    files.append(File.generated(config, "cli.md", content=text))
    return files


def whole_summaries(text: str) -> str:
    """The list of verbs with their whole first sentences, which the generator cuts, and links."""
    import typer.main

    from kemba_cli.main import app

    for verb, command in typer.main.get_command(app).commands.items():
        line = f"* [`{verb}`](#kemba-opt-{verb}): {command.help.splitlines()[0]}"
        text = re.sub(rf"^\* `{verb}`: .*$", lambda _, line=line: line, text, flags=re.MULTILINE)
    return text


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """A page that a script wrote, with its last line; the keys of a task from its schema."""
    if page.file.src_uri == "tasks.md":
        body, line, rest = markdown.rpartition("\nNext: ")
        markdown = f"{body}\n## From the schema\n\n{task_keys()}{line}{rest}"
    markdown = RECORD.sub(r"\1 (`benchmarks/pages/\2`)", markdown)
    onwards = NEXT.get(page.file.src_uri)
    return f"{markdown}\n\nNext: {onwards}.\n" if onwards else markdown


def task_keys() -> str:
    """Every key of a task with its range, unit and default, from the JSON Schema of the program."""
    from kemba.ocp.task.task import Task

    schema = Task.model_json_schema()
    parts = {"": schema, **{f"{k.lower()}.": v for k, v in schema["$defs"].items()}}
    places = {"bound.": "start.NAME.", "goal.": "goals.NAME.", "obstacle.": "obstacles[0]."}
    rows = [
        f"| `{places.get(part, part)}{key}` | {_kind(about)} | {_default(about)} |"
        for part, table in parts.items()
        for key, about in table["properties"].items()
    ]
    return "\n".join(["| key | what it takes | default |", "|---|---|---|", *rows]) + "\n"


def _kind(about: dict[str, Any]) -> str:
    """What a key takes, in words."""
    if "enum" in about:
        return ", ".join(f"`{word}`" for word in about["enum"])
    if "unit" in about:
        number = about["anyOf"][0]
        ends = [f"{end} {number[end]:g}" for end in ("minimum", "maximum") if end in number]
        return ", ".join([about.get("description", f"[{about['unit']}]"), *ends])
    if "anyOf" in about:
        kinds = [_kind(one) for one in about["anyOf"] if one.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if about.get("type") == "array":
        items = about.get("prefixItems") or [about["items"]]
        return "list of " + " and ".join(dict.fromkeys(map(_kind, items)))
    ends = [f", {end} {about[end]}" for end in ("minimum", "maximum") if end in about]
    return TYPES[about.get("type", "object")] + "".join(ends)


def _default(about: dict[str, Any]) -> str:
    known = about.get("default")
    return "" if known in (None, "") else f"`{json.dumps(known)}`"
