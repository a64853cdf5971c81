"""What a run found, as one tree of labelled arrays: all that its report draws."""

import json
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..._shared.labels import ABOUT, AS_DRAWN
from ...experiment.experiment import Experiment, Measurements
from ...experiment.modal_parameters import ModalParameters
from ...experiment.prior_draws import draws_from_priors
from ...inference.alternative_explanation import Alternative, JointDraws
from ...inference.results import named_draws
from ..fitted import in_scalars
from ..fitted_modes import fitted_modes
from ..missing.ledger import NOTHING, Ledger
from ..missing.ranking import Ranking
from ._fits import fit, peaks_of_fits
from ._places import outline_of, places, shapes
from ._set_up import moved_in_words, set_up, shown_unknowns, with_bounds

MOST_DRAWS = 1000
"""Draws, at most, that are kept of the prior and of the posterior."""


class Model(NamedTuple):
    """A model with values of its unknowns, elements of arrays one by one; figures name it."""

    name: str
    experiment: Experiment
    values: Mapping[str, float]


def models_of(result: Ledger | Ranking, experiment: Experiment) -> list[Model]:
    """Return the model as given and, fitted, that with all effects that a search named."""
    if isinstance(result, Ledger):
        first, last = result.steps[0], result.steps[-1]
    else:
        first = next((step for step in result.steps if not step.effects), result.steps[0])
        last = result.steps[0]
    steps = [first, last] if last.effects and last is not first else [last]
    return [Model(step.label, step.experiment or experiment, step.values) for step in steps]


def draws_of_result(result: Ledger | Ranking) -> JointDraws:
    """Draws of the unknowns of the model that was named; none where it is no alternative."""
    kinds = result.verdict if isinstance(result, Ledger) else _named(result)
    name = " + ".join(kinds) or NOTHING
    return next((item.draws for item in result.alternatives if item.name == name), {})


def _named(ranking: Ranking) -> tuple[str, ...]:
    best = ranking.steps[0]
    return (best.kind,) if best.kind else ()


def findings(
    models: Sequence[Model],
    draws: JointDraws,
    measurement: Measurements,
    about: Mapping[str, object],
    alternatives: Sequence[Alternative] = (),
) -> xr.DataTree:
    """Lay out what a report shows of a run.

    The last of the models is the one that is reported; draws [draw, ...] are of its unknowns.
    Explanations other than it are named. `about` are words on the run, for JSON. The tree has
    `posterior` and `prior`, draws by name with units and roles; `fit_0` and on, what each model
    predicts with the measurement; `places`, where sensors, actuators and effects were recorded and
    are inferred; `outline` and `shapes_0` and on, mode shapes of each model. Where modes were
    measured, `modes_0` and on in the place of `fit_0`. `fit_drawn` or `modes_drawn` is of the model
    as drawn, before any fit, and `peaks` of the peaks of FRFs.
    """
    first, last = models[0].experiment, models[-1].experiment
    drawn = in_scalars(first.nominal_values())
    prior = draws_from_priors(shown_unknowns(last), 0, MOST_DRAWS)
    posterior = _shown(last, draws)
    groups = {
        "posterior": named_draws(last, _as_single_chain(posterior)),
        "prior": with_bounds(last, named_draws(last, _as_single_chain(prior))),
        "outline": outline_of(last),
    }
    if last.sensor or last.actuator or any(effect.place_fields for effect in last.effects):
        groups["places"] = places(last, prior, posterior, models[-1].values)
    as_drawn = Model(AS_DRAWN, first, drawn)
    groups |= _fits([as_drawn, *models], ["drawn", *map(str, range(len(models)))], measurement)
    for number, model in enumerate(models):
        groups[f"shapes_{number}"] = shapes(model.experiment, model.values, groups["outline"])
    tree = xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()})
    fitted = {model.name: model.values for model in models}
    words = dict(about) | {
        "models": [model.name for model in models],
        "moved": moved_in_words(shown_unknowns(first), prior, drawn, fitted),
        "set_up": set_up(first, measurement),
        "alternatives": [[item.name, item.probability] for item in alternatives],
    }
    tree.attrs[ABOUT] = json.dumps(words, allow_nan=False)
    return tree


def _shown(experiment: Experiment, draws: JointDraws) -> JointDraws:
    """Draws of all unknowns but the many errors of the model, thinned."""
    names = [unknown.name for unknown in shown_unknowns(experiment) if unknown.name in draws]
    return {name: draws[name][:: -(-len(draws[name]) // MOST_DRAWS)] for name in names}


def _as_single_chain(draws: JointDraws) -> dict[str, np.ndarray]:
    return {name: np.asarray(values)[None] for name, values in draws.items()}


def _fits(
    models: Sequence[Model], suffixes: Sequence[str], measurement: Measurements
) -> dict[str, xr.Dataset]:
    """What each model predicts with the measurement, in a group of its own, and the peaks."""
    if isinstance(measurement, ModalParameters):
        return {
            f"modes_{suffix}": fitted_modes(model.experiment, measurement, model.values)
            for model, suffix in zip(models, suffixes, strict=True)
        }
    if any(model.experiment.noise is None for model in models):
        return {}
    fits = {model.name: fit(model.experiment, measurement, model.values) for model in models}
    peaks = peaks_of_fits(fits)
    named = {f"fit_{suffix}": of for suffix, of in zip(suffixes, fits.values(), strict=True)}
    return named if peaks is None else named | {"peaks": peaks}
