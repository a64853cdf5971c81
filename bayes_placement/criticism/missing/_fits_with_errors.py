"""Hypotheses fitted once more with a model error, in several processes."""

from collections.abc import Sequence
from dataclasses import replace

from ...experiment.model_error import ModalErrors
from ...inference.engines.empirical_bayes import Rival
from ..kept_fits import fitted_in_processes
from ._errors_as_identified import given_with_errors, refitted_from_given
from ._fitted_candidates import FittedFields, fitted_fields
from ._hypotheses import Hypothesis, problem_with_errors, with_errors


def fitted_with_errors_in_processes(
    exact: Sequence[Hypothesis],
    errors: ModalErrors,
    rival: Rival,
    given: Sequence[Hypothesis | None],
) -> list[Hypothesis]:
    """Fit hypotheses with a model error, see `with_errors`.

    `given` is for each the fit with a model error of fewer of its effects, of which it should not
    fall short; None where that is not asked for.
    """
    tasks = [(each, errors, rival, fewer) for each, fewer in zip(exact, given, strict=True)]
    return [
        _received(hypothesis, errors, fields)
        for hypothesis, fields in zip(exact, fitted_in_processes(_fields, tasks), strict=True)
    ]


def _fields(
    exact: Hypothesis, errors: ModalErrors, rival: Rival, given: Hypothesis | None
) -> FittedFields:
    if not exact.effects:
        return fitted_fields(given_with_errors(exact, errors))
    found = with_errors(exact, errors, rival)
    if given is not None:
        found = refitted_from_given(exact, found, given, rival)
    return fitted_fields(found)


def _received(exact: Hypothesis, errors: ModalErrors, found: FittedFields) -> Hypothesis:
    """What was found, with the problem of this process."""
    problem = problem_with_errors(exact, errors).at_sizes(found.sizes)
    return replace(exact, problem=problem, exact=exact, **found.fields)
