"""Figures of a posterior: data and prediction, parameters, placement, methods beside each other."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from .._sites import Role
from .._types import InputError, arguments_checked, check_annotated
from ..experiment.experiment import RESPONSE
from ..inference.bands import labelled_amplitude, phase_band, predictive_band
from ..inference.estimates import scalars
from ._band_panels import DATA, POSTERIOR, draw_band, draw_phases, unit_of_difference
from ._figures import PANEL, Panels, channel_panels, channels, in_decibels, on_two_lines, panels

BINS = 40
"""Bins of a histogram of a posterior; that of a prior has half as many."""

MOST_NODES = 100
"""Draws of fewer values than this, many times each, are taken for nodes of a quadrature."""

SMALL_PANEL = (4.2, 3.0)
"""Width and height [inch] of a panel that has others beside it."""

PRIOR = "0.6"
"""Colour of priors."""

LINE_STYLES = ("-", "--", "-.", ":")


@arguments_checked
def measured_against_band(
    result: xr.DataTree, *, axes: Sequence[Axes] | np.ndarray | None = None
) -> Figure:
    """Draw measured outputs and the 90 % band of the posterior predictive.

    Amplitudes are in dB. Below each channel pair stand the phases of complex outputs, and what is
    drawn above less the mean of the band, which shows a band that is thinner than a line.

    Parameters
    ----------
    result
        What `infer` returned.
    axes
        Axes to draw in: for each sensor a row of responses, a column for each actuator and force
        level, below it a row of phases if outputs are complex, and one of differences; None for a
        new figure.

    Examples
    --------
    >>> bp.plots.posterior.measured_against_band(posterior).axes[-1].get_xlabel()
    'frequency [Hz]'
    """
    band, phase = predictive_band(result), phase_band(result)
    heights = [1.0, 0.7] if phase is None else [1.0, 0.5, 0.7]
    layout, rows = channel_panels(band, heights, axes), len(heights)
    shown, label = in_decibels(band, band.attrs["units"])
    for panel, channel in channels(layout.axes[::rows], shown):
        draw_band(panel, channel, "posterior predictive")
        panel.set_ylabel(label)
    for panel, channel in [] if phase is None else channels(layout.axes[1::rows], phase):
        draw_phases(panel, channel)
    for panel in [] if phase is None else layout.axes[1::rows].flat:  # it belongs to that above
        panel.set(title="", xlabel="")
    for panel, channel in channels(layout.axes[rows - 1 :: rows], shown - shown["mean"]):
        draw_band(panel, channel, "posterior predictive")
        panel.set_ylabel(f"difference from mean\n{unit_of_difference(band.attrs['units'])}")
    return layout.with_legend()


@arguments_checked
def response_band(
    simulated: xr.DataTree,
    *,
    reference: Any = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw mean and 90 % band of simulated outputs, as Figure 2 of the paper.

    Parameters
    ----------
    simulated
        What `simulate` returned.
    reference
        Outputs of the nominal experiment, `experiment.nominal().predict()`, drawn along
        (Figure 1).
    axes
        Axes to draw in: a row for each sensor, a column for each actuator and force level; None
        for a new figure.

    Examples
    --------
    >>> bp.plots.posterior.response_band(simulated).axes[0].get_xlabel()
    'frequency [Hz]'
    """
    band = predictive_band(simulated)
    if reference is not None:
        check_annotated("reference", reference, ArrayLike)
        draw = simulated["prior_predictive"].to_dataset()[RESPONSE].isel(chain=0, draw=0, drop=True)
        if np.shape(reference) != draw.shape:
            raise InputError(
                f"reference of shape {np.shape(reference)} was given; {draw.shape} is needed, "
                "since it is drawn along with the draws: reference=experiment.nominal().predict()."
            )
        band["reference"] = labelled_amplitude(draw.copy(data=np.asarray(reference)))
    layout = channel_panels(band, [1.0], axes)
    for panel, channel in channels(layout.axes, band):
        draw_band(panel, channel, "random draws")
        panel.set_ylabel(on_two_lines(band.attrs["units"]))
    return layout.with_legend()


@arguments_checked
def parameters(
    result: xr.DataTree,
    *,
    truth: Mapping[str, float] | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw prior and posterior of every parameter and noise level (Figures 6, 7 of the paper).

    Parameters
    ----------
    result
        What `infer` returned.
    truth
        True values by name, where they are known.
    axes
        Axes to draw in, one for each unknown; None for a new figure.

    Examples
    --------
    >>> figure = bp.plots.posterior.parameters(posterior, truth={"structure.damping.ratio": 0.04})
    >>> figure.axes[0].get_xlabel()
    'structure.damping.ratio [1]'
    """
    rows = [[name] for name in _names(result, placement=False)]
    return _marginals(result, rows, truth or {}, axes)


@arguments_checked
def placement(
    result: xr.DataTree,
    *,
    truth: Mapping[str, float] | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw prior and posterior of every position and angle, a row for each sensor and actuator.

    Parameters
    ----------
    result
        What `infer` returned.
    truth
        True values by name, where they are known.
    axes
        Axes to draw in, one for each unknown; None for a new figure.

    Examples
    --------
    >>> bp.plots.posterior.placement(posterior).axes[0].get_xlabel()
    'sensor.s1.position [m]'
    """
    names = _names(result, placement=True)
    attributes = _attributes(result)
    owners = itertools.groupby(names, lambda name: attributes[name]["owner"])
    return _marginals(result, [list(row) for _, row in owners], truth or {}, axes)


@arguments_checked
def pair(
    result: xr.DataTree,
    *,
    first: str,
    second: str,
    truth: Mapping[str, float] | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw two unknowns against each other: what the data know of them together.

    Parameters
    ----------
    result
        What `infer` returned.
    first, second
        Names of the unknowns along the two axes.
    truth
        True values by name, where they are known.
    ax
        Axes to draw in; None for a new figure.

    Examples
    --------
    >>> names = {"first": "structure.damping.ratio", "second": "sensor.s1.position"}
    >>> bp.plots.posterior.pair(posterior, **names).axes[0].get_ylabel()
    'sensor.s1.position [m]'
    """
    for name in (first, second):
        _check_unknown(result, name)
    layout = panels(1, 1, ax, size=(6.4, 5.0))
    panel = layout.only
    for group, color in (("prior", PRIOR), ("posterior", POSTERIOR)):
        draws = _scalars(result[group])
        across, up = draws[first].ravel(), draws[second].ravel()
        panel.plot(across, up, ".", color=color, markersize=3, label=group)
    if truth and first in truth and second in truth:
        cross: dict[str, Any] = {"color": DATA, "markersize": 10, "markeredgewidth": 2}
        panel.plot(truth[first], truth[second], "x", label="true value", **cross)
    panel.set_xlabel(_with_unit(result, first))
    panel.set_ylabel(_with_unit(result, second))
    return layout.with_legend()


@arguments_checked
def methods(
    results: Mapping[str, xr.DataTree],
    *,
    truth: Mapping[str, float] | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw the posterior of every parameter by each method, one over the other.

    Parameters
    ----------
    results
        What `infer` returned, by a name for each method.
    truth
        True values by name, where they are known.
    axes
        Axes to draw in, one for each parameter; None for a new figure.

    Examples
    --------
    >>> len(bp.plots.posterior.methods({"MAP": posterior, "again": posterior}).axes)
    1
    """
    if not results:
        raise InputError(
            "No results were given; those of at least one method are needed, since each is a row "
            'of the figure: methods({"SMC": bp.infer(experiment, measurement)}).'
        )
    first = next(iter(results.values()))
    names = _names(first, placement=False)
    layout = panels(max(1, len(names)), 1, axes)
    for panel, name in zip(layout.axes.flat, names, strict=False):
        draws = [_scalars(result["posterior"])[name].ravel() for result in results.values()]
        for number, (method, values) in enumerate(zip(results, draws, strict=True)):
            style: dict[str, Any] = {"color": f"C{number}", "linestyle": LINE_STYLES[number % 4]}
            _histogram(panel, values, label=method, fill=False, linewidth=1.5, **style)
        _true_value(panel, name, truth or {})
        _density_axis(panel, first, name)
        _limits(panel, _scalars(first["prior"])[name], np.concatenate(draws))
    return layout.with_legend()


def _marginals(
    result: xr.DataTree, rows: list[list[str]], truth: Mapping[str, float], axes: Any
) -> Figure:
    names = list(itertools.chain(*rows))
    layout = panels(1, max(1, len(names)), axes) if axes is not None else _ragged(rows)
    for panel, name in zip(layout.axes.flat, names, strict=False):
        _marginal(panel, result, name, truth)
    return layout.with_legend()


def _ragged(rows: list[list[str]]) -> Panels:
    """Panels of a new figure, of which the last of a row are left out where it has fewer."""
    columns = max(map(len, rows), default=1)
    size = PANEL if columns == 1 else SMALL_PANEL
    layout = panels(max(1, len(rows)), columns, size=size)
    lengths = [len(row) for row in rows] or [1]
    kept = []
    for row, length in zip(layout.axes, lengths, strict=True):
        kept += list(row[:length])
        for unused in row[length:]:
            unused.remove()
    return layout._replace(axes=np.array([kept], dtype=object))


def _marginal(panel: Axes, result: xr.DataTree, name: str, truth: Mapping[str, float]) -> None:
    prior, posterior = (_scalars(result[group])[name] for group in ("prior", "posterior"))
    _histogram(panel, prior.ravel(), label="prior", color=PRIOR, alpha=0.5, bins=BINS // 2)
    _histogram(panel, posterior.ravel(), label="posterior", color=POSTERIOR, alpha=0.6)
    _true_value(panel, name, truth)
    _density_axis(panel, result, name)
    _limits(panel, prior, posterior)
    panel.locator_params(axis="x", nbins=4)


def _check_unknown(result: xr.DataTree, name: str) -> None:
    names = [*_scalars(result["posterior"])]
    if name not in names:
        raise InputError(
            f"{name!r} was given; one of {', '.join(names)} is needed, since the result has no "
            f"other unknowns: pair(result, first={names[0]!r}, second={names[-1]!r})."
        )


def _scalars(group: Any) -> dict[str, np.ndarray]:
    """Draws [chain, draw] of every number in a group, the elements of an array one by one."""
    variables = group.to_dataset().data_vars.items()
    return dict(number for name, draws in variables for number in scalars(str(name), draws.values))


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
    panel: Axes, draws: np.ndarray, *, bins: int = BINS, fill: bool = True, **style: Any
) -> None:
    """Density of draws; each set over its own range, so that a narrow one keeps its shape."""
    edges = _cells(draws) if _are_nodes(draws) else np.histogram_bin_edges(draws, bins)
    density, edges = np.histogram(draws, edges, density=True)
    panel.stairs(density, edges, fill=fill, **style)


def _are_nodes(draws: np.ndarray) -> bool:
    distinct = np.unique(draws).size
    return 1 < distinct < min(MOST_NODES, draws.size / 10)


def _cells(draws: np.ndarray) -> np.ndarray:
    """Edges midway between the values, so that a node stands for the interval about it."""
    values = np.unique(draws)
    middle = (values[1:] + values[:-1]) / 2
    first, last = 2 * values[0] - middle[0], 2 * values[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _true_value(panel: Axes, name: str, truth: Mapping[str, float]) -> None:
    if name in truth:
        panel.axvline(truth[name], color="k", linestyle=":", label="true value")


def _limits(panel: Axes, prior: np.ndarray, posterior: np.ndarray) -> None:
    """Show the whole prior where the posterior fills a part of it, else the posterior alone."""
    low, high = posterior.min(), posterior.max()
    if high - low < 0.2 * np.ptp(prior):
        margin = 0.5 * (high - low) if high > low else 0.05 * np.ptp(prior)
        panel.set_xlim(low - margin, high + margin)


def _density_axis(panel: Axes, result: xr.DataTree, name: str) -> None:
    unit = _unit(result, name)
    panel.set_xlabel(_with_unit(result, name))
    panel.set_ylabel(f"probability density [{'1' if unit == '1' else f'1/{unit}'}]")


def _with_unit(result: xr.DataTree, name: str) -> str:
    """Name with its unit; of an angle of `orientation.rotation` also the axis of rotation."""
    attributes = _attributes(result)[name]
    is_angle = attributes["field"] == "angles" and attributes["component"]
    about = f" about {'xyz'[int(attributes['component']) - 1]}" if is_angle else ""
    return f"{name}{about} [{attributes['units']}]"


def _unit(result: xr.DataTree, name: str) -> str:
    unit: str = _attributes(result)[name]["units"]
    return unit
