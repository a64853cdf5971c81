"""`bayes-placement report`: one file to hand on, from the folder of a run."""

from pathlib import Path
from typing import Annotated

import typer

from ._errors import errors_in_words

Results = Annotated[
    Path,
    typer.Argument(help="Folder of the results of check, explain, improve, update or place."),
]
To = Annotated[
    Path | None,
    typer.Option(
        help="The page. Results of another state or week are added to one that is there, under "
        "their --label. Default: report.html in the folder."
    ),
]
Label = Annotated[
    str | None,
    typer.Option(help="Name of these results in the report. Default: that of the folder."),
]
Title = Annotated[str | None, typer.Option(help="Title of the page.")]
Comments = Annotated[
    list[str] | None,
    typer.Option("--comment", help="A paragraph of yours; once for each."),
]
Traceback = Annotated[
    bool, typer.Option("--traceback", help="Show where in the program an error came up.")
]


def report(
    results: Results,
    to: To = None,
    label: Label = None,
    title: Title = None,
    comment: Comments = None,
    traceback: Traceback = False,
) -> None:
    """Write what a run found as one page that needs no network, and as JSON beside it."""
    with errors_in_words(results, show_traceback=traceback):
        from ..plots.report import write_report
        from ._terminal import Screen

        page = write_report(results, to=to, label=label, title=title, comments=comment or ())
        Screen.of(False, False).verdict(f"Report to hand on: {page}")
