"""Numbers of an output error: positive, not negative, positive definite."""

import numpy as np
from jaxtyping import Array, Float

from .._shared.arguments import check_annotated, shown
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.sites import is_open, is_unknown


def not_negative(call: str, word: str, value: Parameter) -> Parameter:
    """Return a standard deviation that may vanish, if it is not negative."""
    if is_open(value):
        return value
    _check_numbers(call, word, value)
    wrong = np.asarray(value)[~(np.isfinite(value) & (np.asarray(value) >= 0))]
    if wrong.size:
        raise InputError(
            f"{call} was given a {word} of {wrong[0]:g}; the {word} must not be negative, since it "
            "is a standard deviation. Give 0 for none."
        )
    return value


def positive(call: str, word: str, value: Parameter) -> Parameter:
    """Return a standard deviation, or a factor on one, if it is positive or a distribution."""
    if is_open(value):
        return value
    _check_numbers(call, word, value)
    wrong = np.asarray(value)[~(np.isfinite(value) & (np.asarray(value) > 0))]
    if wrong.size:
        raise InputError(
            f"{call} was given a {word} of {wrong[0]:g}; the {word} must be positive, since a "
            "likelihood without noise is infinite. Without output error give noise=None and use "
            "marginals.KDE()."
        )
    return value


def _check_numbers(call: str, word: str, value: object) -> None:
    if np.asarray(value).dtype.kind not in "iuf":
        raise InputError(
            f"{call} was given {shown(value)}; numbers or a distribution are needed, as the "
            f"{word} of measured values: {call.split('(')[0]}(0.01)."
        )


def check_lines(matrix: Parameter, lines: int) -> None:
    """Refuse a covariance that has not as many rows as there are lines."""
    shape = tuple(matrix.shape()) if is_unknown(matrix) else np.shape(matrix)
    if shape != (lines, lines):
        raise InputError(
            f"noise.Covariance(matrix) was given a matrix of shape {shape}, but the experiment has "
            f"{lines} lines; ({lines}, {lines}) is needed, since it has a row for each of them: "
            "sigma**2 * np.eye(len(frequency))."
        )


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    """Refuse a matrix that differs from its transpose, of which a factor has only one triangle."""
    if matrix.shape != matrix.T.shape or not np.allclose(matrix, matrix.T):
        raise np.linalg.LinAlgError("it is not symmetric")
    return matrix


def positive_definite(matrix: Parameter) -> Parameter:
    """Return a covariance if it is positive definite or a distribution."""
    if is_open(matrix):
        return matrix
    check_annotated("matrix", matrix, Float[np.ndarray, "line line"] | Array)
    try:
        np.linalg.cholesky(_symmetric(np.asarray(matrix)))
    except np.linalg.LinAlgError as error:
        raise InputError(
            f"noise.Covariance(matrix) was given a matrix of shape {np.shape(matrix)} that is not "
            "square and positive definite; that is needed, since the density has its inverse. Take "
            "the covariance of more records than lines, or add a variance: "
            "matrix + 1e-6 * np.eye(lines)."
        ) from error
    return matrix
