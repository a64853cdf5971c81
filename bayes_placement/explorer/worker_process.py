"""What the worker of a page does: tasks from its standard input, what it finds to its output."""

import os
import queue
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import cloudpickle
import jax
import numpy as np

from .._shared.compiled import forget_programs
from .._shared.files import Json
from .._shared.garbage import collect_garbage_rarely, give_memory_back, memory_in_use
from .._shared.progress import Progress
from ..criticism.fitted import in_scalars
from ..criticism.kept_fits import fits_kept_in
from ..criticism.missing.as_given import fitted_as_given
from ..criticism.missing.from_values import fitted_from
from ..criticism.missing.improve import improve
from ..criticism.missing.ledger import Ledger
from ..criticism.missing.reach import reach
from ..criticism.reach.at_values import ReachAtValues
from ..criticism.reach.reach import Reach
from ..design.next_measurement import next_measurement
from ..experiment.variants import with_lines_at
from ..inference.alternative_explanation import Alternative
from .candidates import offered
from .worker import NICE, AskedOfWorker, SharedArrays, Task, failure, read, write

LARGE = 600e6
"""Bytes in use from which on compiled functions are forgotten as well."""

IDLE = 2.0
"""Time [s] without a task after which memory goes back."""

Tell = Callable[[str, object], None]
"""Called with a word and what belongs to it, see `Told`."""


def as_given(asked: AskedOfWorker, tell: Tell) -> dict[str, float]:
    """Values of the best fit of a model as it is, from many starts."""
    return in_scalars(fitted_as_given(asked.experiment, asked.measurement).values)


def check_data(asked: AskedOfWorker, tell: Tell) -> list[str]:
    """Sentences on faults of the measurement."""
    return asked.experiment.check_data(asked.measurement).sentences()


def fit(asked: AskedOfWorker, tell: Tell, values: Mapping[str, float]) -> dict[str, float]:
    """Values of the fit from given values, which tells where it has come to."""
    return fitted_from(
        asked.experiment, asked.measurement, values, lambda point: tell("seen", point)
    )


def reached(asked: AskedOfWorker, tell: Tell, lines: np.ndarray | None = None) -> Reach:
    """What laws at each place could remove of the misfit, of some lines or of all."""
    experiment = asked.experiment
    return reach(
        experiment if lines is None else with_lines_at(experiment, lines),
        asked.measurement,
        baseline=asked.baseline,
        progress=lambda share: tell("progress", share),
    )


def beside(
    asked: AskedOfWorker, tell: Tell, acts_on: str, values: Mapping[str, float]
) -> tuple[Json, Mapping[str, np.ndarray]]:
    """What any law on a kind of port leaves with given values of the unknowns: words, arrays."""
    at_values = _at_values(asked, acts_on)
    left = at_values(values)._asdict()
    return (
        {"acts_on": acts_on, "places": at_values.places},
        {"frequency": at_values.frequency, **left},
    )


_LAST: list[tuple[AskedOfWorker, str, ReachAtValues]] = []
"""The last model and kind of port beside which laws were looked for, or none."""


def _at_values(asked: AskedOfWorker, acts_on: str) -> ReachAtValues:
    for model, kind, at_values in _LAST:
        if model is asked and kind == acts_on:
            return at_values
    _LAST[:] = [(asked, acts_on, ReachAtValues(asked.experiment, asked.measurement, acts_on))]
    return _LAST[0][2]


def search(asked: AskedOfWorker, tell: Tell) -> Ledger:
    """Ledger of what the model lacks."""
    return improve(
        asked.experiment,
        asked.measurement,
        baseline=asked.baseline,
        store=asked.store,
        progress=lambda share: tell("progress", share),
        callback=lambda step: tell("step", step),
    )


def report(asked: AskedOfWorker, tell: Tell, write: Callable[[Progress], object]) -> object:
    """What a report was written as, by what writes it."""
    return write(lambda share: tell("progress", share))


def next_one(asked: AskedOfWorker, tell: Tell, alternatives: Sequence[Alternative]) -> Json:
    """Where one more measurement tells the explanations apart that a search has left."""
    return next_measurement(asked.experiment, asked.measurement, alternatives)


TASKS: Mapping[str, Callable[..., object]] = {
    "offered": lambda asked, tell: offered(asked.experiment),
    "as_given": as_given,
    "check_data": check_data,
    "fit": fit,
    "reach": reached,
    "band": reached,
    "beside": beside,
    "next": next_one,
    "report": report,
    "search": search,
}
"""Tasks by their names."""


def serve() -> None:
    """Do tasks until standard input ends, as it does with the process that started this one."""
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what is printed goes to standard error
    with suppress(OSError):
        os.nice(NICE)
    content = cloudpickle.loads(read(sys.stdin.buffer) or b"")
    sys.path[:] = content["path"]
    for name, value in content["settings"].items():
        jax.config.update(name, value)
    collect_garbage_rarely()
    shared = SharedArrays(content["arrays"])
    waiting: queue.SimpleQueue[Task] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(shared, waiting), daemon=True).start()
    asked: Any = None
    while True:
        number, task, new, arguments = _next(waiting)
        asked = new or asked  # what the task before was about is not sent again

        def tell(word: str, content: object, number: int = number) -> None:
            write(output, shared.dumps((number, word, content)))

        tell(*_outcome(task, asked, arguments, tell))


def _next(waiting: "queue.SimpleQueue[Task]") -> Task:
    """Next task; memory that nobody uses goes back where none comes for a while."""
    try:
        return waiting.get(timeout=IDLE)
    except queue.Empty:
        give_memory_back()
        if memory_in_use() > LARGE:
            forget_programs()
            give_memory_back()
        return waiting.get()


def _listen(shared: SharedArrays, waiting: "queue.SimpleQueue[Task]") -> None:
    """Take tasks while others are done, so that none waits in the pipe; end with the page."""
    while (message := read(sys.stdin.buffer)) is not None:
        waiting.put(shared.loads(message))
    os._exit(0)


def _outcome(
    task: str, asked: AskedOfWorker, arguments: Mapping[str, object], tell: Tell
) -> tuple[str, object]:
    """What a task ends with: its result, or a sentence."""
    try:
        with fits_kept_in(asked.store):
            return "done", TASKS[task](asked, tell, **arguments)
    except Exception as error:  # noqa: BLE001  the page goes on, and says what happened
        return "failed", failure(error)
