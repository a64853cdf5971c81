"""How what is claimed stands: its doubts, where the model fails, and what was nearest."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from ...effects.effect import Effect
from ...inference.chi2 import LEVEL
from ..check._edges import EDGE
from ._cautions import piled_up
from ._held_out import gain_held_out
from ._hypotheses import Hypothesis
from ._posterior_odds import Comparison, p_value
from ._unknown_noise import noise_needed
from ._where_it_fails import where_it_fails
from .fitted_model import FittedModel, Sampled, fitted_model

FAILS = "the model still fails its check"
"""A doubt that a verdict says by itself."""


class Doubt(NamedTuple):
    """Why a claim may be wrong although no candidate explains the data better.

    Parameters
    ----------
    words
        The reason, after "but".
    p_value
        Probability of as much reason for doubt where the claim is right.
    """

    words: str
    p_value: float

    @property
    def probability(self) -> float:
        """Probability that the claim is right, even odds before.

        -e p log p is the least Bayes factor of a p-value: Sellke, Bayarri and Berger, American
        Statistician 55 (2001), doi:10.1198/000313001300339950.
        """
        p = float(np.clip(self.p_value, np.finfo(float).tiny, np.exp(-1.0)))
        factor = -np.exp(1.0) * p * np.log(p)
        return float(factor / (1 + factor))


@dataclass(frozen=True)
class Standing:
    """How a verdict stands.

    Parameters
    ----------
    exact_fails
        Whether the model as given, without model error, fails its check; not with an earlier state.
    doubts
        Doubts of each effect of the best hypothesis, by its name.
    where
        Where the best model fails, or where that does not, the exact one; empty where neither does.
    nearest
        The best candidate, where none is claimed and there is any.
    """

    exact_fails: bool = False
    doubts: Mapping[str, tuple[Doubt, ...]] = field(default_factory=lambda: MappingProxyType({}))
    where: str = ""
    nearest: FittedModel | None = None

    def doubts_of(self, names: Sequence[str]) -> list[str]:
        """Doubts of effects of these names in words, each once, but that the check fails."""
        doubts = (doubt.words for name in names for doubt in self.doubts.get(name, ()))
        return [words for words in dict.fromkeys(doubts) if words != FAILS]

    def probability_of_any(self, name: str, none: float) -> float:
        """Probability that any of the candidates for an effect is right.

        The least of all limits: their product would count a misfit twice.

        Parameters
        ----------
        name
            Name of the effect.
        none
            Probability of none of the candidates.
        """
        limits = [doubt.probability for doubt in self.doubts.get(name, ())]
        return min([1 - none, *limits])


def standing(
    comparison: Comparison,
    way: Sequence[Hypothesis],
    exact: Hypothesis | None,
    sampled: Sampled,
    level: float = LEVEL,
) -> Standing:
    """Say how the last hypothesis of a way stands.

    Parameters
    ----------
    comparison
        All hypotheses.
    way
        From the model as given to what is claimed, with one more effect each time.
    exact
        The model as given without model error; None with an earlier state.
    sampled
        Hypotheses that were sampled.
    level
        Probability that a correct model fails its check.
    """
    best = way[-1]
    failing = [each for each in (best, exact) if each is not None and p_value(each) < level]
    return Standing(
        exact_fails=exact is not None and p_value(exact) < level,
        doubts={each.name: tuple(_doubts(each, way, sampled, level)) for each in best.effects},
        where=where_it_fails(failing[0]) if failing and not _is_claim(best, failing[0]) else "",
        nearest=None if best.effects else _nearest(comparison, sampled),
    )


def _is_claim(best: Hypothesis, failing: Hypothesis) -> bool:
    """Whether an effect explains what fails without it."""
    return bool(best.effects) and failing is not best


def _nearest(comparison: Comparison, sampled: Sampled) -> FittedModel | None:
    """The best candidate, laid out; None without one."""
    best = next((each for each in comparison.distinct() if each.effects), None)
    if best is None:
        return None
    return replace(fitted_model(best, sampled, in_full=False), noise_needed=noise_needed(best))


def _doubts(
    effect: Effect, way: Sequence[Hypothesis], sampled: Sampled, level: float
) -> Iterator[Doubt]:
    best = way[-1]
    posterior = sampled.get(id(best))
    for name, side, share in piled_up(best, None if posterior is None else posterior.points):
        if name.partition("[")[0] in _sizes(effect, best):
            # By Markov's inequality a right prior leaves so much at an edge as seldom.
            yield Doubt(f"its size sits at the {side} edge of its prior", EDGE / share)
    number = next(n for n, each in enumerate(way) if effect.name in _names(each))
    gain, error = gain_held_out(way[number], way[max(0, number - 1)])
    if gain < -2 * error < 0:
        yield Doubt("held-out data are predicted worse with it", float(ndtr(gain / error)))
    if p_value(best) < level:
        yield Doubt(FAILS, p_value(best))


def _names(hypothesis: Hypothesis) -> set[str]:
    return {effect.name for effect in hypothesis.effects}


def _sizes(effect: Effect, hypothesis: Hypothesis) -> set[str]:
    """Names of the unknowns that say how large an effect is: its strength, or those of its law."""
    unknowns = hypothesis.problem.experiment.unknowns_of(effect)
    fields = {effect.absent[0], "law"}
    return {unknown.name for unknown in unknowns if unknown.field in fields}
