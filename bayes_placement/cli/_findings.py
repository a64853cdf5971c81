"""What each command leaves for its report, beside its tables and figures."""

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from .._shared.files import Json
from .._shared.labels import ABOUT, AS_DRAWN
from ..criticism.check.misfit import Misfit
from ..criticism.findings.findings import Model, draws_of_result, findings, models_of
from ..criticism.fitted import in_scalars
from ..criticism.missing.ledger import Ledger
from ..criticism.missing.ranking import Ranking
from ..design.next_measurement import next_measurement
from ..experiment.experiment import Experiment, Measurements
from ..inference.alternative_explanation import draws_of
from ..inference.results import warnings_of

FINDINGS = "findings.nc"
"""Name of the file."""

BEST_DRAW = "best draw of the posterior"
"""Name of the model of an inference."""

HOW_NEXT = (
    "Where to measure next, so that these are told apart: bayes-placement place MODEL --estimator "
    "separation, or --report."
)
"""What is said where no place was searched for."""

DATA = "data"
"""What warns of the faults of a measurement."""


def of_result(
    result: Ledger | Ranking,
    experiment: Experiment,
    measurement: Measurements,
    data_faults: Sequence[str],
    *,
    with_next: bool,
) -> xr.DataTree:
    """Return what `improve` or `explain` found, for figures.

    A search for the next measurement takes some seconds.
    """
    models = models_of(result, experiment)
    sentences = result.words()
    about: Json = {
        "command": "improve" if isinstance(result, Ledger) else "explain",
        "verdict": sentences[0],
        "sentences": sentences,
        "warnings": [[DATA, fault] for fault in data_faults],
        "confounded": [list(pair) for pair in result.confounded],
    }
    if with_next:
        about["next"] = next_measurement(experiment, measurement, result.alternatives)
    draws = draws_of_result(result)
    return findings(models, draws, measurement, about, result.alternatives)


def where_next(kept: xr.DataTree, result: Ledger | Ranking) -> list[str]:
    """Say where to measure next, or how that is found, where explanations are not told apart.

    What was kept is the result of `of_result`.
    """
    if not result.confounded or len(result.alternatives) < 2:
        return []
    search = json.loads(kept.attrs[ABOUT]).get("next")
    return [HOW_NEXT if search is None else str(search["sentence"])]


def of_posterior(
    posterior: xr.DataTree,
    experiment: Experiment,
    measurement: Measurements,
    sentences: Sequence[str],
    warnings: Sequence[Sequence[str]],
    command: str,
) -> xr.DataTree:
    """Return what an inference found, for figures.

    The first sentence is the verdict; warnings are methods and what they warn of.
    """
    about = {
        "command": command,
        "verdict": sentences[0],
        "sentences": list(sentences),
        "warnings": [list(pair) for pair in warnings],
    }
    model = Model(BEST_DRAW, experiment, best_draw(experiment, posterior))
    return findings([model], draws_of(posterior) or {}, measurement, about)


def of_check(
    posterior: xr.DataTree,
    misfit: Misfit,
    experiment: Experiment,
    measurement: Measurements,
    further: Sequence[str] = (),
) -> xr.DataTree:
    """Return what `check` found, for figures, and further sentences."""
    engine = str(posterior.attrs["engine"])
    faults = set(misfit.data_faults)
    said = [sentence for sentence in misfit.words() if sentence not in faults] + [*further]
    warned = [[engine, sentence] for sentence in warnings_of(posterior)]
    warned += [[DATA, fault] for fault in misfit.data_faults]
    return of_posterior(posterior, experiment, measurement, said, warned, "check")


def of_models(kept: xr.DataTree, word: str) -> dict[str, xr.Dataset]:
    """Return what was kept of each model, by its name, of responses first as drawn.

    The word is `fit` for responses, `modes` where modes were measured.
    """
    names = json.loads(kept.attrs[ABOUT])["models"]
    groups = {AS_DRAWN: f"{word}_drawn"} if word == "fit" else {}
    groups |= {name: f"{word}_{number}" for number, name in enumerate(names)}
    return {n: kept[group].to_dataset() for n, group in groups.items() if group in kept.children}


def best_draw(experiment: Experiment, posterior: xr.DataTree) -> dict[str, float]:
    """Values of all unknowns at the draw of greatest likelihood, elements of arrays one by one.

    Positions that the inference integrated, and did not draw, are where they were recorded.
    """
    total = posterior["sample_stats"].to_dataset()["log_likelihood_total"].values
    chain, draw = np.unravel_index(int(np.nanargmax(total)), total.shape)
    drawn = posterior["posterior"].to_dataset().data_vars.items()
    values = {str(name): draws.values[chain, draw] for name, draws in drawn}
    return in_scalars(experiment.nominal_values() | values)
