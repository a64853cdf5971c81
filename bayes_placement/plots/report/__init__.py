"""A report to hand on: one HTML file that needs no network, and the same as JSON beside it."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..._shared.arguments import arguments_checked
from ..._shared.files import Json
from ._saved import Saved, runs, saved, states
from ._style import look
from ._svg import embedded
from .content import Item, Text
from .report import SECTIONS, WARNINGS, Chapter, Report, json_of
from .sections import interactive, laws, modes, remarks, responses, suspicion, unknowns, verdict

__all__ = ["SECTIONS", "Report", "write_report"]

PAGE = "report.html"
"""Name of the page in the folder of a run."""

_SECTIONS = {
    "conclusion": verdict.conclusion,
    "verdict": verdict.items,
    "set up": remarks.set_up,
    "agreement": modes.agreement,
    "laws": laws.items,
    "error": verdict.error,
    "residual map": responses.residual_map,
    "interactive": interactive.items,
    "responses": responses.items,
    "modes": modes.items,
    "suspicion": suspicion.items,
    "tables": verdict.tables,
    "next measurement": suspicion.next_measurement,
    "unknowns": unknowns.items,
    "positions": unknowns.positions,
    "mode shapes": modes.shapes,
    "warnings": remarks.warnings,
    "settings": remarks.settings,
}
"""Sections in their order, by what is said of one that cannot be drawn."""


@arguments_checked
def write_report(
    folder: str | Path,
    *,
    to: str | Path | None = None,
    label: str | None = None,
    title: str | None = None,
    author: str | None = None,
    client: str | None = None,
    photo: str | Path | None = None,
    comments: Sequence[str] = (),
) -> Path:
    """Write the report of a run, from what the run left in its folder.

    Where the report is there already, it keeps its other chapters and all comments: the results of
    a second state, or of a week later, are added.

    Parameters
    ----------
    folder
        Folder of the results of `check`, `explain`, `improve`, `update` or `place`; or of several
        states, with a folder for each.
    to
        The page; `report.html` in the folder by default. The same as JSON stands beside it.
    label
        Name of these results in the report; the name of the folder by default.
    title
        Title of the page; as it was, or the name of the model or case.
    author, client
        Who wrote it and for whom; as they were, or not stated.
    photo
        PNG or JPEG of the structure, at most 5 MB, which becomes a part of the page.
    comments
        Words to be added.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    FileNotFoundError
        If there is no such folder or photograph.
    InputError
        If an argument is of another kind, it holds no results, the page is none of a report, or the
        photograph is none.

    Examples
    --------
    >>> bp.plots.report.write_report("results", title="Frame, week 7")  # doctest: +SKIP
    """
    source = Path(folder)
    target = source / PAGE if to is None else Path(to)
    is_there = json_of(target).is_file()
    report = Report.read(target) if is_there else Report(_title(source))
    shown = None if photo is None else embedded(photo)
    on_title = {"title": title, "author": author, "client": client, "photo": shown}
    stated: Json = {word: of for word, of in on_title.items() if of is not None}
    report = replace(report, **stated)
    for name, part in _parts(source, label):
        report.put(_chapter(name, saved(part)))
    for comment in comments:
        report.add_text(comment)
    return report.write(target)


def _title(folder: Path) -> str:
    """Name of the model or the case; of the folder where that was not kept."""
    sources = [run.get("model", {}).get("path", "") for run in runs(folder).values()]
    models = dict.fromkeys(_name(Path(source)) for source in sources if source)
    return ", ".join(models) or folder.resolve().name


def _name(model: Path) -> str:
    """Name of a model file, or of the folder of a case."""
    return model.parent.name if model.name == "case.json" else model.stem


def _parts(folder: Path, label: str | None) -> list[tuple[str, Path]]:
    """Folders of results and their names in the report; of several states, one each."""
    name = label or folder.resolve().name
    numbered = enumerate(states(folder), 1)
    return [
        (name, folder),
        *((f"{name}, {state}", folder / f"state_{number}") for number, state in numbered),
    ]


def _chapter(label: str, of: Saved) -> Chapter:
    """All sections of a run, drawn as figures of a report look."""
    with look():
        items = list(itertools.chain.from_iterable(_section(name, of) for name in _SECTIONS))
    return Chapter(label, verdict.verdict(of), items)


def _section(name: str, of: Saved) -> list[Item]:
    """Items of a section, or a sentence where it cannot be drawn: the others are worth having."""
    try:
        return list(_SECTIONS[name](of))
    except Exception as error:  # noqa: BLE001, any error of a figure
        reason = " ".join(str(error).split())
        words = f"The section on {name} could not be drawn ({type(error).__name__}: {reason})."
        return [Item(WARNINGS, f"Not drawn: {name}", Text((words,)), tags=("warning",))]
