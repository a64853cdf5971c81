"""Hypotheses fitted once more with a model error, in several processes."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from ..._processes import shared
from ...experiment.model_error import ModalErrors
from ._fitted_extensions import FittedFields, fitted_fields
from ._hypotheses import Hypothesis, problem_with_errors, with_errors
from ._kept_fits import count_taken, fits_kept_in, folder_of_fits


def fitted_with_errors_at_once(
    exact: Sequence[Hypothesis], errors: ModalErrors
) -> list[Hypothesis]:
    """Fit hypotheses with a model error, none of which is given up; see `with_errors`."""
    folder = folder_of_fits()
    tasks = [(replace(hypothesis, scan=None), errors, folder) for hypothesis in exact]
    outcomes = shared(_outcome, tasks, lambda _: None)
    count_taken(sum(taken for _, taken in outcomes))
    return [
        _received(hypothesis, errors, fields)
        for hypothesis, (fields, _) in zip(exact, outcomes, strict=True)
    ]


@threadpool_limits.wrap(limits=1)
def _outcome(
    exact: Hypothesis, errors: ModalErrors, folder: Path | None
) -> tuple[FittedFields, int]:
    """What one process finds, and how many fits it takes from a folder."""
    with fits_kept_in(folder) as fits:
        fields = fitted_fields(with_errors(exact, errors))
    return fields, 0 if fits is None else fits.taken


def _received(exact: Hypothesis, errors: ModalErrors, found: FittedFields) -> Hypothesis:
    """What was found, with the problem of this process."""
    problem = problem_with_errors(exact, errors).at_sizes(found.sizes)
    chi2 = exact.chi2_per_datum
    return replace(exact, problem=problem, chi2_when_exact=chi2, **found.fields)
