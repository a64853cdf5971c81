"""Our own errors, warnings and advice, whose sentences say all that a user needs."""

import inspect
import re
import traceback
import types
import warnings
from typing import NamedTuple


class PackageError(Exception):
    """An error that this package raises: its sentence says all that a user needs."""


class InputError(PackageError, ValueError):
    """What was given, what is needed, why, and the line that fixes it."""


class UsageError(InputError):
    """A command that was typed wrongly, whatever the model and the data are."""


class InfeasibleError(InputError):
    """A method that cannot treat this experiment, where another one can."""


class MissingExtraError(PackageError, ImportError):
    """A library that is not installed, and the extra of this package that brings it."""


class NumericalError(PackageError, ArithmeticError):
    """A factorisation or an iteration whose result cannot be trusted."""


class WritingError(PackageError, OSError):
    """A file that the system does not let be written."""


class WorkerError(PackageError, RuntimeError):
    """A worker process that was lost, or that cannot read what it was sent."""


OURS = __name__.split(".")[0]
"""Name of this package."""


def warn(sentence: str, category: type[Warning] = UserWarning) -> None:
    """Warn of something, at the line that called this package."""
    callers = [frame for frame, _ in traceback.walk_stack(inspect.currentframe())]
    inside = [_is_ours(frame) for frame in callers]
    warnings.warn(sentence, category, stacklevel=len(callers) - inside[::-1].index(True) + 1)


def _is_ours(frame: types.FrameType) -> bool:
    return str(frame.f_globals.get("__name__")).split(".")[0] == OURS


class Advice(NamedTuple):
    """One piece of advice; sentences hold its Python, for which the command line has a command."""

    python: str
    command: str


SAMPLED = Advice(
    "bp.infer(ledger.experiment, measurement, engine=bp.engines.SMC())",
    "improve --save new.py, then bayes-placement update new.py --engine smc,",
)
BEGUN_AT_MORE = Advice(
    "check(infer(..., engine=bp.engines.MAP(starts=128)))",
    "engine = bp.engines.MAP(starts=128) in the model file",
)
SIZES_OF_ERRORS = Advice("model_error=bp.model_error.Embedded()", "model_error in the model file")
BASELINE = Advice("baseline=before", "--baseline before.uff")
SMC = Advice("engines.SMC()", "bayes-placement update --engine smc")
MORE_STARTS = Advice("MAP(starts=128)", "engine = bp.engines.MAP(starts=128) in the model file")
MORE_NODES = Advice("Grid(nodes=96)", "engine = bp.engines.Grid(nodes=96) in the model file")

COMMANDS = dict((SAMPLED, BEGUN_AT_MORE, SIZES_OF_ERRORS, BASELINE, SMC, MORE_STARTS, MORE_NODES))
"""Command in the place of each line of Python; of two that begin alike the longer comes first."""


def in_commands(sentence: str) -> str:
    """Return a sentence with its advice in commands, or in a line of the model file."""
    lines = "|".join(map(re.escape, COMMANDS))
    return re.sub(rf"(?<![.\w])(?:{lines})", lambda found: COMMANDS[found[0]], sentence)
