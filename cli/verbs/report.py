"""`kemba-opt report`: a run as one HTML page."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Written, newest, put


def report(
    run: Written = None,
    out: Annotated[
        Path | None, typer.Option(help="HTML to write (a new report.html in RUN).")
    ] = None,
    force: Force = False,
) -> None:
    """Write a run as one self-contained HTML page: verdict, numbers, motion, figures, origin.

    Example: kemba-opt report runs/jump-1
    """
    from kemba.report.review import report_run
    from kemba_cli.next_steps import say_verdict

    run = run or newest("certificate.json")
    path, verdict = report_run(run, out, force)
    put({"report": str(path), **verdict.json()}, path)
    say_verdict(verdict)
