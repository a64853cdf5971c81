"""The posterior by a method that is named, and the fits that commands on one model share."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from .._shared.errors import InfeasibleError
from .._shared.progress import Progress
from ..experiment.experiment import Experiment, Measurements
from ..io import model

if TYPE_CHECKING:  # they take long to import, and a page stands before
    import xarray as xr

    from ..inference.cross_check import Method
    from ._inputs import Inputs


def named_method(study: model.Study, engine: str, marginal: str) -> "Method":
    """Return a method by its names, with the engine of the study where it is of that kind."""
    from ..inference import cross_check

    method = cross_check.method(engine, marginal)
    if study.engine is not None and type(study.engine) is type(method.engine):
        return method._replace(engine=study.engine)
    return method


def infer_posterior(
    experiment: Experiment,
    measurement: Measurements,
    method: "Method",
    seed: int,
    progress: Progress,
) -> "xr.DataTree":
    """Infer by a method; its warnings become lines of the report."""
    from ..inference.infer import InferenceWarning, infer

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InferenceWarning)
        return infer(
            experiment,
            measurement,
            engine=method.engine,
            marginal=method.marginal,
            key=seed,
            progress=progress,
        )


@contextmanager
def fits_of_model(inputs: "Inputs") -> Iterator[None]:
    """Keep the fits of what follows for later runs, and say how many of earlier runs were taken."""
    from ..criticism.kept_fits import fits_kept_in

    with fits_kept_in(inputs.run.fits) as fits:
        yield
    if fits is not None and fits.taken:
        inputs.screen.text(
            f"Fits and scans of an earlier run that are used again: {fits.taken} of {fits.folder}/"
        )


def method_from_fit(inputs: "Inputs", engine: str) -> tuple["Method", tuple[str, ...]]:
    """Return the method of an engine, and what to doubt in the fit that it begins at.

    Laplace's method begins at the fit that `explain` and `improve` begin with, unless the study
    says how its modes are searched for, or a prior has no inverse distribution function.
    """
    from ..criticism.missing.as_given import fitted_as_given
    from ..inference.engines.map import MAP

    method = named_method(inputs.study, engine, "latent")
    if not isinstance(method.engine, MAP) or method.engine is inputs.study.engine:
        return method, ()
    try:
        with fits_of_model(inputs), inputs.screen.progress(["fit"]) as begin:
            progress = begin("fit")
            fit = fitted_as_given(inputs.experiment, inputs.measurement)
            progress(1.0)
    except InfeasibleError:
        return method, ()
    return method._replace(engine=MAP(begin=fit.values)), fit.cautions
