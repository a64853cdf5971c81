"""Text, lists and tables in the terminal."""

from collections.abc import Iterable

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod
from rich.markup import escape
from rich.table import Table


def print_text(console: Console, text: object) -> None:
    """Print text as it is, without colours, markup or line breaks of its own."""
    console.print(str(text), highlight=False, soft_wrap=True, markup=False)


def print_list(console: Console, sentences: Iterable[str]) -> None:
    """Print sentences as a list, one on each line."""
    for sentence in sentences:
        print_text(console, f"- {sentence}")


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
