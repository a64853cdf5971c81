"""Model errors as the FRFs alone have them, where a fit with a model error begins.

A resonance that is off by many bandwidths leaves residuals flat, logarithms of them too, and of two
close ones a descent takes the wrong one. Modes that are identified without a model, paired with
those of the model by shape and frequency, say at once how far each is off.

A hypothesis fitted without a model error comes in, the same with one goes out. What else is
compared with it is not known here.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..._shared.errors import InputError
from ...experiment.experiment import Experiment
from ...experiment.identification import identified
from ...experiment.measurement import Measurement
from ...experiment.modal_parameters import DAMPING, FREQUENCY
from ...experiment.model_error import ModalErrors
from ...experiment.noise import Data
from ...experiment.observe import Complex
from ...experiment.variants import observing_modes
from ...inference.engines.empirical_bayes import (
    DECREASING_ERRORS,
    SHORT,
    Rival,
    bounds_of_log,
)
from ...inference.engines.levenberg_marquardt import LARGEST
from ...inference.estimates import Number
from ...inference.residuals import Problem
from ..fitted_modes import modes_of_model
from ..kept_fits import kept_with_sizes
from ._hypotheses import Hypothesis, decreasing_errors, problem_with_errors, with_errors
from ._scanned_candidates import weakened

ROWS = {"frequency": FREQUENCY, "damping": DAMPING}
"""Errors that a mode has once, and the row of modal parameters that says them."""


class _Off(NamedTuple):
    """How far modes of a model are off: logarithms of measured over computed, by row."""

    number: Int[np.ndarray, "mode"]
    logs: Float[np.ndarray, "row mode"]


def given_with_errors(exact: Hypothesis, errors: ModalErrors) -> Hypothesis:
    """Fit the model as given with a model error, which begins as identified or at zero.

    The better of the two; that from zero is given up where it stays far behind.
    """
    begin = _as_identified(exact, problem_with_errors(exact, errors))
    if begin is None:
        return with_errors(exact, errors)
    decreasing = decreasing_errors(begin.problem, DECREASING_ERRORS)
    found = kept_with_sizes(begin.problem, begin.point[None], decreasing)
    from_zero = with_errors(exact, errors, found.as_rival)
    if from_zero.fit.log_evidence >= found.fit.log_evidence:
        return from_zero
    return replace(from_zero, **vars(found))


def refitted_from_given(
    exact: Hypothesis, found: Hypothesis, given: Hypothesis, rival: Rival
) -> Hypothesis:
    """Return the fit of effects with a model error, or one that begins at that of other effects.

    It is fitted there where it is worse. What those do not have begins as weak effects, and as they
    are where the model is exact.
    """
    if found.fit.log_evidence > given.fit.log_evidence - SHORT:
        return found
    problem = found.problem.at_sizes(given.problem.sizes)
    as_exact = given.point_in(problem, exact.point_in(problem))
    known, weak = {effect.name for effect in given.effects}, as_exact
    for effect in exact.effects:
        weak = weak if effect.name in known else weakened(weak, effect, problem)
    decreasing = decreasing_errors(problem, DECREASING_ERRORS[-2:])
    sized = kept_with_sizes(problem, np.stack([weak, as_exact]), decreasing, rival)
    return max(found, replace(found, **vars(sized)), key=lambda each: each.fit.log_evidence)


class _Begin(NamedTuple):
    """A problem with a model error at sizes that suit a point, and the point."""

    problem: Problem
    point: Float[np.ndarray, "unknown"]


def _as_identified(exact: Hypothesis, problem: Problem) -> _Begin | None:
    """Where the model error of a problem begins; None where no mode is identified."""
    off = _modes_off(exact)
    if off is None:
        return None
    sizes, point = dict(problem.sizes), np.zeros(problem.dimension)
    point[: exact.problem.dimension] = exact.fit.point  # errors are the last unknowns
    for word, row in ROWS.items():
        place = problem.coordinates.places.get(f"model_error.{word}.standard")
        if place is None:
            continue
        errors = np.zeros(place.stop - place.start)
        # A mode above those with errors has none, and one without damping no logarithm of it.
        known = np.flatnonzero((off.number <= len(errors)) & np.isfinite(off.logs[row]))
        if not known.size:
            continue
        errors[off.number[known] - 1] = off.logs[row, known]
        size = _size(problem, word, off.logs[row, known])
        sizes |= {name: size for name in sizes if name == f"model_error.{word}.size"}
        point[place] = np.clip(errors / size, -LARGEST, LARGEST)
    return _Begin(problem.at_sizes(sizes), point)


def _modes_off(exact: Hypothesis) -> _Off | None:
    """How far modes of a fitted model are off, those of which it is known which they are."""
    problem = exact.problem
    experiment, data, _ = problem.states[0]
    if not isinstance(experiment.observe, Complex) or experiment.force_levels is not None:
        return None
    named = problem.coordinates.named(exact.fit.point[None])
    try:
        modes = identified(_measurement(experiment, data), "sensors").modes
        modal = observing_modes(experiment, modes)
        of_model = modes_of_model(modal.fix(_values(named, modal)))
    except InputError:  # no peak, or shapes at too few sensors to tell which mode is which
        return None
    measured = np.stack([modes.natural_frequency, modes.damping_ratio])
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(measured / of_model.values[: len(ROWS)])
    return _Off(np.asarray(of_model.number), logs)


def _measurement(experiment: Experiment, data: Data) -> Measurement:
    """FRFs as data have them; those of which lines are missing were not measured."""
    frf = np.asarray(data.z[:, :, 0] + 1j * data.z[:, :, 1])
    complete = np.all(data.measured, axis=(2, 3), keepdims=True)[..., 0]
    return Measurement.from_arrays(
        np.where(complete, frf, np.nan),
        experiment.frequency,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity=experiment.observe.quantity,
    )


def _values(named: Mapping[str, np.ndarray], modal: Experiment) -> dict[str, Number]:
    return {name: named[name][0] for name in modal.unknown}


def _size(problem: Problem, word: str, errors: np.ndarray) -> float:
    """Size of such errors: stated, or their root mean square within the support of its prior."""
    unknown = problem.experiment.unknown.get(f"model_error.{word}.size")
    if unknown is None:
        return float(getattr(problem.experiment.model_error, word).size)
    low, high = np.exp(bounds_of_log(unknown))
    return float(np.clip(np.sqrt(np.mean(errors**2)), low, high))
