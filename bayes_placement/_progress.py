"""_progress: in, pieces of work; out, a bar for each with the time left.

Not known here: what the work is.
"""

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


def terminal() -> Console:
    """Return the terminal; a pipe has no width, and a table in a file keeps one line a figure."""
    console = Console()
    return console if console.is_terminal else Console(width=140)


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
