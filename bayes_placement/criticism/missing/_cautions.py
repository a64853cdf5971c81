"""What to doubt in a fit: priors piled up at an edge, sizes at a bound, one start, outliers."""

from collections.abc import Iterator

import numpy as np
from scipy.special import ndtri

from ..._shared.errors import BASELINE, BEGUN_AT_MORE, SIZES_OF_ERRORS
from ..._shared.sites import Role
from ...effects.library import kind_of
from ...effects.over import OverExtent
from ...inference.engines.about_mode import SampledPosterior
from ...inference.engines.levenberg_marquardt import APART
from ...inference.estimates import scalars
from ...inference.results import outputs
from ...inference.units import percent
from ..check._edges import BOUND, EDGE, leans, sentences
from ._estimates import drawn_places, laplace
from ._hypotheses import Hypothesis
from ._outliers import p_value
from .table import AS_STATED

MOST_NAMED = 3
"""Outliers that are named."""


def cautions(hypothesis: Hypothesis, sampled: SampledPosterior | None) -> tuple[str, ...]:
    """Return one sentence for each doubt, as `check` and `engines.MAP` have them."""
    draws = None if sampled is None else sampled.points
    least = AS_STATED.piled_up * EDGE
    piled_up = [edge for edge in shares_at_edges(hypothesis, draws) if edge[-1] >= least]
    edges = sentences((*edge, EDGE) for edge in piled_up)
    return *edges, *cautions_of_fit(hypothesis)


def cautions_of_fit(hypothesis: Hypothesis) -> tuple[str, ...]:
    """Return those of the fit alone, without draws of its posterior."""
    return (
        *_one_state_of_modes(hypothesis),
        *_sizes_at_bounds(hypothesis),
        *_as_good_elsewhere(hypothesis),
        *_reached_once(hypothesis),
        *_nearly_everywhere(hypothesis),
        *_outliers(hypothesis),
    )


def shares_at_edges(
    hypothesis: Hypothesis, points: np.ndarray | None
) -> Iterator[tuple[str, str, float]]:
    """Each unknown, a side of its prior, and the share of a posterior at that edge.

    One that falls off towards the bound lies there and leans against nothing; it is left out.
    Without draws [draw, unknown] it is that of Laplace's Gaussian.
    """
    draws = laplace(hypothesis) if points is None else points
    edge, bound = -ndtri(EDGE), -ndtri(BOUND)
    problem = hypothesis.problem
    for unknown in problem.at_fixed_sizes.unknowns:
        if unknown.role is Role.MODEL_ERROR:
            continue
        coordinates = draws[None, :, problem.coordinates.places[unknown.name]]
        shape = (1, len(draws), *unknown.distribution.shape())
        for name, drawn in scalars(unknown.name, coordinates.reshape(shape)):
            for side, outwards in (("lower", -drawn), ("upper", drawn)):
                share, at_bound = np.mean(outwards > edge), np.mean(outwards > bound)
                if share > 0 and leans(share, at_bound):
                    yield name, side, float(share)


def _sizes_at_bounds(hypothesis: Hypothesis) -> Iterator[str]:
    """Sizes of the model error that are as large as their priors allow."""
    problem = hypothesis.problem
    sizes = [(each, problem.sizes[each.name]) for each in problem.unknown_sizes]
    at_edge = [
        f"{unknown.name} {size:.3g}"
        for unknown, size in sizes
        if unknown.distribution.cdf(size) >= 1 - EDGE
    ]
    if at_edge:
        then = "a larger one is no rival then, so that effects are claimed too easily"
        yield (
            f"The model error ended at the upper edge of its prior ({', '.join(at_edge)}): "
            f"{then if hypothesis.effects else 'the model is wrong by more than it allows'}. Look "
            f"at the model first; or widen that prior of {SIZES_OF_ERRORS.python}."
        )


def _one_state_of_modes(hypothesis: Hypothesis) -> Iterator[str]:
    """Say what modes of one state do not tell, where a model error alone explains them."""
    problem = hypothesis.problem
    is_one = problem.baseline is None and problem.experiment.observe.is_modal
    if is_one and hypothesis.has_errors and not hypothesis.effects:
        yield (
            "A model error explains the modes of this one state, which do not tell it from a "
            "change of the structure: a mode has one frequency, and either moves it. Give modes of "
            "an earlier state, between which and these a model error cancels: "
            f"{BASELINE.python}."
        )


def _as_good_elsewhere(hypothesis: Hypothesis) -> Iterator[str]:
    """Other places at which the data fit as well, such as mirror images."""
    fit, named = hypothesis.fit, hypothesis.problem.coordinates.named
    deviation = np.sqrt(np.diag(fit.gaussian.covariance))
    here = named(fit.point[None])
    for point in fit.elsewhere:
        there, far = named(point[None]), np.abs(point - fit.point) > APART * deviation
        differing = [
            f"{name} = {there[name].item():.4g} in the place of {here[name].item():.4g}"
            for name, place in hypothesis.problem.coordinates.places.items()
            if far[place].any() and here[name].size == 1
        ]
        if differing:
            yield (
                f"The data fit as well with {', '.join(differing)}: these channels do not tell "
                "which; measure at one more place, where the two differ."
            )


def _reached_once(hypothesis: Hypothesis) -> Iterator[str]:
    """Say so where only one of several starts ended at the best fit; sizes are found from one."""
    if hypothesis.fit.reached == 1 and len(hypothesis.near) > 1 and not hypothesis.has_errors:
        yield (
            f"Only one of {len(hypothesis.near)} starts reached the best fit, so a better one may "
            f"exist; {BEGUN_AT_MORE.python} begins at more."
        )


def _nearly_everywhere(hypothesis: Hypothesis) -> Iterator[str]:
    """Say so where a law acts all over the structure but for what is one place at each end."""
    experiment, added = hypothesis.problem.experiment, {each.name for each in hypothesis.effects}
    bounds = np.atleast_2d(np.transpose(experiment.structure.modes.bounds()))
    size = bounds[:, 1] - bounds[:, 0]
    for effect in experiment.effects:
        if not isinstance(effect, OverExtent) or effect.name not in added:
            continue
        begin, end = (np.mean(place, axis=0) for place in drawn_places(effect, hypothesis))
        share = np.min((end - begin)[size > 0] / size[size > 0])
        if share > 1 - 2 * AS_STATED.one_place:
            yield (
                f"{kind_of(effect)} acts on {percent(float(share))} of the structure: its "
                "supports, dimensions or material may be what differs from the model. Look at "
                "these first."
            )


def _outliers(hypothesis: Hypothesis) -> Iterator[str]:
    """Lines of channels that are most probably wrong, where the noise is not known."""
    problem, experiment = hypothesis.problem, hypothesis.problem.experiment
    if hypothesis.is_noise_known or experiment.observe.is_modal:
        return
    if p_value(hypothesis.with_outliers.outliers, problem.count) < AS_STATED.level:
        return  # so many are no outliers but a misfit
    present = np.asarray(problem.data.measured)  # with an earlier state, those of the later one
    probability = hypothesis.with_outliers.probability[: present.size].reshape(present.shape)
    table = outputs(experiment, {"probability": probability}, ())["probability"]
    others = [name for name in table.dims if name not in ("sensor", "actuator", "frequency")]
    least = AS_STATED.outlier
    wrong = table.max(others).where(lambda share: share > least).stack(datum=[...]).dropna("datum")
    named = [
        f"{sensor} at {frequency:.4g} Hz, driven at {actuator}"
        for sensor, actuator, frequency in wrong["datum"].values[:MOST_NAMED]
    ]
    if named:
        further = wrong.size - len(named)
        yield (
            f"Most probably outliers (probability above {least:g}): {'; '.join(named)}"
            f"{f'; and {further} more' if further else ''}. Look at these lines of the spectra; "
            "measurement.without(low, high) leaves lines out."
        )
