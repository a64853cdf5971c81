"""Figures of where to measure: maps of information, tolerances, the best placements."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .._shared.arguments import arguments_checked
from ..design.maps import SIGNIFICANT, lead, rivals
from ..design.place import Placement
from ..design.tolerance import FACTOR, ToleranceStudy
from ._colours import AFTER, INK, PAPER, Style
from ._figures import PANEL, STAR, color_bar, edges, panels

SQUARE = (5.6, 4.6)
"""Width and height of a map [inch]."""

MOST_SHOWN = 20
"""Greatest number of placements in a figure."""

CONTOURS = 6
"""Contour lines of a map."""

GAIN, ERROR = "information_gain", "information_gain_se"
"""Names of the information gain and of its standard error in results."""

_INFORMATION = "information [nat]"
_RIVAL: Style = {"marker": ".", "color": PAPER, "markeredgecolor": INK, "linestyle": "none"}
_AS_GOOD = f"no worse than the best within {SIGNIFICANT:g} standard errors"
_ERRORS = f"± {SIGNIFICANT:g} standard errors"


@arguments_checked
def information(learnt: xr.Dataset, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw a map of information with the optimum and how sure it is (Figures 3 to 5 of the paper).

    Two transducers on a line make a map; one makes a curve with its errors. Of more than two, or
    in space, each panel shows the best over all others.

    Parameters
    ----------
    learnt
        What `information_map` returned.
    axes
        Axes to draw in, one for each pair of transducers on a line, or for each in space; None for
        a new figure.

    Examples
    --------
    >>> bp.plots.placement.information(learnt).axes[0].get_xlabel()
    'position of s1 [m]'
    """
    pairs = _pairs(learnt, [str(name) for name in learnt[GAIN].dims])
    size = SQUARE if max(map(len, pairs)) > 1 else PANEL
    layout = panels(1, len(pairs), axes, size=size)
    for panel, pair in zip(layout.axes.flat, pairs, strict=True):
        _draw(panel, learnt, pair)
    return layout.with_legend()


@arguments_checked
def tolerances(study: ToleranceStudy, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw maps of information for each tolerance side by side, all in one scale of colours.

    Of more than two transducers, of the first two, each best over all others.

    Parameters
    ----------
    study
        What `tolerance_study` returned.
    axes
        Axes to draw in, one for each tolerance; None for a new figure.

    Examples
    --------
    >>> len(bp.plots.placement.tolerances(study).axes)
    2
    """
    gain = study.maps[GAIN]
    pair = _pairs(study.maps, [str(name) for name in gain.dims if name != FACTOR])[0]
    size = SQUARE if len(pair) > 1 else PANEL
    layout = panels(1, study.maps.sizes[FACTOR], axes, size=size)
    scale = {"vmin": float(gain.min()), "vmax": float(gain.max())}
    for number, panel in enumerate(layout.axes.flat):
        learnt = study.maps.isel({FACTOR: number})
        _draw(panel, learnt, pair, **scale)
        panel.set_title(f"{float(learnt[FACTOR]):g} times the tolerance")
    return layout.with_legend()


@arguments_checked
def placements(best: Placement, *, ax: Axes | None = None) -> Figure:
    """Draw the information of the best placements that were tried, with two standard errors.

    Parameters
    ----------
    best
        What `place` returned.
    ax
        Axes to draw in; None for a new figure.

    Examples
    --------
    >>> bp.plots.placement.placements(best).axes[0].get_xlabel()
    'rank among 2 placements that were tried'
    """
    shown = best.table.head(MOST_SHOWN)
    layout = panels(1, 1, ax)
    panel, rank = layout.only, np.arange(len(shown)) + 1
    bars: Style = {"fmt": "o", "color": AFTER, "markersize": 4, "capsize": 2}
    panel.errorbar(rank, shown[GAIN], SIGNIFICANT * shown[ERROR], label=_ERRORS, **bars)
    panel.plot(rank[:1], shown[GAIN][:1], label="best", zorder=4, **STAR)
    panel.set_xlim(0.5, len(shown) + 0.5)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    panel.set_xlabel(f"rank among {len(best.table)} placements that were tried")
    panel.set_ylabel(_INFORMATION)
    return layout.with_legend()


def _pairs(learnt: xr.Dataset, names: list[str]) -> list[tuple[str, ...]]:
    """Transducers that share a panel: two on lines, or one alone."""
    if len(names) > 1 and all(name in learnt.coords for name in names):
        return list(itertools.combinations(names, 2))
    return [(name,) for name in names]


def _draw(panel: Axes, learnt: xr.Dataset, pair: tuple[str, ...], **scale: float) -> None:
    profile = _profile(learnt, pair)
    if len(pair) == 2:
        _draw_map(panel, profile, scale)
    elif pair[0] in learnt.coords:
        _draw_curve(panel, profile, scale)
    else:
        _draw_points(panel, profile, scale)


class _Profile(NamedTuple):
    """Information of some transducers, the best over all others."""

    learnt: xr.Dataset
    """Information by their positions."""
    as_good: np.ndarray
    """Which other positions are as good as the best."""
    best: dict[str, int]
    """Number of the best position of each."""


def _profile(learnt: xr.Dataset, names: tuple[str, ...]) -> _Profile:
    others = [str(name) for name in learnt[GAIN].dims if name not in names]
    best = lead(learnt).best
    as_good = rivals(learnt).any(others).transpose(*names).values
    as_good[tuple(best[name] for name in names)] = False
    if others:
        stacked = learnt[[GAIN, ERROR]].stack(others_of_all=others)
        learnt = stacked.isel(others_of_all=stacked[GAIN].argmax("others_of_all"))
    return _Profile(learnt, as_good, {name: best[name] for name in names})


def _draw_map(panel: Axes, profile: _Profile, scale: Style) -> None:
    learnt, as_good, best = profile
    across, up = best
    x, y = learnt[across].values, learnt[up].values
    gain = learnt[GAIN].transpose(up, across).values
    mesh = panel.pcolormesh(edges(x), edges(y), gain, **scale)
    color_bar(mesh, panel, _INFORMATION)
    if min(gain.shape) > 1 and np.ptp(gain) > 0:
        levels = np.linspace(*mesh.get_clim(), CONTOURS + 2)[1:-1]
        panel.contour(x, y, gain, levels=levels, colors=PAPER, linewidths=0.5)
    column, row = np.nonzero(as_good)
    _mark_as_good(panel, x[column], y[row])
    panel.plot(x[best[across]], y[best[up]], label="best", **STAR)
    panel.set_xlabel(f"position of {across} [m]")
    panel.set_ylabel(f"position of {up} [m]")


def _mark_as_good(panel: Axes, x: np.ndarray, y: np.ndarray, **style: str) -> None:
    """Mark these positions, of which a legend says nothing where there are none."""
    if x.size:
        panel.plot(x, y, label=_AS_GOOD, **_RIVAL | style)


def _draw_curve(panel: Axes, profile: _Profile, scale: Style) -> None:
    learnt, as_good, best = profile
    (name,) = best
    x, gain, error = learnt[name].values, learnt[GAIN].values, SIGNIFICANT * learnt[ERROR].values
    panel.fill_between(x, gain - error, gain + error, color=AFTER, alpha=0.3, label=_ERRORS)
    panel.plot(x, gain, ".-", color=AFTER, label="information")
    _mark_as_good(panel, x[as_good], gain[as_good], marker="o", fillstyle="none")
    panel.plot(x[best[name]], gain[best[name]], label="best", **STAR)
    if scale:
        panel.set_ylim(min(0.0, scale["vmin"]), 1.05 * scale["vmax"])
    panel.set_xlabel(f"position of {name} [m]")
    panel.set_ylabel(_INFORMATION)


def _draw_points(panel: Axes, profile: _Profile, scale: Style) -> None:
    """Draw positions in space, seen along the axis in which they differ least."""
    learnt, as_good, best = profile
    (name,) = best
    coordinates = {axis: learnt[f"{name}.{axis}"].values for axis in "xyz"}
    widest = sorted(coordinates, key=lambda axis: -np.ptp(coordinates[axis]))[:2]
    across, up = sorted(widest)
    x, y = coordinates[across], coordinates[up]
    marks = panel.scatter(x, y, c=learnt[GAIN].values, s=60, **scale)
    color_bar(marks, panel, _INFORMATION)
    _mark_as_good(panel, x[as_good], y[as_good])
    panel.plot(x[best[name]], y[best[name]], label="best", **STAR)
    panel.set_xlabel(f"{across} of {name} [m]")
    panel.set_ylabel(f"{up} of {name} [m]")
    panel.set_aspect("equal", adjustable="datalim")
