"""Figures of the misfit of a fitted model: where it fails, and how it looks there."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from .._shared.arguments import arguments_checked
from .._shared.labels import AS_DRAWN
from ..criticism.check.misfit import Misfit
from ._colours import AFTER, BEFORE, INK
from ._figures import (
    PAGE,
    PANEL,
    channel_panels,
    channels,
    edges,
    force_levels,
    frequency_axis,
    pages_of,
    panels,
)
from ._fit_panels import draw_maps, height_of, in_bands, name_rows
from ._fits import Fits, fits_of
from ._plain_figure import WIDTH

FIRST_PART, SECOND_PART = AFTER, BEFORE
"""Colours of the real and the imaginary part."""

FAINTEST, BRIGHTEST = 0.3, 10.0
"""Least range of colours of the residual map [noise deviations]."""


@arguments_checked
def residual_map(misfit: Misfit, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw the size of the residual over the noise, channel pair against frequency.

    Parameters
    ----------
    misfit
        What `check` returned.
    axes
        Axes to draw in, one for each force level; None for a new figure.

    Examples
    --------
    >>> bp.plots.misfit.residual_map(misfit).axes[0].get_xlabel()
    'frequency [Hz]'
    """
    levels = force_levels(misfit.response)
    relative = misfit.response["misfit"]
    pairs = relative.stack(pair=("sensor", "actuator"))
    names = [f"{sensor}, {actuator}" for sensor, actuator in pairs["pair"].values]
    size = (PANEL[0], min(max(PANEL[1], height_of(len(names))), PAGE / len(levels)))
    layout = panels(len(levels), 1, axes, size=size)
    norm = LogNorm(FAINTEST, max(BRIGHTEST, float(relative.max())), clip=True)
    for panel, (level, response) in zip(layout.axes.flat, levels, strict=True):
        lines, rows = response["frequency"].values, np.arange(len(names) + 1) - 0.5
        values = response["misfit"].stack(pair=("sensor", "actuator")).transpose("pair", ...)
        mesh = panel.pcolormesh(edges(lines), rows, values, norm=norm)
        name_rows(panel, names)
        frequency_axis(panel, lines)
        panel.set_ylabel("channel [sensor, actuator]")
        panel.set_title(f"residual{level}")
    label = f"size of residual [{relative.attrs['units']}]"
    layout.figure.colorbar(mesh, ax=layout.axes.ravel().tolist(), label=label)
    return layout.figure


@arguments_checked
def residual_maps(result: Fits, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw the size of the residual over the noise of fitted models, channel pair against band.

    Parameters
    ----------
    result
        What `improve` returned of FRFs, or its `fits`; the model as drawn is left out.
    axes
        Axes to draw in, one for each fitted model; None for a new figure.

    Examples
    --------
    >>> bp.plots.misfit.residual_maps(ledger).axes[0].get_title()
    'as given'
    """
    sizes = {name: in_bands(fit) for name, fit in fits_of(result).items() if name != AS_DRAWN}
    height = height_of(next(iter(sizes.values())).sizes["channel"])
    layout = panels(len(sizes), 1, axes, size=(WIDTH, height))
    draw_maps(layout.figure, layout.axes, sizes)
    return layout.figure


@arguments_checked
def discrepancy(misfit: Misfit, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw residuals and their smooth part with its 95 % band, both over the noise.

    Parameters
    ----------
    misfit
        What `check` returned.
    axes
        Axes to draw in: a row for each sensor, a column for each actuator and force level; None
        for a new figure.

    Examples
    --------
    >>> bp.plots.misfit.discrepancy(misfit).axes[0].get_xlabel()
    'frequency [Hz]'
    """
    return _discrepancy(_over_noise(misfit), axes)


@arguments_checked
def discrepancy_pages(misfit: Misfit) -> list[Figure]:
    """Draw `discrepancy` on pages of at most three sensors and three columns.

    Parameters
    ----------
    misfit
        What `check` returned.

    Examples
    --------
    >>> len(bp.plots.misfit.discrepancy_pages(misfit))
    1
    """
    dataset = _over_noise(misfit)
    return [_discrepancy(dataset.isel(page), None) for page in pages_of(dataset)]


def _over_noise(misfit: Misfit) -> xr.Dataset:
    """Residuals and their smooth part over the noise."""
    residual = misfit.response["residual_over_noise"]
    noise = misfit.response["residual"] / residual
    smooth = misfit.discrepancy[["mean", "low", "high"]] / noise
    return smooth.assign(residual=residual)


def _discrepancy(dataset: xr.Dataset, axes: object) -> Figure:
    layout = channel_panels(dataset, [1.0], axes)
    for panel, channel in channels(layout.axes, dataset):
        panel.axhline(0.0, color=INK, linewidth=0.5)
        for (name, part), color in zip(_parts(channel), (FIRST_PART, SECOND_PART), strict=False):
            _draw_part(panel, part, name, color)
        panel.set_ylabel(f"discrepancy\n[{dataset['residual'].attrs['units']}]")
    return layout.with_legend()


def _draw_part(panel: Axes, part: xr.Dataset, name: str, color: str) -> None:
    lines, low, high = (part[variable].values for variable in ("frequency", "low", "high"))
    (points,) = panel.plot(lines, part["residual"], ".", color=color)
    points.set(label=f"residual{name}", markersize=4, alpha=0.5)
    panel.plot(lines, part["mean"], color=color, label=f"discrepancy{name}")
    label = f"discrepancy{name}, 95 % band"
    panel.fill_between(lines, low, high, color=color, alpha=0.3, label=label)


def _parts(dataset: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Real and imaginary part with the end of a label; real outputs as they are."""
    if "part" not in dataset.dims:
        yield "", dataset
        return
    for part in dataset["part"].values:
        yield f", {part} part", dataset.sel(part=part)
