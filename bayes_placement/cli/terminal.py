"""terminal: in, tables, words and work with progress; out, what an engineer sees in the terminal.

Not known here: what the figures mean, how anything is computed.
"""

from collections.abc import Iterable

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod
from rich.markup import escape
from rich.table import Table


def say(console: Console, text: object) -> None:
    """Print text as it is."""
    console.print(str(text), highlight=False, soft_wrap=True, markup=False)


def say_each(console: Console, sentences: Iterable[str]) -> None:
    """Print sentences, one a line."""
    for sentence in sentences:
        say(console, f"- {sentence}")


def frame(figures: pd.DataFrame, corner: str) -> Table:
    """Lay out a data frame; what is too long is broken between words, never within a number."""
    table = Table(box=SIMPLE_HEAD)
    table.add_column(corner, overflow="fold")
    for column in figures.columns:
        justify: JustifyMethod = "left" if column == "parameters" else "right"
        table.add_column(escape(str(column)), justify=justify, overflow="fold")
    for name, row in figures.iterrows():
        table.add_row(*(escape(str(value)) for value in (name, *row)))
    return table
