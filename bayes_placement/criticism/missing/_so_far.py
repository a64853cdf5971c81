"""The best hypothesis of a search while it runs, told each time that it is another one."""

from collections.abc import Callable
from dataclasses import replace

from ._hypotheses import Hypothesis
from ._posterior_odds import Comparison
from ._unknown_noise import noise_needed
from .fitted_model import FittedModel, fitted_model

Seen = Callable[[Comparison], None]
"""Called with what has been compared so far."""

Callback = Callable[[FittedModel], None]
"""Called with the best model so far."""


def no_callback(model: FittedModel) -> None:
    """Tell nobody."""


def nothing_seen(comparison: Comparison) -> None:
    """Look at nothing."""


class BestSoFar:
    """Tells the best hypothesis so far, laid out, whenever it is another one."""

    def __init__(self, callback: Callback):
        self._callback = callback
        self._told: Hypothesis | None = None

    def __call__(self, comparison: Comparison) -> None:
        """Look at what has been compared."""
        best = comparison.best()
        if self._callback is not no_callback and best is not self._told:
            self._told = best
            model = fitted_model(best, {}, in_full=False)
            self._callback(replace(model, noise_needed=noise_needed(best)))
