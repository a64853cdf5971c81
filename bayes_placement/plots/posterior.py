"""Figures of a posterior: data and prediction, parameters, placement, methods beside each other."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from .._shared.arguments import arguments_checked, check_annotated
from .._shared.errors import InputError
from ..experiment.experiment import RESPONSE
from ..inference.bands import labelled_amplitude, phase_band, predictive_band
from ..inference.report import check_result
from ._colours import DATA, Style
from ._figures import (
    channel_panels,
    channels,
    in_decibels,
    on_two_lines,
    pages_of,
    panels,
    share_frequency,
)
from ._fit_panels import POSTERIOR, draw_band, draw_phases, unit_of_difference
from ._marginal_panels import (
    PRIOR,
    ScaledUnknown,
    abreast,
    by_owner,
    draw_marginal,
    draw_methods,
    drawn_as_strips,
    drawn_in_rows,
    in_rows,
    inferred,
)


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
    _check("measured_against_band", "result", result)
    return _bands(predictive_band(result), phase_band(result), axes)


@arguments_checked
def measured_against_band_pages(result: xr.DataTree) -> list[Figure]:
    """Draw `measured_against_band` on pages of at most three sensors and three columns.

    Parameters
    ----------
    result
        What `infer` returned.

    Examples
    --------
    >>> len(bp.plots.posterior.measured_against_band_pages(posterior))
    1
    """
    _check("measured_against_band_pages", "result", result)
    band, phase = predictive_band(result), phase_band(result)
    return [
        _bands(band.isel(page), None if phase is None else phase.isel(page), None)
        for page in pages_of(band)
    ]


def _bands(band: xr.Dataset, phase: xr.Dataset | None, axes: object) -> Figure:
    """Responses, phases if there are any, and differences from the mean."""
    heights = [1.0, 0.7] if phase is None else [1.0, 0.5, 0.7]
    layout, rows = channel_panels(band, heights, axes), len(heights)
    shown, label = in_decibels(band, band.attrs["units"])
    for panel, channel in channels(layout.axes[::rows], shown):
        draw_band(panel, channel, "posterior predictive")
        panel.set_ylabel(label)
    for panel, channel in [] if phase is None else channels(layout.axes[1::rows], phase):
        draw_phases(panel, channel)
    for panel, channel in channels(layout.axes[rows - 1 :: rows], shown - shown["mean"]):
        draw_band(panel, channel, "posterior predictive")
        panel.set_ylabel(f"from mean\n{unit_of_difference(band.attrs['units'])}")
    share_frequency(layout.axes, rows)
    return layout.with_legend()


@arguments_checked
def response_band(
    simulated: xr.DataTree,
    *,
    reference: object = None,
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

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> bp.plots.posterior.response_band(simulated).axes[0].get_xlabel()
    'frequency [Hz]'
    """
    return _simulated_bands(_simulated_band(simulated, reference), axes)


@arguments_checked
def response_band_pages(simulated: xr.DataTree, *, reference: object = None) -> list[Figure]:
    """Draw `response_band` on pages of at most three sensors and three columns.

    Parameters
    ----------
    simulated, reference
        As for `response_band`.

    Examples
    --------
    >>> len(bp.plots.posterior.response_band_pages(simulated))
    1
    """
    band = _simulated_band(simulated, reference)
    return [_simulated_bands(band.isel(page), None) for page in pages_of(band)]


def _simulated_band(simulated: xr.DataTree, reference: object) -> xr.Dataset:
    """Mean and band of simulated outputs, and the reference where there is one."""
    band = predictive_band(simulated)
    if reference is None:
        return band
    check_annotated("reference", reference, ArrayLike)
    values = np.asarray(reference)
    draw = simulated["prior_predictive"].to_dataset()[RESPONSE].isel(chain=0, draw=0, drop=True)
    if values.shape != draw.shape:
        raise InputError(
            f"reference of shape {values.shape} was given; {draw.shape} is needed, "
            "since it is drawn along with the draws: reference=experiment.nominal().predict()."
        )
    return band.assign(reference=labelled_amplitude(draw.copy(data=values)))


def _simulated_bands(band: xr.Dataset, axes: object) -> Figure:
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

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> figure = bp.plots.posterior.parameters(posterior, truth={"structure.damping.ratio": 0.04})
    >>> figure.axes[0].get_xlabel()
    'structure.damping.ratio [%]'
    """
    unknowns = _inferred("parameters", result)
    rows = in_rows([unknown for unknown in unknowns if not unknown.is_placement])
    return drawn_in_rows(rows, axes, partial(draw_marginal, truth=truth or {}))


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

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> bp.plots.posterior.placement(posterior).axes[0].get_xlabel()
    'sensor.s1.position [mm]'
    """
    rows = abreast(by_owner(_inferred("placement", result)))
    return drawn_in_rows(rows, axes, partial(draw_marginal, truth=truth or {}))


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

    Returns
    -------
    Figure
        That of `ax`, or a new one.

    Examples
    --------
    >>> names = {"first": "structure.damping.ratio", "second": "sensor.s1.position"}
    >>> bp.plots.posterior.pair(posterior, **names).axes[0].get_ylabel()
    'sensor.s1.position [mm]'
    """
    unknowns = {unknown.name: unknown for unknown in _inferred("pair", result)}
    for name in (first, second):
        _check_unknown([*unknowns], name)
    across, up = unknowns[first], unknowns[second]
    layout = panels(1, 1, ax, size=(6.4, 5.0))
    panel = layout.only
    panel.plot(across.prior, up.prior, ".", color=PRIOR, markersize=3, label="prior")
    style: Style = {"color": POSTERIOR, "markersize": 3}
    panel.plot(across.posterior, up.posterior, ".", label="posterior", **style)
    if truth and first in truth and second in truth:
        true = across.scaled(truth[first]), up.scaled(truth[second])
        panel.plot(*true, "x", color=DATA, markersize=10, markeredgewidth=2, label="true value")
    panel.set_xlabel(across.label)
    panel.set_ylabel(up.label)
    panel.ticklabel_format(useOffset=False)
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

    Returns
    -------
    Figure
        That of `axes`, or a new one.

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
    unknowns = {name: _inferred("methods", result, name) for name, result in results.items()}
    rows = in_rows([first for first in next(iter(unknowns.values())) if not first.is_placement])
    return drawn_in_rows(rows, axes, partial(draw_methods, unknowns=unknowns, truth=truth or {}))


@arguments_checked
def intervals(
    result: xr.DataTree,
    *,
    truth: Mapping[str, float] | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw the 95 % interval of every unknown on that of its prior, each on an axis of its own.

    Parameters
    ----------
    result
        What `infer` returned.
    truth
        True values by name, where they are known.
    axes
        Axes to draw in, one for each unknown; None for a new figure.

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> bp.plots.posterior.intervals(posterior).axes[0].get_ylabel()
    'structure.damping.ratio [%]'
    """
    return drawn_as_strips(_inferred("intervals", result), truth or {}, axes)


def _inferred(function: str, result: xr.DataTree, name: str = "result") -> list[ScaledUnknown]:
    """Every number that was inferred, of a result of ours."""
    _check(function, name, result)
    return inferred(result)


def _check(function: str, name: str, result: xr.DataTree) -> None:
    argument = "bp.infer(experiment, measurement)"
    argument = f'{{"{name}": {argument}}}' if function == "methods" else argument
    why = "names, units and priors of the unknowns are drawn along"
    check_result(name, result, why, f"plots.posterior.{function}({argument})")


def _check_unknown(names: list[str], name: str) -> None:
    if name not in names:
        raise InputError(
            f"{name!r} was given; one of {', '.join(names)} is needed, since the result has no "
            f"other unknowns: pair(result, first={names[0]!r}, second={names[-1]!r})."
        )
