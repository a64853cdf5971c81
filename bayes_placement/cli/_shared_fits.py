"""Fits that `check`, `explain` and `improve` of one model share."""

from collections.abc import Iterator
from contextlib import contextmanager

from .._shared.errors import InfeasibleError
from ..criticism.kept_fits import fits_kept_in
from ..criticism.missing.as_given import fitted_as_given
from ..inference.cross_check import Method
from ..inference.engines import MAP
from ._inputs import Inputs
from ._posterior import named_method


@contextmanager
def fits_of_model(inputs: Inputs) -> Iterator[None]:
    """Keep the fits of what follows for later runs, and say how many of earlier runs were taken."""
    with fits_kept_in(inputs.run.fits) as fits:
        yield
    if fits is not None and fits.taken:
        inputs.screen.text(
            f"Fits and scans of an earlier run that are used again: {fits.taken} of {fits.folder}/"
        )


def method_from_fit(inputs: Inputs, engine: str) -> tuple[Method, tuple[str, ...]]:
    """Return the method of an engine, and what to doubt in the fit that it begins at.

    Laplace's method begins at the fit that `explain` and `improve` begin with, unless the study
    says how its modes are searched for, or a prior has no inverse distribution function.
    """
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
