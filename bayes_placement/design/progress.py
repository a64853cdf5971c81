"""A bar of progress for computations that take long."""

from collections.abc import Iterator
from contextlib import contextmanager

from .._shared.arguments import arguments_checked
from .._shared.progress import Progress, progress_bars, progress_console


@arguments_checked
@contextmanager
def progress_bar(task: str = "computed") -> Iterator[Progress]:
    """Show a bar with the time left; a context manager, for `progress=` of any function.

    Parameters
    ----------
    task
        Text before the bar.

    Examples
    --------
    >>> with bp.design.progress_bar("places") as progress:
    ...     learnt = bp.information_map(experiment, places, estimator=estimator, progress=progress)
    """
    with progress_bars(progress_console(), [task]) as begin:
        yield begin(task)
