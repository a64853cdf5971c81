"""Estimators of information by their names, with what earlier data tell them."""

from collections.abc import Callable
from typing import Any

from .._shared.errors import InputError
from .._shared.progress import Progress
from ..criticism.missing.improve import improve
from ..design import information
from ..design.information.estimator import Estimator
from ..effects import library
from ..experiment.experiment import Experiment, Measurements
from ..inference import cross_check
from ..inference.results import warnings_of
from ..io.model import Study
from ._posterior import infer_posterior

ESTIMATORS: dict[str, Callable[..., Any]] = {
    "kernel-gain": information.KernelGain,
    "exact": information.Exact,
    "expected-gain": information.ExpectedGain,
    "separation": information.Separation,
}


def named_estimator(
    name: str,
    study: Study,
    measurement: Measurements | None,
    seed: int,
    begin: Callable[[], Progress],
) -> tuple[Estimator, list[str]]:
    """Return an estimator and the warnings of the inference from earlier data that it starts from.

    `begin` is called as that inference begins, and returns what it reports its progress to.
    """
    if name == "separation":
        assert measurement is not None
        return _separation(study.experiment, measurement, begin()), []
    if measurement is None:
        return ESTIMATORS[name](), []
    method = cross_check.standard_methods(study.experiment, study.engine)[0]
    posterior = infer_posterior(study.experiment, measurement, method, seed, begin())
    return ESTIMATORS[name](after=posterior), warnings_of(posterior)


def _separation(
    experiment: Experiment, measurement: Measurements, progress: Progress
) -> information.Separation:
    """Separation of the explanations that earlier data leave."""
    ledger = improve(experiment, measurement, candidates=library(experiment), progress=progress)
    if len(ledger.alternatives) < 2:
        names = "".join(f" ({alternative.name})" for alternative in ledger.alternatives)
        raise InputError(
            "--estimator separation tells explanations apart, but the data leave only one"
            f"{names}. Give --estimator expected-gain, to sharpen its parameters."
        )
    return information.Separation(alternatives=ledger.alternatives)
