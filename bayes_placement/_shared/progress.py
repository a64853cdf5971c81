"""Progress with the time left: bars in the terminal, plain lines in a file."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    Task,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bars
from rich.text import Text

Progress = Callable[[float], None]
"""Called with the share of the work that is done, from 0 to 1."""

WIDTH_OF_A_FILE = 140
"""Columns of what is written to a file or a pipe, so that a row of a table stays on one line."""

BETWEEN_LINES = 10.0
"""Time [s] from one line of progress in a file to the next, at least."""

LEAST_SHARE = 0.02
"""Share done below which no time left is stated: most of what was spent is compilation."""

LONG = 600.0
"""Time left [s] from which on advice on a shorter task is given."""

LATE_SHARE = 0.5
"""Share done from which on a shorter task would hardly save time."""


def no_progress(share: float) -> None:
    """Report nothing."""


def terminal_console() -> Console:
    """Return the terminal, or a wide console where the output goes to a file or a pipe."""
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH_OF_A_FILE)


def progress_console() -> Console:
    """Return standard error, so that progress is no part of what a command answers."""
    console = Console(stderr=True)
    return console if console.is_terminal else Console(stderr=True, width=WIDTH_OF_A_FILE)


@contextmanager
def progress_bars(console: Console, tasks: Sequence[str]) -> Iterator[Callable[[str], Progress]]:
    """Show how far each task is, with the time left of the one that runs.

    Yields a function that begins a task: it takes the name of the task and returns the function to
    which the task reports the share that is done. A task ends when the next one begins. What is
    shown never runs backwards. Bars are shown in a terminal or notebook, else plain lines.
    """
    if console.is_terminal or console.is_jupyter:
        # What a notebook printed and has not sent yet would go into the widget of the bars, which
        # clears it.
        sys.stdout.flush()
        with _bars(console) as bars:
            shown: _Tasks | _Lines = _Tasks(bars, tasks)
            yield shown.begin
            shown.finish()
    else:
        shown = _Lines(console)
        yield shown.begin
        shown.finish()


@contextmanager
def shown(progress: Progress | None, task: str) -> Iterator[Progress]:
    """Report to what the caller gives, or else to a bar where somebody looks at one."""
    console = progress_console()
    if progress is not None:
        yield progress
    elif console.is_terminal or console.is_jupyter:
        with progress_bars(console, [task]) as begin:
            yield begin(task)
    else:
        yield no_progress


def with_advice(progress: Progress, advise: Callable[[], None]) -> Progress:
    """Report, and advise once where much time is left in the first half of the work."""
    began, advised = time.monotonic(), False

    def report(share: float) -> None:
        nonlocal advised
        progress(share)
        if not advised and LEAST_SHARE <= share < LATE_SHARE:
            advised = _seconds_left(time.monotonic() - began, share) > LONG
            if advised:
                advise()

    return report


class _Tasks:
    """Bars of tasks, of which one runs."""

    def __init__(self, bars: Bars, tasks: Sequence[str]):
        self.bars = bars
        self.numbers = {
            task: bars.add_task(task, total=1.0, start=False, word="") for task in tasks
        }
        self.running: list[TaskID] = []

    def begin(self, task: str) -> Progress:
        """Begin a task, which ends the one before."""
        self.finish()
        number = self.numbers[task]
        self.running.append(number)
        self.bars.start_task(number)
        self.bars.update(number, word="time left")
        return lambda share: self._report(number, share)

    def _report(self, number: TaskID, share: float) -> None:
        # Results are still to be laid out when an engine reports that all is done.
        known = min(share, 0.99)
        self.bars.update(number, completed=max(self.bars.tasks[number].completed, known))

    def finish(self) -> None:
        """End the task that runs."""
        while self.running:
            self.bars.update(self.running.pop(), completed=1.0, word="took")


class _Lines:
    """A line for a task now and then, and one at its end."""

    def __init__(self, console: Console):
        self.console = console
        self.task, self.began, self.printed_at, self.share = "", 0.0, 0.0, 0.0

    def begin(self, task: str) -> Progress:
        """Begin a task, which ends the one before."""
        self.finish()
        self.task, self.began, self.share = task, time.monotonic(), 0.0
        self.printed_at = self.began
        return self.report

    def report(self, share: float) -> None:
        """Tell the share that is done and the time left, where enough time has passed."""
        now, before = time.monotonic(), self.share
        self.share = max(before, min(share, 0.99))
        if self.task and now - self.printed_at >= BETWEEN_LINES and self.share > before:
            time_left = _time_left(now - self.began, self.share)
            self._print(f"{self.task}: {100 * self.share:.0f} %{time_left}")
            self.printed_at = now

    def finish(self) -> None:
        """End the task that runs."""
        if self.task:
            self._print(f"{self.task}: 100 %, took {_duration(time.monotonic() - self.began)}")
            self.task = ""

    def _print(self, text: str) -> None:
        self.console.print(text, highlight=False, soft_wrap=True, markup=False)


def _time_left(seconds: float, share: float) -> str:
    """Say how much time is left, where enough is done to estimate it."""
    if share < LEAST_SHARE:
        return ""
    return f", about {_duration(_seconds_left(seconds, share))} left"


def _seconds_left(seconds: float, share: float) -> float:
    return seconds * (1 - share) / share


class _TimeLeft(TimeRemainingColumn):
    """Time left, which is not stated where too little is done."""

    def render(self, task: Task) -> Text:
        """Show the time left, or that it is not known."""
        if not task.finished and task.percentage < 100 * LEAST_SHARE:
            return Text("-:--:--", style="progress.remaining")
        return TimeRemainingColumn.render(self, task)


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _bars(console: Console) -> Bars:
    return Bars(
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TextColumn("{task.fields[word]}"),
        _TimeLeft(elapsed_when_finished=True),
        console=console,
        speed_estimate_period=600,  # compilation is one long step
    )
