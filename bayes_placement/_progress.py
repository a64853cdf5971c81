"""Progress bars with the time left, in the terminal."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bars

from ._types import Progress

WIDTH_OF_A_FILE = 140
"""Columns of what is written to a file or a pipe, so that a row of a table stays on one line."""


def terminal_console() -> Console:
    """Return the terminal, or a wide console where the output goes to a file or a pipe."""
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH_OF_A_FILE)


@contextmanager
def progress_bars(console: Console, tasks: Sequence[str]) -> Iterator[Callable[[str], Progress]]:
    """Show a bar for each task, with the time left of the one that runs.

    Yields a function that begins a task: it takes the name of the task and returns the function
    to which the task reports the share that is done. A task ends when the next one begins.

    Parameters
    ----------
    console
        Where the bars are shown.
    tasks
        Names of the tasks.
    """
    with _bars(console) as bars:
        numbers = {task: bars.add_task(task, total=1.0, start=False, word="") for task in tasks}
        running: list[TaskID] = []

        def begin(task: str) -> Progress:
            _finish(bars, running)
            number = numbers[task]
            running.append(number)
            bars.start_task(number)
            bars.update(number, word="time left")
            # Results are still to be laid out when an engine reports that all is done.
            return lambda share: bars.update(number, completed=min(share, 0.99))

        yield begin
        _finish(bars, running)


@contextmanager
def progress_bar(task: str = "computed") -> Iterator[Progress]:
    """Show a bar with the time left; a context manager, for `progress=` of any function.

    Parameters
    ----------
    task
        Text before the bar.
    """
    with progress_bars(terminal_console(), [task]) as begin:
        yield begin(task)


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
