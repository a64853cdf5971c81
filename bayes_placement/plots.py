"""plots: in, a tree of results; out, one figure each, with units and a legend that stands alone.

Not known here: how anything was computed.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .experiment import MEASURED, RESPONSE

BAND = (0.05, 0.95)
_PRIOR, _POSTERIOR, _DATA = "0.6", "C0", "C3"
_PANEL = (6.4, 3.6)


def measured_against_band(result: xr.DataTree) -> Figure:
    """Measured outputs against the 90 % band of the posterior predictive, for each channel pair."""
    predicted = result["posterior_predictive"].to_dataset()
    name = MEASURED if MEASURED in predicted else RESPONSE
    values, measured = _amplitude(predicted[name]), _amplitude(result["observed_data"][MEASURED])
    figure, axes = _panels(predicted.sizes["sensor"], predicted.sizes["actuator"])
    for row, column, axis in _pairs(axes):
        pair = {"sensor": row, "actuator": column}
        _band(axis, values.isel(pair), "posterior predictive", _POSTERIOR)
        axis.plot(measured["frequency"], measured.isel(pair), ".", color=_DATA, label="measured")
        _response_axis(axis, values.isel(pair))
    _legend(axes)
    return figure


def response_band(simulated: xr.DataTree, reference: Any = None) -> Figure:
    """Mean and 90 % band of simulated outputs for each channel pair, as Figure 2 of the paper.

    Parameters
    ----------
    simulated
        What `simulate` returned.
    reference
        Outputs [sensor, actuator, frequency] of the nominal experiment, drawn along (Figure 1).
    """
    values = _amplitude(simulated["prior_predictive"][RESPONSE])
    figure, axes = _panels(values.sizes["sensor"], values.sizes["actuator"])
    for row, column, axis in _pairs(axes):
        one = values.isel(sensor=row, actuator=column)
        _band(axis, one, "random placement", _POSTERIOR)
        if reference is not None:
            nominal = np.asarray(reference)[row, column]
            axis.plot(one["frequency"], nominal, color=_DATA, label="recorded placement")
        _response_axis(axis, one)
    _legend(axes)
    return figure


def parameters(result: xr.DataTree, truth: Mapping[str, float] | None = None) -> Figure:
    """Prior and posterior of every parameter and noise level, as Figures 6 and 7 of the paper."""
    names = [name for name in _names(result) if _role(result, name) != "placement"]
    return _marginals(result, names, truth or {})


def placement(result: xr.DataTree, truth: Mapping[str, float] | None = None) -> Figure:
    """Prior and posterior of every position and angle."""
    names = [name for name in _names(result) if _role(result, name) == "placement"]
    return _marginals(result, names, truth or {})


def methods(results: Mapping[str, xr.DataTree]) -> Figure:
    """Posterior of every parameter by each method, one over the other."""
    first = next(iter(results.values()))
    names = [name for name in _names(first) if _role(first, name) != "placement"]
    figure, axes = _panels(len(names), 1)
    for axis, name in zip(axes.flat, names, strict=True):
        edges = _edges(first, name, results)
        for number, (method, result) in enumerate(results.items()):
            draws = result["posterior"][name].values.ravel()
            axis.hist(draws, edges, density=True, histtype="step", color=f"C{number}", label=method)
        _density_axis(axis, first, name)
    _legend(axes)
    return figure


def _marginals(result: xr.DataTree, names: list[str], truth: Mapping[str, float]) -> Figure:
    figure, axes = _panels(max(1, len(names)), 1)
    for axis, name in zip(axes.flat, names, strict=False):
        edges = _edges(result, name, {"": result})
        for group, color, fill in (("prior", _PRIOR, True), ("posterior", _POSTERIOR, False)):
            style = {"histtype": "stepfilled", "alpha": 0.4} if fill else {"histtype": "step"}
            draws = result[group][name].values.ravel()
            axis.hist(draws, edges, density=True, color=color, label=group, **style)
        if name in truth:
            axis.axvline(truth[name], color=_DATA, linestyle="--", label="true value")
        _density_axis(axis, result, name)
    _legend(axes)
    return figure


def _names(result: xr.DataTree) -> list[str]:
    scalars = result["posterior"].data_vars.items()
    return [str(name) for name, draws in scalars if draws.ndim == 2]


def _role(result: xr.DataTree, name: str) -> str:
    return result["posterior"][name].attrs["role"]


def _edges(result: xr.DataTree, name: str, results: Mapping[str, xr.DataTree]) -> np.ndarray:
    """Edges of bins: from end to end of the prior where the posteriors fill it, else about them."""
    prior = result["prior"][name].values
    draws = np.concatenate([one["posterior"][name].values.ravel() for one in results.values()])
    low, high = draws.min(), draws.max()
    if high - low > 0.2 * np.ptp(prior):
        low, high = prior.min(), prior.max()
    return np.linspace(low, high, 41)


def _amplitude(values: xr.DataArray) -> xr.DataArray:
    """Logarithm of the amplitude of a complex output; any other output as it is."""
    if "part" not in values.dims:
        return values
    with np.errstate(divide="ignore"):
        logarithm = 0.5 * np.log10((values**2).sum("part", skipna=False))
    return logarithm.assign_attrs(units=f"log10 of {values.attrs['units']}")


def _band(axis: Axes, values: xr.DataArray, label: str, color: str) -> None:
    draws = values.stack(sample=("chain", "draw"))
    low, high = (draws.quantile(q, "sample") for q in BAND)
    line = "-" if values.sizes["frequency"] > 30 else ".-"
    axis.fill_between(
        values["frequency"], low, high, color=color, alpha=0.3, label=f"{label}, 90 % band"
    )
    axis.plot(values["frequency"], draws.mean("sample"), line, color=color, label=f"{label}, mean")


def _response_axis(axis: Axes, values: xr.DataArray) -> None:
    axis.set_title(f"sensor {values['sensor'].item()}, actuator {values['actuator'].item()}")
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(values.attrs["units"].replace(" per force", "\nper force"))


def _density_axis(axis: Axes, result: xr.DataTree, name: str) -> None:
    unit = result["posterior"][name].attrs["units"]
    axis.set_xlabel(f"{name} [{unit}]")
    axis.set_ylabel("probability density" + ("" if unit == "1" else f" [1/{unit}]"))


def _panels(rows: int, columns: int) -> tuple[Figure, Any]:
    size = (_PANEL[0] * columns, _PANEL[1] * rows)
    figure = Figure(figsize=size, layout="constrained")  # outside pyplot: nothing stays open
    return figure, figure.subplots(rows, columns, squeeze=False)


def _pairs(axes: Any) -> list[tuple[int, int, Axes]]:
    return [(row, column, axes[row, column]) for row, column in np.ndindex(axes.shape)]


def _legend(axes: Any) -> None:
    for axis in axes.flat:
        axis.legend(fontsize="small")
