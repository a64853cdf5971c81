"""Jacobians between results that observed different quantities of the same data."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from ..._shared.errors import InputError
from ..._shared.labels import FORCE_LEVEL
from ...experiment.experiment import MEASURED
from ...inference.results import observed_of

RECEPTANCE = "receptance"
"""Variable of the observed data: receptance that follows from each output."""

LOG_JACOBIAN = "log_jacobian"
"""Variable of the observed data: log of the derivative of each output by its receptance."""

TOLERANCE = 1e-9
"""Relative difference up to which two values, converted to one quantity, are the same datum."""


def log_jacobian(results: Mapping[str, xr.DataTree]) -> dict[str, xr.DataArray]:
    """Log of |dz / dz of the first model| for each output of each model, NaN where not measured."""
    observed = {name: _observed(name, result) for name, result in results.items()}
    first = next(iter(observed))
    return {name: _between((first, observed[first]), (name, observed[name])) for name in observed}


def _observed(name: str, result: xr.DataTree) -> xr.Dataset:
    if "observed_data" not in result or MEASURED not in result["observed_data"]:
        raise InputError(
            f'"{name}" holds no observed data, so it is no result of an inference, which compare '
            f'needs: compare({{"{name}": infer(experiment, measurement), ...}}).'
        )
    return observed_of(result)


def _between(
    named_reference: tuple[str, xr.Dataset], named_observed: tuple[str, xr.Dataset]
) -> xr.DataArray:
    """Log-Jacobian of a model's outputs by those of the reference, for the same data."""
    (reference_name, reference), (name, observed) = named_reference, named_observed
    names = (reference_name, name)
    _check_kind(names, reference, observed)
    observed = _aligned(names, reference, observed)
    if reference[MEASURED].attrs.get("units") == observed[MEASURED].attrs.get("units"):
        _check_values(names, reference[MEASURED], observed[MEASURED])
        return xr.zeros_like(reference[MEASURED]).where(reference[MEASURED].notnull())
    _check_jacobian(reference_name, reference)
    _check_jacobian(name, observed)
    _check_values(names, reference[RECEPTANCE], observed[RECEPTANCE])
    return observed[LOG_JACOBIAN] - reference[LOG_JACOBIAN]


def _check_kind(names: tuple[str, str], reference: xr.Dataset, observed: xr.Dataset) -> None:
    dimensions = set(reference[MEASURED].dims) ^ set(observed[MEASURED].dims)
    if FORCE_LEVEL in dimensions:
        with_levels, without = names if FORCE_LEVEL in reference[MEASURED].dims else names[::-1]
        raise InputError(
            f'{_pair(names)} describe different data: "{with_levels}" has force levels and '
            f'"{without}" has none, so they hold different numbers of data, whose densities cannot '
            "be compared. Give both the same measurements, "
            "Experiment(..., force_levels=[0.1, 1.0]), and infer again."
        )
    if dimensions:
        raise InputError(
            f'{_pair(names)} describe different data: "{_label(reference)}" and '
            f'"{_label(observed)}". An amplitude does not determine the phase, so no Jacobian '
            "converts its density to that of a complex FRF. Give both the same kind of output, "
            "observe=observe.Complex('acceleration'), and infer again."
        )


def _aligned(names: tuple[str, str], reference: xr.Dataset, observed: xr.Dataset) -> xr.Dataset:
    """Put the channels in the order of the reference, and check that the lines are the same."""
    for side in ("sensor", "actuator"):
        labels = [sorted(map(str, dataset[side].values)) for dataset in (reference, observed)]
        if labels[0] != labels[1]:
            raise InputError(
                f"{_pair(names)} describe different data: the {side} channels "
                f"{', '.join(labels[0])} and {', '.join(labels[1])}. {_ONE_MEASUREMENT}"
            )
    first, second = reference["frequency"].values, observed["frequency"].values
    if first.shape != second.shape or not np.allclose(first, second, rtol=TOLERANCE, atol=0):
        raise InputError(
            f"{_pair(names)} describe different data: {_lines(first)} and {_lines(second)}. "
            f"{_ONE_MEASUREMENT}"
        )
    aligned = observed.sel(sensor=reference["sensor"], actuator=reference["actuator"])
    return aligned.assign_coords(frequency=reference["frequency"])


def _check_jacobian(name: str, observed: xr.Dataset) -> None:
    if RECEPTANCE not in observed or LOG_JACOBIAN not in observed:
        raise InputError(
            f'"{name}" observes "{_label(observed)}", another model a different quantity, and the '
            f'result lacks "{RECEPTANCE}" and "{LOG_JACOBIAN}" among its observed data, without '
            "which densities of different quantities are not comparable. It was made by an older "
            "version: infer again."
        )


def _check_values(names: tuple[str, str], reference: xr.DataArray, values: xr.DataArray) -> None:
    first, second = reference.values, values.transpose(*reference.dims).values
    present = [np.isfinite(array) for array in (first, second)]
    if not np.array_equal(*present):
        raise InputError(
            f"{_pair(names)} describe different data: the first has {present[0].sum()} measured "
            f"outputs and the second {present[1].sum()}, or at other channels and lines. "
            f"{_ONE_MEASUREMENT}"
        )
    axes = tuple(axis for axis, name in enumerate(reference.dims) if name == "part")
    size = np.sqrt(np.sum(np.abs(first) ** 2, axis=axes, keepdims=True))
    different = np.abs(second - first) > TOLERANCE * size
    if np.any(different):
        raise InputError(
            f"{_pair(names)} describe different data: {different.sum()} of {present[0].sum()} "
            f"measured values are not the same. {_ONE_MEASUREMENT}"
        )


_ONE_MEASUREMENT = (
    "Densities of different data are not comparable: infer both from one measurement, "
    "infer(first, measurement) and infer(second, measurement), at the same lines and channels."
)


def _pair(names: tuple[str, str]) -> str:
    return f'"{names[0]}" and "{names[1]}"'


def _label(observed: xr.Dataset) -> str:
    return str(observed[MEASURED].attrs.get("units", "an unknown quantity"))


def _lines(lines: np.ndarray) -> str:
    return f"{lines.size} lines from {lines.min():.6g} to {lines.max():.6g} Hz"
