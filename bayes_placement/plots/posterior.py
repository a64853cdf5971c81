"""posterior: in, a tree of results; out, one figure each, with units and a full legend.

Not known here: how anything was computed.
"""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._sites import Role
from ..experiment.experiment import MEASURED, RESPONSE
from ..inference.estimates import scalars
from ._figures import PANEL, legend, on_two_lines, panels

BAND = (0.05, 0.95)
BINS = 40
MOST_NODES = 100
"""Draws of fewer values than this, many times each, are taken for nodes of a quadrature."""

_SMALL = (4.2, 3.0)
"""Width and height [inch] of a panel that has others beside it."""

_PRIOR, _POSTERIOR, _DATA = "0.6", "C0", "C3"
_SPARSE = 30
"""Up to so many lines are marked one by one, since the curve between them is no measurement."""


def measured_against_band(result: xr.DataTree) -> Figure:
    """Measured outputs and the 90 % band of the posterior predictive, for each channel pair.

    Below each pair, both are drawn again less the mean of the band, which shows a band that is
    thinner than a line.
    """
    predicted = result["posterior_predictive"].to_dataset()
    observed = result["observed_data"].to_dataset()
    name = MEASURED if MEASURED in predicted else RESPONSE
    values, measured = _amplitude(predicted[name]), _amplitude(observed[MEASURED])
    rows, columns = values.sizes["sensor"], values.sizes["actuator"]
    figure, axes = panels(2 * rows, columns, heights=[1.0, 0.7] * rows)
    for row, column in np.ndindex(rows, columns):
        pair = {"sensor": row, "actuator": column}
        band, points = values.isel(pair), measured.isel(pair)
        mean = band.mean(("chain", "draw"))
        for axis, level in ((axes[2 * row, column], 0.0), (axes[2 * row + 1, column], mean)):
            _band(axis, band - level, "posterior predictive", _POSTERIOR)
            axis.plot(points["frequency"], points - level, ".", color=_DATA, label="measured")
        _response_axis(axes[2 * row, column], band)
        _difference_axis(axes[2 * row + 1, column], band)
    return legend(figure, axes)


def response_band(simulated: xr.DataTree, reference: Any = None) -> Figure:
    """Mean and 90 % band of simulated outputs for each channel pair, as Figure 2 of the paper.

    Parameters
    ----------
    simulated
        What `simulate` returned.
    reference
        Outputs of the nominal experiment, `experiment.nominal().predict()`, drawn along
        (Figure 1).
    """
    drawn = simulated["prior_predictive"].to_dataset()[RESPONSE]
    values = _amplitude(drawn)
    if reference is not None:
        reference = _amplitude(drawn.isel(chain=0, draw=0).copy(data=np.asarray(reference)))
    figure, axes = panels(values.sizes["sensor"], values.sizes["actuator"])
    for row, column in np.ndindex(axes.shape):
        axis, pair = axes[row, column], {"sensor": row, "actuator": column}
        _band(axis, values.isel(pair), "random draws", _POSTERIOR)
        if reference is not None:
            nominal = reference.isel(pair)
            axis.plot(nominal["frequency"], nominal, color=_DATA, label="as recorded", linewidth=1)
        _response_axis(axis, values.isel(pair))
    return legend(figure, axes)


def parameters(result: xr.DataTree, truth: Mapping[str, float] | None = None) -> Figure:
    """Prior and posterior of every parameter and noise level, as Figures 6 and 7 of the paper."""
    rows = [[name] for name in _names(result, placement=False)]
    return _marginals(result, rows, truth or {})


def placement(result: xr.DataTree, truth: Mapping[str, float] | None = None) -> Figure:
    """Prior and posterior of every position and angle, a row for each sensor and actuator."""
    names = _names(result, placement=True)
    attributes = _attributes(result)
    groups = itertools.groupby(names, lambda name: attributes[name]["owner"])
    return _marginals(result, [list(row) for _, row in groups], truth or {})


def pair(
    result: xr.DataTree, first: str, second: str, truth: Mapping[str, float] | None = None
) -> Figure:
    """Draws of two unknowns against each other: what the data know of them together.

    Parameters
    ----------
    result
        What `infer` returned.
    first, second
        Names of the unknowns along the two axes.
    truth
        True values by name, where they are known.
    """
    figure, axes = panels(1, 1, panel=(6.4, 5.0))
    axis = axes[0, 0]
    for group, color in (("prior", _PRIOR), ("posterior", _POSTERIOR)):
        draws = _scalars(result[group])
        axis.plot(
            draws[first].ravel(), draws[second].ravel(), ".", color=color, markersize=3, label=group
        )
    if truth and first in truth and second in truth:
        place = (truth[first], truth[second])
        axis.plot(*place, "x", color=_DATA, markersize=10, markeredgewidth=2, label="true value")
    axis.set_xlabel(_with_unit(result, first))
    axis.set_ylabel(_with_unit(result, second))
    return legend(figure, axes)


def methods(results: Mapping[str, xr.DataTree], truth: Mapping[str, float] | None = None) -> Figure:
    """Posterior of every parameter by each method, one over the other."""
    first = next(iter(results.values()))
    names = _names(first, placement=False)
    figure, axes = panels(max(1, len(names)), 1)
    for axis, name in zip(axes.flat, names, strict=False):
        draws = [_scalars(result["posterior"])[name].ravel() for result in results.values()]
        for number, (method, one) in enumerate(zip(results, draws, strict=True)):
            color, line = f"C{number}", ("-", "--", "-.", ":")[number % 4]
            _histogram(
                axis, one, label=method, fill=False, linewidth=1.5, color=color, linestyle=line
            )
        _true_value(axis, name, truth or {})
        _density_axis(axis, first, name)
        _limits(axis, _scalars(first["prior"])[name], np.concatenate(draws))
    return legend(figure, axes)


def _marginals(result: xr.DataTree, rows: list[list[str]], truth: Mapping[str, float]) -> Figure:
    columns = max(map(len, rows), default=1)
    panel = PANEL if columns == 1 else _SMALL
    figure, axes = panels(max(1, len(rows)), columns, panel=panel)
    for row, names in zip(axes, rows, strict=False):
        for axis, name in zip(row, names, strict=False):
            _marginal(axis, result, name, truth)
        for unused in row[len(names) :]:
            unused.remove()
    return legend(figure, np.array(figure.axes))


def _marginal(axis: Axes, result: xr.DataTree, name: str, truth: Mapping[str, float]) -> None:
    prior, posterior = (_scalars(result[group])[name] for group in ("prior", "posterior"))
    _histogram(axis, prior.ravel(), label="prior", color=_PRIOR, alpha=0.5, bins=BINS // 2)
    _histogram(axis, posterior.ravel(), label="posterior", color=_POSTERIOR, alpha=0.6)
    _true_value(axis, name, truth)
    _density_axis(axis, result, name)
    _limits(axis, prior, posterior)
    axis.locator_params(axis="x", nbins=4)


def _scalars(group: Any) -> dict[str, np.ndarray]:
    """Draws [chain, draw] of every number in a group, the elements of an array one by one."""
    variables = group.to_dataset().data_vars.items()
    return dict(one for name, draws in variables for one in scalars(str(name), draws.values))


def _names(result: xr.DataTree, *, placement: bool) -> list[str]:
    return [
        name
        for name, attributes in _attributes(result).items()
        if (attributes["role"] == Role.PLACEMENT.value) == placement
    ]


def _attributes(result: xr.DataTree) -> dict[str, dict[str, Any]]:
    """Unit, role and owner of every number, the elements of an array one by one."""
    variables = result["posterior"].to_dataset().data_vars.items()
    return {
        number: draws.attrs
        for name, draws in variables
        for number, _ in scalars(str(name), draws.values)
    }


def _histogram(
    axis: Axes, draws: np.ndarray, *, bins: int = BINS, fill: bool = True, **style: Any
) -> None:
    """Density of draws; each set over its own range, so that a narrow one keeps its shape."""
    edges = _cells(draws) if _are_nodes(draws) else np.histogram_bin_edges(draws, bins)
    density, edges = np.histogram(draws, edges, density=True)
    axis.stairs(density, edges, fill=fill, **style)


def _are_nodes(draws: np.ndarray) -> bool:
    distinct = np.unique(draws).size
    return 1 < distinct < min(MOST_NODES, draws.size / 10)


def _cells(draws: np.ndarray) -> np.ndarray:
    """Edges midway between the values, so that a node stands for the interval about it."""
    values = np.unique(draws)
    middle = (values[1:] + values[:-1]) / 2
    first, last = 2 * values[0] - middle[0], 2 * values[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _true_value(axis: Axes, name: str, truth: Mapping[str, float]) -> None:
    if name in truth:
        axis.axvline(truth[name], color="k", linestyle=":", label="true value")


def _limits(axis: Axes, prior: np.ndarray, posterior: np.ndarray) -> None:
    """Show the whole prior where the posterior fills a part of it, else the posterior alone."""
    low, high = posterior.min(), posterior.max()
    if high - low < 0.2 * np.ptp(prior):
        margin = 0.5 * (high - low) if high > low else 0.05 * np.ptp(prior)
        axis.set_xlim(low - margin, high + margin)


def _amplitude(values: xr.DataArray) -> xr.DataArray:
    """Logarithm of the amplitude of a complex output; any other output as it is."""
    if "part" not in values.dims:
        return values
    with np.errstate(divide="ignore"):
        logarithm: xr.DataArray = xr.ufuncs.log10((values**2).sum("part", skipna=False)) / 2
    return logarithm.assign_attrs(units=f"log10 of {values.attrs['units']}")


def _band(axis: Axes, values: xr.DataArray, label: str, color: str) -> None:
    draws = values.stack(sample=("chain", "draw"))
    low, high = (draws.quantile(q, "sample") for q in BAND)
    line = "-" if values.sizes["frequency"] > _SPARSE else ".-"
    axis.fill_between(
        values["frequency"], low, high, color=color, alpha=0.3, label=f"{label}, 90 % band"
    )
    axis.plot(values["frequency"], draws.mean("sample"), line, color=color, label=f"{label}, mean")


def _response_axis(axis: Axes, values: xr.DataArray) -> None:
    axis.set_title(f"sensor {values['sensor'].item()}, actuator {values['actuator'].item()}")
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(on_two_lines(values.attrs["units"]))


def _difference_axis(axis: Axes, values: xr.DataArray) -> None:
    # A difference of logarithms is that of a ratio and has no unit.
    logarithm, _, unit = values.attrs["units"].rpartition(" ")
    axis.set_xlabel("frequency [Hz]")
    unit = "log10 of ratio" if logarithm.startswith("log10") else unit
    axis.set_ylabel(f"difference from mean\n{unit}")


def _density_axis(axis: Axes, result: xr.DataTree, name: str) -> None:
    unit = _unit(result, name)
    axis.set_xlabel(_with_unit(result, name))
    axis.set_ylabel("probability density" + ("" if unit == "1" else f" [1/{unit}]"))


def _with_unit(result: xr.DataTree, name: str) -> str:
    # The angles of `orientation.rotation`, by the axes about which they turn.
    attributes = _attributes(result)[name]
    is_angle = attributes["field"] == "angles" and attributes["component"]
    about = f" about {'xyz'[int(attributes['component']) - 1]}" if is_angle else ""
    return f"{name}{about} [{attributes['units']}]"


def _unit(result: xr.DataTree, name: str) -> str:
    unit: str = _attributes(result)[name]["units"]
    return unit
