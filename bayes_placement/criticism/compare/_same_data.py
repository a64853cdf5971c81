"""Jacobians between results that observed different quantities of the same data."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from ..._types import InputError
from ...experiment.experiment import MEASURED

RECEPTANCE = "receptance"
"""What the outputs tell of the receptance, in the group of observed data."""

LOG_JACOBIAN = "log_jacobian"
"""Log of the derivative of each output by what it tells of the receptance."""

FORCE_LEVEL = "force_level"
"""Dimension of the force levels, which outputs have where the experiment states them."""

SAME = 1e-9
"""Relative difference that the same datum may have after a change of quantity."""


def log_jacobian(results: Mapping[str, xr.DataTree]) -> dict[str, xr.DataArray]:
    """Log of |dz / dz of the first model| for each output of each model, NaN where not measured.

    Raises
    ------
    ValueError
        If the results do not describe the same data, or do not say what their outputs tell of it.
    """
    observed = {name: _observed(name, result) for name, result in results.items()}
    first = next(iter(observed))
    return {name: _between((first, observed[first]), (name, observed[name])) for name in observed}


def _observed(name: str, result: xr.DataTree) -> xr.Dataset:
    if "observed_data" not in result or MEASURED not in result["observed_data"]:
        raise InputError(
            f'"{name}" holds no observed data, so it is no inference. compare needs what infer '
            f'returned: compare({{"{name}": infer(experiment, measurement), ...}}).'
        )
    return result["observed_data"].to_dataset()


def _between(first: tuple[str, xr.Dataset], second: tuple[str, xr.Dataset]) -> xr.DataArray:
    """Log-Jacobian of a model's outputs by those of the first, for the same data."""
    names, (one, other) = (first[0], second[0]), (first[1], second[1])
    _check_kind(names, one, other)
    other = _aligned(names, one, other)
    if one[MEASURED].attrs.get("units") == other[MEASURED].attrs.get("units"):
        _check_values(names, one[MEASURED], other[MEASURED])
        return xr.zeros_like(one[MEASURED]).where(one[MEASURED].notnull())
    for name, dataset in zip(names, (one, other), strict=True):
        _check_told(name, dataset)
    _check_values(names, one[RECEPTANCE], other[RECEPTANCE])
    return other[LOG_JACOBIAN] - one[LOG_JACOBIAN]


def _check_kind(names: tuple[str, str], one: xr.Dataset, other: xr.Dataset) -> None:
    dimensions = set(one[MEASURED].dims) ^ set(other[MEASURED].dims)
    if FORCE_LEVEL in dimensions:
        with_levels, without = names if FORCE_LEVEL in one[MEASURED].dims else names[::-1]
        raise InputError(
            f'{_pair(names)} describe different data: "{with_levels}" has force levels and '
            f'"{without}" has none, so they hold different numbers of data, whose densities cannot '
            "be compared. Give both the same measurements, "
            "Experiment(..., force_levels=[0.1, 1.0]), and infer again."
        )
    if dimensions:
        kinds = [_label(dataset) for dataset in (one, other)]
        raise InputError(
            f'{_pair(names)} describe different data: the one "{kinds[0]}", the other '
            f'"{kinds[1]}". An amplitude says nothing of the phase, so no Jacobian makes its '
            "density that of a complex FRF. Give both the same kind of output, "
            "observe=observe.Complex('acceleration'), and infer again."
        )


def _aligned(names: tuple[str, str], one: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Put the channels of the second in the order of those of the first, at the same lines."""
    for side in ("sensor", "actuator"):
        labels = [sorted(map(str, dataset[side].values)) for dataset in (one, other)]
        if labels[0] != labels[1]:
            raise InputError(
                f"{_pair(names)} describe different data: the {side} channels "
                f"{', '.join(labels[0])} and {', '.join(labels[1])}. {_BOTH}"
            )
    first, second = one["frequency"].values, other["frequency"].values
    if first.shape != second.shape or not np.allclose(first, second, rtol=SAME, atol=0):
        raise InputError(
            f"{_pair(names)} describe different data: {_lines(first)} and {_lines(second)}. {_BOTH}"
        )
    aligned = other.sel(sensor=one["sensor"], actuator=one["actuator"])
    return aligned.assign_coords(frequency=one["frequency"])


def _check_told(name: str, observed: xr.Dataset) -> None:
    if RECEPTANCE not in observed or LOG_JACOBIAN not in observed:
        raise InputError(
            f'"{name}" observes "{_label(observed)}", another one something else, and the result '
            f'does not say what its outputs tell of the receptance ("{RECEPTANCE}" and '
            f'"{LOG_JACOBIAN}" among its observed data), without which densities of different '
            "outputs are not comparable. It was made by an older version: infer again."
        )


def _check_values(names: tuple[str, str], one: xr.DataArray, other: xr.DataArray) -> None:
    first, second = (values.transpose(*one.dims).values for values in (one, other))
    there = [np.isfinite(values) for values in (first, second)]
    if not np.array_equal(there[0], there[1]):
        raise InputError(
            f"{_pair(names)} describe different data: {there[0].sum()} outputs were measured for "
            f"the one and {there[1].sum()} for the other, or elsewhere. {_BOTH}"
        )
    axes = tuple(axis for axis, name in enumerate(one.dims) if name == "part")
    size = np.sqrt(np.sum(np.abs(first) ** 2, axis=axes, keepdims=True))
    apart = np.abs(second - first) > SAME * size
    if np.any(apart):
        raise InputError(
            f"{_pair(names)} describe different data: {apart.sum()} of {there[0].sum()} measured "
            f"values are not the same. {_BOTH}"
        )


_BOTH = (
    "Densities of different data are not comparable: infer both from one measurement, "
    "infer(one, measurement) and infer(other, measurement), at the same lines and channels."
)


def _pair(names: tuple[str, str]) -> str:
    return f'"{names[0]}" and "{names[1]}"'


def _label(observed: xr.Dataset) -> str:
    return str(observed[MEASURED].attrs.get("units", "an unknown quantity"))


def _lines(lines: np.ndarray) -> str:
    return f"{lines.size} lines from {lines.min():.6g} to {lines.max():.6g} Hz"
