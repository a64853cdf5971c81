"""Two states of one structure, and what the later one has that the earlier one had not.

All that is unknown is shared, model error included: what the model does not know cancels.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..._shared.errors import InputError
from ...effects.amplitude_attachment import can_act_together
from ...effects.effect import Effect
from ...effects.library import Library, kind_of
from ...experiment.experiment import Experiment, Measurements
from ...experiment.modal_parameters import ModalParameters
from ...experiment.model_error import ModalErrors
from ...experiment.variants import as_measured
from ...inference.engines.empirical_bayes import DECREASING_ERRORS, Rival
from ...inference.residuals import Problem
from ...inference.residuals_of_state import State
from ..kept_fits import NO_RIVAL, kept_with_sizes
from ._errors_as_identified import given_with_errors
from ._fitted_candidates import extended, fits_against, only_scanned
from ._hypotheses import Hypothesis, finite, null_hypothesis, rival_among, takes_long
from ._more_effects import AT_FIRST, NARROW, VARIANTS_WITH_ERRORS
from ._networks import LawsBeside, laws_beside_best, with_networks, with_other_laws
from ._posterior_odds import Comparison, explains, passes, wants_more_effects
from ._predicted_odds import worth_fitting
from ._repeated import may_be_added, named_alike
from ._scanned_candidates import ScannedCandidate, Tick, promising
from ._simpler_laws import with_simpler_laws
from ._so_far import Seen


def state_of(experiment: Experiment, measurement: Measurements) -> State:
    """An earlier state of an experiment, with the lines and transducers that were measured."""
    if isinstance(measurement, ModalParameters) != experiment.observe.is_modal:
        raise InputError(
            "An earlier state was given with modal parameters, and the later one with FRFs, or the "
            "other way round; the same is needed of both, since what the model does not know has "
            "to cancel. Give modal parameters of both, with observe=observe.ModalData(later), "
            "or FRFs."
        )
    if isinstance(measurement, Sequence) and not measurement:
        raise InputError(
            "baseline=[] was given; one measurement is needed, or one for each force level, since "
            "the later state is compared with it. Leave it out where there is none: baseline=None."
        )
    first = measurement[0] if isinstance(measurement, Sequence) else measurement
    earlier = as_measured(experiment, first)
    observed = earlier.observe.own_data()
    return State(earlier, earlier.data(measurement) if observed is None else observed)


def fitted_baseline(baseline: State, errors: ModalErrors | None) -> Hypothesis:
    """The model fitted to the earlier state alone, with model error where there is one."""
    exact = null_hypothesis(baseline.experiment.with_errors(None), baseline.data)
    return exact if errors is None else given_with_errors(exact, errors)


def compared_with_baseline(
    later: State,
    earlier: State,
    before: Hypothesis,
    tried: Library[Experiment],
    level: float,
    most_effects: int,
    tick: Tick,
    seen: Seen,
) -> tuple[Hypothesis, Comparison]:
    """Fit every effect to the later state, and all else to both.

    `before` is the model fitted to the earlier state alone; its model error is that of the states.
    The level is the probability that a correct model fails its check; `most_effects` are new.
    `tick` is called after each part of the work, `seen` with what has been compared so far. The
    model of the earlier state against the data of both comes first.
    """
    unchanged = over_both(later, earlier, before)
    variants = dict(Counter(map(kind_of, tried.effects)))
    first = [effect for effect in tried.effects if not effect.tried_last]
    last = [effect for effect in tried.effects if effect.tried_last]
    comparison = _singles(unchanged, first or last, variants, level, tick, seen)
    null = comparison.of(())
    if first and last and not explains(comparison.best(), level):
        candidates = only_scanned([(unchanged, effect) for effect in last], tick)
        comparison = comparison.with_hypotheses(_fitted(comparison, candidates, level))
        comparison = comparison._replace(candidates=[*comparison.candidates, *candidates])
    comparison = with_simpler_laws(comparison)
    if tried.networks:
        comparison = with_networks(comparison, LawsBeside(null, tick, unchanged))
    seen(comparison)
    for depth in range(1, most_effects):
        if not wants_more_effects(comparison, depth, level):
            break
        # Of two effects at once, the place of the first may be wrong without the second: each of
        # the best is extended by the others, the same kinds in either order.
        branches = [h for h in comparison.distinct() if len(h.effects) == depth]
        pairs = [
            (branch, effect)
            for branch in branches[: NARROW.branches]
            for effect in _next_best(comparison, branch)
        ]
        comparison = comparison.with_hypotheses(extended([[pair] for pair in pairs], tick))
        if tried.networks and wants_more_effects(comparison, depth, level):
            beside = laws_beside_best(comparison, depth, tick)
            comparison = comparison if beside is None else with_networks(comparison, beside)
        comparison = with_other_laws(comparison, tick)
        seen(comparison)
    return unchanged, comparison


def _singles(
    unchanged: Hypothesis,
    effects: Sequence[Effect],
    variants: dict[str, int],
    level: float,
    tick: Tick,
    seen: Seen,
) -> Comparison:
    """Nothing new, and each of some effects: the most promising variants of each kind."""
    candidates = only_scanned([(unchanged, effect) for effect in effects], tick)
    chosen = promising(candidates, VARIANTS_WITH_ERRORS)
    best = fits_against(chosen[:AT_FIRST], NO_RIVAL)
    # The misfit without any effect is reported, so that it is fitted further than a mere rival.
    rival = rival_among(best)._replace(with_small_error=-np.inf, evidence=-np.inf)
    null = nothing_new(unchanged, rival)
    comparison = Comparison([null, *finite(best)], variants, candidates)
    seen(comparison)
    return comparison.with_hypotheses(_fitted(comparison, chosen[AT_FIRST:], level))


def _fitted(
    comparison: Comparison, candidates: Sequence[ScannedCandidate], level: float
) -> list[Hypothesis]:
    """Fits of single effects that were scanned, those far behind the best given up."""
    chosen = _worth_fitting(comparison, promising(candidates, VARIANTS_WITH_ERRORS), level)
    return finite(fits_against(chosen, rival_among(comparison.hypotheses)))


def refitted_effects(
    comparison: Comparison, between: Hypothesis, most_effects: int
) -> list[Hypothesis]:
    """Fit the effects of a state in between once more, from where they were found there.

    Alone, and with what the best hypothesis has besides: a scan of one effect after the other may
    miss the place of one that acts together with another.

    `between` was claimed in that state; `most_effects` are new since the baseline.
    """
    fits: dict[tuple[str, ...], Hypothesis] = {}
    for found in (comparison.hypotheses[0], comparison.best()):
        partner = named_alike(found, between)
        known = {effect.name for effect in between.effects}
        new_effects = [effect for effect in partner.effects if effect.name not in known]
        effects = (*between.effects, *new_effects)
        if not can_act_together(effects):
            continue
        kinds = tuple(kind_of(effect) for effect in effects)
        if between.effects and len(effects) <= most_effects and kinds not in fits:
            fits[kinds] = _from_both(comparison.hypotheses[0], partner, between, effects)
    return finite(fits.values())


def _from_both(
    null: Hypothesis, partner: Hypothesis, between: Hypothesis, effects: tuple[Effect, ...]
) -> Hypothesis:
    """Fit effects of which some were found in a state in between, and others by a partner."""
    problem = null.problem
    for effect in effects:
        problem = problem.with_effect(effect)
    starts = [
        first.point_in(problem, second.point_in(problem))
        for first, second in ((partner, between), (between, partner))
    ]
    sized = kept_with_sizes(problem, np.stack(starts), DECREASING_ERRORS[-2:])
    return replace(null, effects=effects, **vars(sized))


def _next_best(comparison: Comparison, branch: Hypothesis) -> list[Effect]:
    """The single effects of greatest odds of other kinds, and one more of a kind that it has.

    What takes long is added to the best hypothesis alone.
    """
    singles = sorted(comparison.hypotheses, key=comparison.log_odds, reverse=True)
    is_best = branch is comparison.best()
    candidates: dict[str, Effect] = {}
    for single in singles:
        if len(single.effects) != 1 or single.kinds[0] in comparison.networks:
            continue
        if takes_long(single) and not is_best:
            continue
        if may_be_added(*single.effects, single.problem, branch):
            candidates.setdefault(single.kinds[0], single.effects[0])
    others = [kind for kind in candidates if kind not in branch.kinds][: NARROW.kinds]
    return [candidates[kind] for kind in candidates if kind in (*others, *branch.kinds)]


def over_both(later: State, earlier: State, before: Hypothesis) -> Hypothesis:
    """The fit of the earlier state as a point of the problem of both, in which nothing is new."""
    problem = Problem(later.experiment, later.data, sizes=before.problem.sizes, baseline=earlier)
    point = before.point_in(problem)
    return replace(before, effects=(), problem=problem, fit=before.fit._replace(point=point))


def nothing_new(unchanged: Hypothesis, rival: Rival = NO_RIVAL) -> Hypothesis:
    """The model fitted to both states, see `over_both`; given up far behind a rival."""
    sized = kept_with_sizes(
        unchanged.problem, unchanged.fit.point[None], DECREASING_ERRORS[-2:], rival
    )
    return replace(unchanged, **vars(sized))


def _worth_fitting(
    comparison: Comparison, candidates: list[ScannedCandidate], level: float
) -> list[ScannedCandidate]:
    """Single effects to be fitted: where both states agree, those that may still be new."""
    null = comparison.of(())
    if not passes(null, level):
        return candidates
    at_best_places = [_at_best_place(null, candidate) for candidate in candidates]
    promising_hypotheses = worth_fitting(null, comparison, at_best_places)
    return [candidates[at_best_places.index(hypothesis)] for hypothesis in promising_hypotheses]


def _at_best_place(null: Hypothesis, candidate: ScannedCandidate) -> Hypothesis:
    """An effect where the scan sees it, as a hypothesis that is not fitted."""
    fit = null.fit._replace(point=candidate.best_places(1)[0])
    return replace(null, effects=(candidate.effect,), problem=candidate.problem, fit=fit)
