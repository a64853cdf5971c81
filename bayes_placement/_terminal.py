"""_terminal: in, tables, words and work with progress; out, what an engineer sees in the terminal.

Not known here: what the figures mean, how anything is computed.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod
from rich.markup import escape
from rich.progress import (
    BarColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bars
from rich.table import Table

from ._types import Progress


def terminal() -> Console:
    """Return the terminal; a pipe has no width, and a table in a file keeps one line a figure."""
    console = Console()
    return console if console.is_terminal else Console(width=140)


def say(console: Console, text: object) -> None:
    """Print text as it is."""
    console.print(str(text), highlight=False, soft_wrap=True, markup=False)


def say_each(console: Console, sentences: Iterable[str]) -> None:
    """Print sentences, one a line."""
    for sentence in sentences:
        say(console, f"- {sentence}")


@contextmanager
def stages(console: Console, names: Sequence[str]) -> Iterator[Callable[[str], Progress]]:
    """Show a bar for each piece of work, with the time that it will take.

    What is given is called with a name as its work begins, and returns what to report to. The
    work lasts until the next one begins.
    """
    with _bars(console) as bars:
        waiting = {name: bars.add_task(name, total=1.0, start=False, word="") for name in names}
        running: list[TaskID] = []

        def begin(name: str) -> Progress:
            _finish(bars, running)
            task = waiting[name]
            running.append(task)
            bars.start_task(task)
            bars.update(task, word="time left")
            # Results are still to be laid out when an engine says that it is done.
            return lambda share: bars.update(task, completed=min(share, 0.99))

        yield begin
        _finish(bars, running)


@contextmanager
def progress_bar(name: str = "computed") -> Iterator[Progress]:
    """Bar with the time left, for `progress=` of any function, in a `with` statement.

    Parameters
    ----------
    name
        What is said before it.
    """
    with stages(terminal(), [name]) as begin:
        yield begin(name)


def _finish(bars: Bars, running: list[TaskID]) -> None:
    while running:
        bars.update(running.pop(), completed=1.0, word="took")


def _bars(console: Console) -> Bars:
    return Bars(
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TextColumn("{task.fields[word]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=console,
        speed_estimate_period=600,  # compilation is one long step
    )


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
