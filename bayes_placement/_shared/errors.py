"""Our own errors and warnings, whose sentences say all that a user needs."""

import inspect
import traceback
import types
import warnings


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
