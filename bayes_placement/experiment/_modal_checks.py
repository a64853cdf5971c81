"""Checks of measured modal parameters: layout, ranges, deviations."""

from collections.abc import Sequence

import numpy as np

from .._shared.arguments import as_array, shown
from .._shared.errors import InputError
from ..positions.channel import Channel

MOST_IMAGINARY = 0.2
"""Greatest share of a shape that may be imaginary after the best turn."""

ROUNDING = 1e-9
"""Share of the greatest eigenvalue by which a covariance may be asymmetric, or below zero."""


def _numbers(argument: str, values: object, kinds: str = "iuf") -> np.ndarray:
    array = as_array(values)
    if array.dtype.kind == "c" and "c" not in kinds:
        raise InputError(
            f"{argument} of complex numbers was given; real ones are needed, since predicted "
            "shapes are compared after a turn of the phase. Take the real part after the best "
            "turn: ModalParameters.of_complex_shapes(shape, natural_frequency, ...)."
        )
    if array.dtype.kind not in kinds:
        raise InputError(
            f"{argument}={shown(values)} was given, of {array.dtype}; an array of numbers is "
            f"needed, since modes are compared by them: {argument}=np.asarray(..., dtype=float)."
        )
    return array.astype(complex if array.dtype.kind == "c" else float)


def frequency(values: object) -> np.ndarray:
    """Return natural frequencies [Hz]."""
    array = _numbers("natural_frequency", values)
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array) & (array > 0)):
        raise InputError(
            f"natural_frequency={shown(values)} was given; a list of positive numbers [Hz] is "
            "needed, one for each elastic mode, since rigid-body modes say nothing of stiffness: "
            "natural_frequency=[12.1, 33.4]."
        )
    if np.any(np.diff(array) <= 0):
        raise InputError(
            f"natural_frequency={shown(values)} does not increase; each mode is needed once, in "
            "ascending order, so that it is found. Sort all arrays by "
            "np.argsort(natural_frequency)."
        )
    return array


def array(argument: str, values: object, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of this shape; NaN everywhere for None."""
    if values is None:
        return np.full(shape, np.nan)
    numbers = _numbers(argument, values)
    if numbers.shape != shape:
        axes = "(mode,)" if len(shape) == 1 else "(channel, mode)"
        raise InputError(
            f"{argument} has shape {numbers.shape}; {axes} = {shape} is needed by the natural "
            f"frequencies and sensors given: {argument}=np.asarray({argument}).T, or name all "
            "channels in sensors=."
        )
    if np.isinf(numbers).any():
        raise InputError(
            f"{argument} has an infinite value; finite numbers are needed, or NaN where nothing "
            f"is known: {argument}=np.where(np.isfinite({argument}), {argument}, np.nan)."
        )
    return numbers


def has_sensors(shape: object, channels: Sequence[Channel]) -> None:
    """Refuse shapes without channels, and channels without shapes."""
    if (shape is None) == bool(channels):
        mismatch = "no shape, but sensors" if shape is None else "a shape, but no sensors"
        raise InputError(
            f"{mismatch} were given; both or neither are needed, since each row of a shape belongs "
            "to a channel: shape=phi, sensors=['s1+x', 's2+x']."
        )


def agree(covariance: object, deviation: np.ndarray) -> None:
    """Refuse a covariance together with deviations that differ from its diagonal."""
    matrices = _numbers("covariance", covariance)
    stated = np.isfinite(deviation)
    rows, modes = deviation.shape
    if matrices.shape != (modes, rows, rows):
        return  # refused with its shape
    variance = np.diagonal(matrices, axis1=1, axis2=2).T
    if not np.allclose(deviation[stated] ** 2, variance[stated], rtol=1e-6, atol=0.0):
        raise InputError(
            "covariance= and deviations were given and differ; one of them is needed, since both "
            "say how large the errors are. Leave out natural_frequency_deviation, "
            "damping_ratio_deviation and shape_deviation."
        )


def covariance(matrices: object, values: np.ndarray, labels: Sequence[str]) -> np.ndarray:
    """Return covariance matrices [mode, row, row], the identity's rows where nothing is known."""
    numbers = _numbers("covariance", matrices)
    rows, modes = values.shape
    if numbers.shape != (modes, rows, rows):
        raise InputError(
            f"covariance has shape {numbers.shape}; (mode, row, row) = {(modes, rows, rows)} is "
            "needed, the rows being natural frequency, damping ratio and the channels of the "
            "shape, since each mode has errors of its own: covariance=np.stack([...])."
        )
    known = np.isfinite(values.T)
    complete = np.where(known[:, :, None] & known[:, None, :], numbers, np.eye(rows))
    names = ["natural_frequency", "damping_ratio", *(f"shape of {label}" for label in labels)]
    for mode, matrix in enumerate(complete):
        wrong = np.flatnonzero(~(np.isfinite(matrix).all(axis=1) & (np.diag(matrix) > 0)))
        if wrong.size:
            raise InputError(
                f"The {names[wrong[0]]} of mode {mode + 1} has no positive standard deviation; "
                "one is needed of all that was measured, since it says how far a model may be "
                "from it: natural_frequency_deviation=..., damping_ratio_deviation=..., "
                "shape_deviation=..., or NaN for a value that is not to be used."
            )
        eigenvalues = np.linalg.eigvalsh(matrix / np.sqrt(np.outer(*[np.diag(matrix)] * 2)))
        asymmetric = not np.allclose(matrix, matrix.T, rtol=1e-6, atol=0)
        if asymmetric or eigenvalues[0] < ROUNDING * eigenvalues[-1]:
            raise InputError(
                f"The covariance of mode {mode + 1} is not symmetric and positive definite; it "
                "must be, being that of errors that are not all the same. A shape that was scaled "
                "to one at a channel has no error there: give NaN for it, or an error to all."
            )
    return complete


def correlation(matrix: object, covariance: np.ndarray) -> np.ndarray:
    """Return the correlation of natural frequencies between modes; the identity for None.

    Others are refused, and where a mode is correlated with its other rows too.
    """
    count = len(covariance)
    if matrix is None:
        return np.eye(count)
    numbers = _numbers("correlation", matrix)
    is_one = numbers.shape == (count, count) and np.allclose(np.diag(numbers), 1, rtol=1e-6)
    symmetric = is_one and np.allclose(numbers, numbers.T, rtol=1e-6)
    values = np.linalg.eigvalsh(numbers) if symmetric else np.zeros(1)
    if values[0] < ROUNDING * values[-1] or values[-1] == 0:
        raise InputError(
            f"correlation={shown(matrix)} was given; a symmetric, positive definite matrix (mode, "
            f"mode) = {(count, count)} with ones on its diagonal is needed, as of errors that are "
            "not all the same: correlation=np.corrcoef(repeats, rowvar=False)."
        )
    if np.any(numbers != np.eye(count)) and np.any(covariance[:, 0, 1:]):
        raise InputError(
            "correlation= of natural frequencies between modes was given beside a covariance of "
            "them with the damping or shape of their own; one of them is needed, since errors are "
            "made independent mode by mode or between modes. Leave out correlation=."
        )
    return numbers


def repeats(argument: str, values: object, shape: tuple[int, ...] | None) -> np.ndarray:
    """Return finite repeats (repeat, mode), of a shape if given; at least two more than modes."""
    array = _numbers(argument, values)
    wrong = array.ndim != 2 or array.shape != (shape or array.shape)
    if wrong or not np.all(np.isfinite(array)):
        raise InputError(
            f"{argument}={shown(values)} was given, of shape {array.shape}; finite numbers of "
            f"shape {shape or '(repeat, mode)'} are needed, since a mean and a scatter is taken of "
            "each mode. Leave out repeats in which a mode was not found."
        )
    if len(array) < array.shape[1] + 2:
        raise InputError(
            f"{len(array)} repeats of {array.shape[1]} modes were given; {array.shape[1] + 2} or "
            "more are needed, since fewer do not tell how the errors of all modes are correlated. "
            f"Take fewer modes, natural_frequency[:, :{max(1, len(array) - 2)}], or state "
            "deviations: ModalParameters(mean, deviation)."
        )
    return array


def damping(ratio: np.ndarray) -> None:
    """Refuse damping ratios [1] that are not between -1 and 1."""
    outside = ratio[np.abs(ratio) >= 1]
    if outside.size:
        raise InputError(
            f"damping_ratio has the value {outside[0]:g}; shares of critical damping below 1 are "
            "needed, since a mode beyond does not vibrate. Divide percentages by 100."
        )


def number(numbers: object, count: int) -> tuple[int, ...] | None:
    """Return the numbers of the modes; None where they are not known."""
    if numbers is None:
        return None
    mode_numbers = _numbers("number", numbers)
    are_integers = mode_numbers.ndim == 1 and bool(
        np.all((mode_numbers >= 1) & (mode_numbers == np.rint(mode_numbers)))
    )
    if not are_integers or mode_numbers.size != count or np.unique(mode_numbers).size < count:
        raise InputError(
            f"number={shown(numbers)} was given; {count} whole numbers from 1 on are needed, one "
            "for each mode and each once, since they count the elastic modes of the model: "
            "number=[1, 2, 3]."
        )
    return tuple(int(value) for value in mode_numbers)


def places(chosen: Sequence[int], count: int) -> np.ndarray:
    """Return places of modes, ascending."""
    indices = _numbers("modes", chosen)
    inside = (indices >= 0) & (indices < count) & (indices == np.rint(indices))
    if indices.ndim != 1 or indices.size == 0 or not np.all(inside):
        raise InputError(
            f"modes({shown(chosen)}) was asked for; places from 0 to {count - 1} are needed, since "
            f"{count} modes were measured: measured.modes(range({count}))."
        )
    return np.unique(indices.astype(int))


def real_part(shape: object) -> np.ndarray:
    """Return the real part of shapes (channel, mode), each turned until most of it is real."""
    turned = _numbers("shape", shape, "iufc").astype(complex)
    if turned.ndim != 2:
        raise InputError(
            f"shape has shape {turned.shape}; (channel, mode) is needed, since each mode has a "
            "shape of its own: shape=phi, as pyOMA2 has it."
        )
    squares = np.nansum(turned**2, axis=0)
    size = np.where(np.abs(squares) > 0, np.abs(squares), 1.0)
    turned = turned * np.conj(np.sqrt(np.where(squares == 0, 1.0, squares / size)))
    norm = np.sqrt(np.nansum(np.abs(turned) ** 2, axis=0))
    share = np.sqrt(np.nansum(turned.imag**2, axis=0)) / np.where(norm > 0, norm, 1.0)
    if np.any(share > MOST_IMAGINARY):
        mode = int(np.argmax(share))
        raise InputError(
            f"The shape of mode {mode + 1} remains to {share[mode]:.0%} imaginary after the best "
            f"turn; at most {MOST_IMAGINARY:.0%} are taken, since its real part alone would not "
            "be the mode. Give NaN in its column, so that its frequency and damping count alone."
        )
    return turned.real
