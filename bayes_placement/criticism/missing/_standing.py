"""How what is claimed stands: its doubts, where the model fails, and what was nearest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from ...modes.finite_elements.nodal_modes import nodal_of
from ._hypotheses import Hypothesis
from ._model_error_choice import Answer
from ._posterior_odds import Comparison
from ._unknown_noise import noise_needed
from ._where_it_fails import where_it_fails
from .decide import FAILS, Decision, Doubt
from .fitted_model import FittedModel, Sampled, fitted_model

NO_REGIONS = (
    "No loss of stiffness was tried, as of a loose joint, since the finite element model names no "
    'regions: finite_elements.Matrices(..., regions={"joint": stiffness of its elements}). Joints '
    "of a frame of beam elements are tried by themselves where they are at most 60, and else by "
    "finite_elements.modes(..., joints=finite_elements.joints(matrices))."
)
"""What is said where a finite element model fails and has neither regions nor joints."""

ONLY_JOINTS = (
    "No loss of stiffness within a member was tried, as of a crack, since the finite element model "
    'names no regions: finite_elements.Matrices(..., regions={"crack": stiffness of its elements}).'
)
"""What is said where it has joints, but no regions."""


@dataclass(frozen=True)
class Standing:
    """How a verdict stands.

    `exact_fails` says that the model as given, without model error, fails its check; not with an
    earlier state. Doubts are of each effect of the best hypothesis, by its name. `where` says where
    the best model fails, or where that does not, the exact one. `nearest` is the best candidate,
    where none is claimed and there is any.
    """

    exact_fails: bool = False
    doubts: Mapping[str, tuple[Doubt, ...]] = field(default_factory=lambda: MappingProxyType({}))
    where: str = ""
    nearest: FittedModel | None = None
    untried: str = ""

    def doubts_of(self, names: Sequence[str]) -> list[str]:
        """Doubts of effects of these names in words, each once, but that the check fails."""
        doubts = (doubt.words for name in names for doubt in self.doubts.get(name, ()))
        return [words for words in dict.fromkeys(doubts) if words != FAILS]

    def probability_of_any(self, name: str, none: float) -> float:
        """Probability that any of the candidates for an effect is right.

        The least of all limits: their product would count a misfit twice.

        `none` is the probability of none of the candidates.
        """
        limits = [doubt.probability for doubt in self.doubts.get(name, ())]
        return min([1 - none, *limits])


def standing(answer: Answer, decision: Decision, sampled: Sampled) -> Standing:
    """Say how what is claimed stands."""
    best = answer.claimed(decision)[-1]
    exact = answer.null if decision.exact_fails and not decision.kinds else None
    failing = best if decision.unexplained else exact
    return Standing(
        exact_fails=decision.exact_fails,
        doubts=decision.doubts,
        where="" if failing is None else where_it_fails(failing),
        nearest=None if decision.kinds else _nearest(answer.comparison, sampled),
        untried="" if failing is None else _untried(failing),
    )


def _untried(hypothesis: Hypothesis) -> str:
    """Say which loss of stiffness was not tried in a finite element model without regions."""
    nodal = nodal_of(hypothesis.problem.experiment.structure.modes)
    if nodal is None or nodal.regions.names:
        return ""
    return ONLY_JOINTS if nodal.static_shapes.joints else NO_REGIONS


def _nearest(comparison: Comparison, sampled: Sampled) -> FittedModel | None:
    """The best candidate, laid out; None without one."""
    best = next((each for each in comparison.distinct() if each.effects), None)
    if best is None:
        return None
    return replace(fitted_model(best, sampled, in_full=False), noise_needed=noise_needed(best))
