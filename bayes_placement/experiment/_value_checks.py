"""Numbers and priors of an experiment and its noise: finite, possible, and with a density."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from numpyro.distributions import (
    Delta,
    Distribution,
    LogNormal,
    LogUniform,
    Normal,
    TransformedDistribution,
    Uniform,
)
from numpyro.distributions.transforms import AffineTransform

from .._shared.arguments import check_annotated, shown
from .._shared.compiled import compiled
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import ALIKE, POSITIVE, Range, described, is_plain, reach
from .._shared.sites import (
    Leaf,
    Unknown,
    is_open,
    is_unknown,
    leaves_with_unit,
    substitute,
    unknowns,
)
from ..positions.at import position_on
from ..positions.bounds import Bounds

if TYPE_CHECKING:
    from .experiment import Experiment


_DRAWS = 16


def check_values(tree: object) -> None:
    """Refuse numbers that are not finite or cannot be, and priors without a finite density."""
    for leaf in leaves_with_unit(tree):
        value = leaf.value
        if is_unknown(value):
            _check_prior(leaf, value)
        elif not isinstance(value, jax.core.Tracer):
            _check_number(leaf, value)


def fixed(tree: "Experiment", values: Mapping[str, Any]) -> "Experiment":
    """Put values in the place of distributions of an experiment, by name."""
    substituted = substitute(tree, values)
    for unknown in unknowns(tree):
        value = values.get(unknown.name)
        if value is None or isinstance(value, jax.core.Tracer):
            continue
        leaf = Leaf(unknown.owner, unknown.field, unknown.name, unknown.unit, value, unknown.within)
        if is_unknown(value):
            _check_prior(leaf, value)
            continue
        _check_number(leaf, value)
        if np.shape(value) != unknown.distribution.shape():
            raise InputError(
                f"{unknown.name}={shown(value)} of shape {np.shape(value)} was given; the shape "
                f"{unknown.distribution.shape()} of its prior is needed, since it takes the place "
                f"of that: experiment.fix({{{unknown.name!r}: ...}}). Many values are taken one by "
                "one, or by jax.vmap."
            )
        if unknown.is_placement and unknown.field == "position" and not unknown.path:
            _check_position(unknown, value, tree.structure.modes.bounds())
    return substituted


def _check_position(unknown: Unknown, value: object, bounds: Bounds) -> None:
    """Refuse a position off the structure, once it is known how long that is."""
    if not any(isinstance(bound, jax.core.Tracer) for bound in bounds):
        position_on(value, bounds, f'{unknown.owner.kind.capitalize()} "{unknown.owner.name}"')


def _check_number(leaf: Leaf, value: object) -> None:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "iuf":
        raise InputError(
            f"{leaf.name}={shown(value)} was given; a number [{leaf.unit}] or a distribution is "
            f"needed, since it enters the response: {leaf.field}=1.0."
        )
    if not np.isfinite(numbers).all():
        raise InputError(
            f"{leaf.name}={shown(value)} was given; a finite number [{leaf.unit}] is needed, since "
            f"no response follows from another: {leaf.field}=1.0, or a distribution."
        )
    allowed = leaf.within
    if allowed is None:
        return
    inside = (numbers >= allowed.least) & (numbers <= allowed.most)
    if not np.all(inside) or (allowed is POSITIVE and not np.all(numbers)):
        raise _outside(leaf, f"{numbers.flat[0]:g}", allowed)


def _check_prior(leaf: Leaf, prior: Distribution) -> None:
    if any(isinstance(value, jax.core.Tracer) for value in jax.tree.leaves(prior)):
        return
    if not _has_density(prior):
        raise InputError(
            f"{leaf.name}: {described(prior)} was given; a prior with a finite density where its "
            "draws lie is needed, since every posterior begins with it: its bounds must rise and "
            "be finite, its width must be above zero: numpyro.distributions.Uniform(0.02, 0.06)."
        )
    allowed = leaf.within
    if allowed is None:
        return
    low, high = reach(prior)
    if low < allowed.least or high > allowed.most:
        raise _outside(leaf, f"{described(prior)}, from {low:.3g} to {high:.3g},", allowed)


def _outside(leaf: Leaf, words: str, allowed: Range) -> InputError:
    unit = "" if leaf.unit == "1" else f" [{leaf.unit}]"
    between = f"it must be between {allowed.least:.4g} and {allowed.most:.4g}{unit}: "
    is_open = np.isinf(allowed.most) or np.isinf(allowed.least)
    needed = f"{allowed.reason}{unit}" if is_open else between + allowed.reason
    return InputError(f"{leaf.name}={words} was given; {needed}.")


def _has_density(prior: Distribution) -> bool:
    """Whether the log density is finite at draws; of common families without drawing."""
    if isinstance(prior, Delta):
        return bool(np.isfinite(prior.v).all())
    if isinstance(prior, Uniform | LogUniform):
        low, high = np.asarray(prior.low), np.asarray(prior.high)
        least = 0.0 if isinstance(prior, LogUniform) else -np.inf
        return bool(np.all((low > least) & (low < high) & (high < np.inf)))
    if isinstance(prior, Normal | LogNormal):
        return bool(np.all(np.isfinite(prior.loc) & (prior.scale > 0) & (prior.scale < np.inf)))
    if isinstance(prior, ALIKE):
        return _has_density(prior.base_dist)
    if type(prior) is TransformedDistribution and all(map(is_plain, prior.transforms)):
        return _has_density(prior.base_dist) and all(map(_keeps_density, prior.transforms))
    try:
        return bool(compiled(_is_finite_at_draws)(prior))
    except NotImplementedError:  # an improper prior has no draws
        return False


def _keeps_density(transform: object) -> bool:
    """Whether a transform is finite and leaves a width; one without numbers does."""
    if not isinstance(transform, AffineTransform):
        return True
    location, scale = np.asarray(transform.loc), np.asarray(transform.scale)
    return bool(np.all(np.isfinite(location) & np.isfinite(scale) & (scale != 0)))


def _is_finite_at_draws(prior: Distribution) -> Bool[Array, ""]:
    draws = prior.sample(jax.random.key(0), (_DRAWS,))
    return jnp.isfinite(prior.log_prob(draws)).all()


def not_negative(call: str, word: str, value: Parameter) -> Parameter:
    """Return a standard deviation that may vanish, if it is not negative."""
    needed = "must not be negative, since it is a standard deviation. Give 0 for none"
    return _beyond_zero(call, word, value, np.greater_equal, needed)


def positive(call: str, word: str, value: Parameter) -> Parameter:
    """Return a standard deviation, or a factor on one, if it is positive or a distribution."""
    needed = (
        "must be positive, since a likelihood without noise is infinite. Without output error give "
        "noise=None and use marginals.KDE()"
    )
    return _beyond_zero(call, word, value, np.greater, needed)


def _beyond_zero(
    call: str, word: str, value: Parameter, is_beyond: np.ufunc, needed: str
) -> Parameter:
    if is_open(value):
        return value
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "iuf":
        raise InputError(
            f"{call} was given {shown(value)}; numbers or a distribution are needed, as the "
            f"{word} of measured values: {call.split('(')[0]}(0.01)."
        )
    wrong = numbers[~(np.isfinite(numbers) & is_beyond(numbers, 0))]
    if wrong.size:
        raise InputError(f"{call} was given a {word} of {wrong[0]:g}; the {word} {needed}.")
    return value


def check_lines(matrix: Parameter, lines: int) -> None:
    """Refuse a covariance that has not as many rows as there are lines."""
    shape = tuple(matrix.shape()) if is_unknown(matrix) else np.shape(matrix)
    if shape != (lines, lines):
        raise InputError(
            f"noise.Covariance(matrix) was given a matrix of shape {shape}, but the experiment has "
            f"{lines} lines; ({lines}, {lines}) is needed, since it has a row for each of them: "
            "sigma**2 * np.eye(len(frequency))."
        )


def positive_definite(matrix: Parameter) -> Parameter:
    """Return a covariance if it is positive definite or a distribution."""
    if is_open(matrix):
        return matrix
    check_annotated("matrix", matrix, Float[np.ndarray, "line line"] | Array)
    numbers = np.asarray(matrix)
    try:
        if numbers.shape != numbers.T.shape or not np.allclose(numbers, numbers.T):
            raise np.linalg.LinAlgError  # a factor has one of its triangles alone
        np.linalg.cholesky(numbers)
    except np.linalg.LinAlgError as error:
        raise InputError(
            f"noise.Covariance(matrix) was given a matrix of shape {np.shape(matrix)} that is not "
            "square and positive definite; that is needed, since the density has its inverse. Take "
            "the covariance of more records than lines, or add a variance: "
            "matrix + 1e-6 * np.eye(lines)."
        ) from error
    return matrix
