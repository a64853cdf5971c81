"""Fits that `explain` and `improve` of the same data have in common, made once.

Those of the last question stay. They are taken only for the same experiment, data, candidates and
model error, leaf by leaf and class by class, so that they are what would be fitted again.
"""

import functools
from typing import Any

import jax
import numpy as np

from ..._shared.parts import executor_of_parts, nothing
from ..._shared.processes import import_in_helpers
from ...effects.library import Library
from ...experiment.experiment import Experiment
from ...experiment.model_error import ModalErrors
from ...experiment.noise import Data
from ...inference.chi2 import LEVEL
from ...inference.engines.empirical_bayes import Rival
from ._fits_with_errors import fitted_with_errors_in_processes
from ._hypotheses import NO_RIVAL, Hypothesis, null_hypothesis
from ._more_effects import single_effects, with_channels
from ._networks import LawsBeside, with_networks, with_networks_of_many
from ._posterior_odds import Comparison, explains, passes
from ._scanned_candidates import Tick


class SharedFits:
    """Fits of one question, of an experiment without its model error.

    A model error that is declared is that with which the experiment was given, so that all are
    fitted with it.
    """

    def __init__(
        self,
        experiment: Experiment,
        data: Data,
        tried: Library[Experiment],
        errors: ModalErrors | None,
        declared: bool = False,
    ):
        self.content = (experiment, data, tried.effects, tried.networks, errors, declared)
        self._singles: Comparison | None = None
        self._with_errors: dict[tuple[Hypothesis, Rival], Hypothesis] = {}

    @functools.cached_property
    def null(self) -> Hypothesis:
        """The model as given."""
        if executor_of_parts() is None:
            import_in_helpers(__name__)
        experiment, data, *_ = self.content
        return null_hypothesis(experiment, data)

    def singles(self, tick: Tick) -> Comparison:
        """The model as given, first, and every candidate alone."""
        _, _, effects, networks, _, declared = self.content
        if self._singles is None:
            null = self.null
            last = [effect for effect in effects if effect.tried_last]
            first = [effect for effect in effects if not effect.tried_last]
            laws = LawsBeside(null, tick) if networks else None
            singles = single_effects(null, first, tick, nothing if laws is None else laws.look)
            singles = singles if laws is None else with_networks(singles, laws)
            singles = with_channels(singles, LEVEL, needs_all=declared)
            if last and not (first and explains(singles.best(), LEVEL)):
                singles = singles.joined(single_effects(null, last, tick))
            singles = singles if laws is None else with_networks_of_many(singles, laws)
            self._singles = singles
        return self._singles

    def with_errors(
        self, *exact: Hypothesis, rival: Rival = NO_RIVAL, leading: bool = False
    ) -> list[Hypothesis]:
        """Hypotheses with the model error; those that stay far behind a rival are given up.

        Leading ones, and those of several effects, are few: they are also fitted from a fit of
        fewer effects that fails its check.
        """
        *_, errors, _ = self.content
        assert errors is not None
        asked = dict.fromkeys(exact)  # the best hypothesis may be the one without effects
        unknown = [each for each in asked if (each, rival) not in self._with_errors]
        given = [self._of_fewer_effects(each, leading) for each in unknown]
        fits = fitted_with_errors_in_processes(unknown, errors, rival, given)
        self._with_errors |= {(each, rival): fit for each, fit in zip(unknown, fits, strict=True)}
        return [self._with_errors[each, rival] for each in exact]

    def _of_fewer_effects(self, exact: Hypothesis, leading: bool) -> Hypothesis | None:
        """The best fit with the model error of a part of the effects, as far as it is asked for."""
        effects = {id(effect) for effect in exact.effects}
        parts = [
            fit
            for (part, _), fit in self._with_errors.items()
            if {id(effect) for effect in part.effects} < effects
        ]
        best = max(parts, key=lambda each: each.fit.log_evidence, default=None)
        is_asked_for = leading or len(exact.effects) > 1 or (best and passes(best, LEVEL))
        return best if is_asked_for else None


_LAST: list[SharedFits] = []
"""Fits of the last question, or none."""


def shared_fits(*content: Any) -> SharedFits:
    """Return the fits of a question: those that are there, or none yet. See `SharedFits`."""
    fits = SharedFits(*content)
    for last in _LAST:
        if _same(last.content, fits.content):
            return last
    _LAST[:] = [fits]
    return fits


def _same(tree: object, other: object) -> bool:
    """Whether two trees are alike in structure, classes, numbers and all else."""
    parts: list[Any] = [jax.tree.flatten(content) for content in (tree, other)]
    (leaves, structure), (other_leaves, other_structure) = parts
    return bool(structure == other_structure) and all(map(_same_leaf, leaves, other_leaves))


def _same_leaf(leaf: object, other: object) -> bool:
    if leaf is other:
        return True
    kinds = (np.ndarray, jax.Array, np.generic, float, int, complex)
    if not isinstance(leaf, kinds) or not isinstance(other, kinds):
        return False  # whatever it is, it may have changed
    first, second = np.asarray(leaf), np.asarray(other)
    return first.dtype == second.dtype and np.array_equal(first, second)
