"""placement: in, maps of information and placements; out, one figure each, with the optimum.

Not known here: how anything was computed.
"""

import itertools
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..design.maps import DOUBT, lead, rivals
from ..design.place import Placement
from ..design.tolerance import FACTOR, ToleranceStudy
from ._figures import PANEL, STAR, edges, legend, panels

_KL = "information [nat]"
_RIVAL: dict[str, Any] = {"marker": ".", "color": "w", "markeredgecolor": "k", "linestyle": "none"}
_AS_GOOD = f"no worse than the best within {DOUBT:g} standard errors"
_ERRORS = f"± {DOUBT:g} standard errors"
_SQUARE = (5.6, 4.6)
_MOST_SHOWN = 20


def information(whole: xr.Dataset) -> Figure:
    """Map of information, as Figures 3 to 5 of the paper, with the optimum and how sure it is.

    Two transducers on a line make a map; one makes a curve with its errors. Of more than two, or
    in space, each panel shows the best over all others.

    Parameters
    ----------
    whole
        What `information_map` returned.
    """
    names = [str(name) for name in whole["information_gain"].dims]
    pairs = _pairs(whole, names)
    figure, axes = panels(1, len(pairs), panel=_SQUARE if max(map(len, pairs)) > 1 else PANEL)
    for axis, pair in zip(axes.flat, pairs, strict=True):
        _panel(figure, axis, whole, pair)
    return legend(figure, axes)


def tolerances(study: ToleranceStudy) -> Figure:
    """Maps of information for each tolerance side by side, all in one scale of colours.

    Of more than two transducers, of the first two, each best over all others.
    """
    names = [str(name) for name in study.maps["information_gain"].dims if name != FACTOR]
    pair = _pairs(study.maps, names)[0]
    size = _SQUARE if len(pair) > 1 else PANEL
    figure, axes = panels(1, study.maps.sizes[FACTOR], panel=size)
    scale = {
        "vmin": float(study.maps["information_gain"].min()),
        "vmax": float(study.maps["information_gain"].max()),
    }
    for number, axis in enumerate(axes.flat):
        one = study.maps.isel({FACTOR: number})
        _panel(figure, axis, one, pair, **scale)
        axis.set_title(f"{float(one[FACTOR]):g} times the tolerance")
    return legend(figure, axes)


def placements(found: Placement) -> Figure:
    """Information of the best placements that were tried, with two standard errors."""
    some = found.table.head(_MOST_SHOWN)
    figure, axes = panels(1, 1)
    axis, rank = axes[0, 0], np.arange(len(some)) + 1
    bars = {"fmt": "o", "color": "C0", "markersize": 4, "capsize": 2}
    axis.errorbar(
        rank, some["information_gain"], DOUBT * some["information_gain_se"], label=_ERRORS, **bars
    )
    axis.plot(rank[:1], some["information_gain"][:1], label="best", zorder=4, **STAR)
    axis.set_xlim(0.5, len(some) + 0.5)
    axis.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axis.set_xlabel(f"rank among {len(found.table)} placements that were tried")
    axis.set_ylabel(_KL)
    return legend(figure, axes)


def _pairs(whole: xr.Dataset, names: list[str]) -> list[tuple[str, ...]]:
    """Transducers that share a panel: two on lines, or one alone."""
    if len(names) > 1 and all(name in whole.coords for name in names):
        return list(itertools.combinations(names, 2))
    return [(name,) for name in names]


def _panel(
    figure: Figure, axis: Axes, whole: xr.Dataset, pair: tuple[str, ...], **scale: Any
) -> None:
    shown = _profile(whole, pair)
    if len(pair) == 2:
        _map(figure, axis, shown, scale)
    elif pair[0] in whole.coords:
        _curve(axis, shown, scale)
    else:
        _places(figure, axis, shown, scale)


class _Shown(NamedTuple):
    """What a panel shows: information, which placements are as good as the best, and the best."""

    whole: xr.Dataset
    as_good: np.ndarray
    best: dict[str, int]


def _profile(whole: xr.Dataset, kept: tuple[str, ...]) -> _Shown:
    """Best over all transducers that a panel does not show; rivals likewise."""
    others = [str(name) for name in whole["information_gain"].dims if name not in kept]
    best = lead(whole).best
    as_good = rivals(whole).any(others).transpose(*kept).values
    if others:
        stacked = whole[["information_gain", "information_gain_se"]].stack(others_of_all=others)
        whole = stacked.isel(others_of_all=stacked["information_gain"].argmax("others_of_all"))
    return _Shown(whole, as_good, {name: best[name] for name in kept})


def _map(figure: Figure, axis: Axes, shown: _Shown, scale: dict[str, Any]) -> None:
    whole, as_good, best = shown
    across, up = best
    x, y = whole[across].values, whole[up].values
    kl = whole["information_gain"].transpose(up, across).values
    colours = axis.pcolormesh(edges(x), edges(y), kl, **scale)
    figure.colorbar(colours, ax=axis, label=_KL)
    if min(kl.shape) > 1 and np.ptp(kl) > 0:
        low, high = colours.get_clim()
        levels = np.linspace(low, high, 8)[1:-1]
        axis.contour(x, y, kl, levels=levels, colors="w", linewidths=0.5)
    column, row = np.nonzero(as_good)
    axis.plot(x[column], y[row], label=_AS_GOOD, **_RIVAL)
    axis.plot(x[best[across]], y[best[up]], label="best", **STAR)
    axis.set_xlabel(f"position of {across} [m]")
    axis.set_ylabel(f"position of {up} [m]")


def _curve(axis: Axes, shown: _Shown, scale: dict[str, Any]) -> None:
    whole, as_good, best = shown
    (name,) = best
    x, kl, error = (
        whole[name].values,
        whole["information_gain"].values,
        DOUBT * whole["information_gain_se"].values,
    )
    axis.fill_between(x, kl - error, kl + error, alpha=0.3, label=_ERRORS)
    axis.plot(x, kl, ".-", label="information")
    axis.plot(x[as_good], kl[as_good], "o", color="k", fillstyle="none", label=_AS_GOOD)
    axis.plot(x[best[name]], kl[best[name]], label="best", **STAR)
    if scale:
        axis.set_ylim(min(0.0, scale["vmin"]), 1.05 * scale["vmax"])
    axis.set_xlabel(f"position of {name} [m]")
    axis.set_ylabel(_KL)


def _places(figure: Figure, axis: Axes, shown: _Shown, scale: dict[str, Any]) -> None:
    """Places in space, seen along the axis in which they differ least."""
    whole, as_good, best = shown
    (name,) = best
    every = {one: whole[f"{name}.{one}"].values for one in "xyz"}
    across, up = sorted(sorted(every, key=lambda one: -np.ptp(every[one]))[:2])
    x, y = every[across], every[up]
    colours = axis.scatter(x, y, c=whole["information_gain"].values, s=60, **scale)
    figure.colorbar(colours, ax=axis, label=_KL)
    axis.plot(x[as_good], y[as_good], label=_AS_GOOD, **_RIVAL)
    axis.plot(x[best[name]], y[best[name]], label="best", **STAR)
    axis.set_xlabel(f"{across} of {name} [m]")
    axis.set_ylabel(f"{up} of {name} [m]")
    axis.set_aspect("equal", adjustable="datalim")
