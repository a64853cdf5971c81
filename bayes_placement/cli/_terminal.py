"""What a command shows: text and tables on standard output, progress on standard error."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod, RenderableType
from rich.markup import escape
from rich.table import Table

from .._progress import progress_bars, progress_console, terminal_console
from .._types import Progress, no_progress


class Screen(NamedTuple):
    """Where a command shows what it does and finds.

    Parameters
    ----------
    console
        Standard output.
    progress_console
        Standard error.
    quiet
        Whether nothing but the verdict and the folder of the results is shown.
    as_json
        Whether standard output is one object of JSON instead of text.
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
        """Print text as it is, without colours, markup or line breaks of its own."""
        if not self.quiet and not self.as_json:
            print_text(self.console, text)

    def list(self, sentences: Iterable[str]) -> None:
        """Print sentences as a list, one on each line."""
        for sentence in sentences:
            self.text(f"- {sentence}")

    def show(self, table: RenderableType) -> None:
        """Print a table."""
        if not self.quiet and not self.as_json:
            self.console.print(table)

    def verdict(self, text: str) -> None:
        """Print what is shown in any case, save where JSON is asked for."""
        if not self.as_json:
            print_text(self.console, text)

    def json(self, content: Mapping[str, Any]) -> None:
        """Print an object of JSON, where that is asked for."""
        if self.as_json:
            text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
            print_text(self.console, text)

    def progress(self, tasks: Sequence[str]) -> AbstractContextManager[Callable[[str], Progress]]:
        """Show how far each task is; see `progress_bars`."""
        if self.quiet:
            return nullcontext(lambda task: no_progress)
        return progress_bars(self.progress_console, tasks)


def print_text(console: Console, text: object) -> None:
    """Print text as it is, without colours, markup or line breaks of its own."""
    console.print(str(text), highlight=False, soft_wrap=True, markup=False)


def terminal_table(data: pd.DataFrame, index_title: str) -> Table:
    """Lay out a data frame; a cell that is too wide is broken between words, never in a number."""
    table = Table(box=SIMPLE_HEAD)
    table.add_column(index_title, overflow="fold")
    for column in data.columns:
        justify: JustifyMethod = "left" if column == "parameters" else "right"
        table.add_column(escape(str(column)), justify=justify, overflow="fold")
    for name, row in data.iterrows():
        table.add_row(*(escape(str(value)) for value in (name, *row)))
    return table
