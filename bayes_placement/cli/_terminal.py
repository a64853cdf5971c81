"""What a command shows: text, tables and the next command; progress on standard error."""

import json
import re
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod, RenderableType
from rich.markup import escape
from rich.table import Table

from .._shared.errors import in_commands
from .._shared.progress import (
    Progress,
    no_progress,
    progress_bars,
    progress_console,
    terminal_console,
)
from ._streams import print_answer, printable

if TYPE_CHECKING:
    import pandas as pd

UNBROKEN = re.compile(
    r"\(95 %: \S+ to \S+|"
    r"\S+(?: ± [^\s,]+(?: [^\s\d,]\S{0,6}(?!\S))?,?| or \S+| \S{1,4}(?= \(95 %))*"
)
"""A word, a number with its unit, its error or its interval, or several of which one holds."""

BETWEEN = 3
"""Characters between two columns of a table."""


class Screen(NamedTuple):
    """Where a command shows what it does and finds.

    The console is standard output, or one object of JSON there; that of progress is standard error.
    Quiet shows the verdict and the folder of the results alone.
    """

    console: Console
    progress_console: Console
    quiet: bool = False
    as_json: bool = False

    @classmethod
    def of(cls, quiet: bool, as_json: bool) -> "Screen":
        """The screen of this process."""
        return cls(terminal_console(), progress_console(), quiet, as_json)

    def text(self, text: object) -> None:
        """Print text without colours, markup or line breaks of its own, advice in commands."""
        if not self.quiet and not self.as_json:
            print_text(self.console, in_commands(str(text)))

    def list(self, sentences: Iterable[str]) -> None:
        """Print sentences as a list, one on each line."""
        for sentence in sentences:
            self.text(f"- {sentence}")

    def show(self, table: RenderableType) -> None:
        """Print a table that is laid out."""
        if not self.quiet and not self.as_json:
            self.console.print(table)

    def table(self, data: "pd.DataFrame", index_title: str) -> None:
        """Print a table as wide as the terminal, and what its columns mean."""
        self.show(terminal_table(data, index_title, self.console.width))
        for note in notes(data):
            self.text(f"  {note}")

    def verdict(self, text: str) -> None:
        """Print the verdict, in bold on a terminal; as all that is shown in any case."""
        self.always(text, style="bold")

    def always(self, text: str, style: str = "") -> None:
        """Print what is shown in any case, save where JSON is asked for."""
        if not self.as_json:
            print_text(self.console, text, style)

    def json(self, content: Mapping[str, object]) -> None:
        """Print an object of JSON, where that is asked for."""
        if self.as_json:
            print_answer(json.dumps(content, indent=1, allow_nan=False))

    def written(self, command: str, verdict: str, files: Sequence[Path]) -> None:
        """Say what a command wrote, files of one folder, that computes nothing."""
        self.always(verdict)
        answer = {"command": command, "finished": True, "verdict": verdict, "exit_code": 0}
        names = [file.name for file in files]
        self.json({**answer, "files": names, "folder": str(files[0].parent), "result": {}})

    def step(self, text: str) -> None:
        """Tell what a task has come to, beside its progress."""
        if not self.quiet:
            print_text(self.progress_console, text)

    def progress(self, tasks: Sequence[str]) -> AbstractContextManager[Callable[[str], Progress]]:
        """Show how far each task is; see `progress_bars`."""
        if self.quiet:
            return nullcontext(lambda task: no_progress)
        return progress_bars(self.progress_console, tasks)


def print_text(console: Console, text: object, style: str = "") -> None:
    """Print text as it is, without markup or line breaks of its own."""
    console.print(printable(text), style=style, highlight=False, soft_wrap=True, markup=False)


NOTES = {
    "reduced chi-square": "reduced chi-square: the squared misfit over that of the noise; a "
    "correct model has 1.",
    "log evidence": "log evidence: greater is better; a difference of 3 is a factor of 20 in odds.",
    "log evidence gained": "log evidence gained: over the model as given; greater is better, and 3 "
    "more is a factor of 20 in odds.",
    "held out": "held out: how well data left out of the fit are predicted, the mean log density "
    "of a datum; greater is better.",
    "p of score": "p of score: probability that a correct model shows so strong a trace of the "
    "effect.",
    "information [nat]": "nat: unit of information; a gain of 0.69 nat (one bit) halves what is "
    "still possible.",
    "p of whiteness": "p of whiteness: small where residuals of neighbouring lines are correlated.",
    "predictive p": "predictive p: share of data simulated by the model with a larger misfit.",
    "without model error": "without model error: reduced chi-square of the model, taken for exact.",
}
"""What columns of tables mean, by their heading."""


def notes(table: "pd.DataFrame") -> list[str]:
    """Explain the columns of a table that are not plain."""
    return [note for heading, note in NOTES.items() if heading in table.columns]


def terminal_table(data: "pd.DataFrame", index_title: str, width: int) -> Table:
    """Lay out a data frame in so many columns of characters; no word and no number is broken.

    Where its columns do not fit, each row is a paragraph of its own.
    """
    headings = [index_title, *map(printable, data.columns)]
    rows = [[printable(cell) for cell in (name, *row)] for name, row in data.iterrows()]
    columns = [[heading, *(row[place] for row in rows)] for place, heading in enumerate(headings)]
    least = [max(map(_longest, column)) for column in columns]
    room = width - sum(least) - BETWEEN * len(least) - 1
    if room < 0:
        return _paragraphs(headings, rows, width)
    table = Table(box=SIMPLE_HEAD)
    for heading, narrow, column in zip(headings, least, columns, strict=True):
        is_text = heading in (index_title, "parameters", "unit")
        justify: JustifyMethod = "left" if is_text else "right"
        used = min(narrow + room, max(map(len, column)))
        room -= used - narrow
        table.add_column(_wrapped(heading, used), justify=justify, width=used)
    widths = [column.width or width for column in table.columns]
    for row in rows:
        table.add_row(*map(_wrapped, row, widths))
    return table


def _paragraphs(headings: list[str], rows: list[list[str]], width: int) -> Table:
    """Each row as a paragraph: its name, then a line for each of its cells."""
    room = width - max(map(len, headings)) - 7
    table = Table(box=None, show_header=False, padding=(0, 1))
    table.add_column()
    table.add_column()
    for name, *cells in rows:
        table.add_row(escape(headings[0]), _wrapped(name, room))
        for heading, cell in zip(headings[1:], cells, strict=True):
            if cell:
                table.add_row(f"  {escape(heading)}", _wrapped(cell, room))
        table.add_row()
    return table


def _wrapped(text: str, width: int) -> str:
    """Text in lines of so many characters, broken between words and never in a number."""
    lines = [""]
    for part in UNBROKEN.findall(text):
        if lines[-1] and len(lines[-1]) + 1 + len(part) > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {part}".lstrip()
    return escape("\n".join(lines))


def _longest(text: str) -> int:
    """Characters of the longest part of a text that is not to be broken."""
    return max(map(len, UNBROKEN.findall(text)), default=0)


def command_on(name: str, model: Path, data: Path | None, *flags: str) -> str:
    """Return a command on a model, its data if they are not its own, and further words."""
    measured = () if data is None else ("--data", str(data))
    return shlex.join(["bayes-placement", name, str(model), *measured, *flags])
