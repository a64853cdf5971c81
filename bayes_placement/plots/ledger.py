"""ledger: in, what explains a misfit; out, one figure each: the suspects, the falling error.

Not known here: how anything was computed.
"""

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ..criticism.missing.explain import Explanation
from ..criticism.missing.ledger import Ledger
from ..experiment.experiment import Experiment
from ..positions.vectors import Recorded
from . import structure as structure_plots
from ._figures import (
    PANEL,
    STAR,
    channel_panels,
    channels,
    edges,
    legend,
    maps_beside,
    on_two_lines,
    panels,
)

LEVEL = 0.01
"""Corrected p-value below which a score is more than chance."""

_SUSPECT, _CHANCE, _FLOOR = "C0", "0.7", "k"
_BEFORE, _AFTER, _DATA = "C1", "C0", "C3"
_SHIFTED = "misplaced_sensor"
_SIZE = "size of score"
MOST_MAPS = 4
"""Greatest number of maps of a structure in space."""

_BAR = 0.3
"""Height of a bar [inch]."""

_MAP = 4.8
"""Width of a map of a structure in space [inch]."""

_WIDE = 32
"""Letters in a line beside a bar."""

_TINY = 1e-3
_BESIDE: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "va": "center"}
_MIDDLE: dict[str, Any] = {
    "xycoords": ("axes fraction", "data"),
    "ha": "center",
    "va": "center",
    "color": "0.5",
    "fontsize": "small",
}


def suspicion(
    table: pd.DataFrame,
    places: Mapping[str, Recorded] | None = None,
    experiment: Experiment | None = None,
) -> Figure:
    """Score of every candidate: maps of the structure, and the greatest of each kind.

    A score compares the model as given with a trace of the effect, once all that the model can
    absorb is left out: where it fails badly, everything is suspect, and the brightest is a first
    guess that the evidence confirms or not.

    A line has one strip for each kind. A structure in space has one map for each of the most
    suspect kinds that have a place; effects on a region, a member or a sensor are drawn in the
    middle of it, or where it was recorded.

    Parameters
    ----------
    table
        `Explanation.suspicion` or `Ledger.suspicion`.
    places
        Places found [m], by kinds of effects: numbers on a line, three coordinates in space.
    experiment
        Experiment whose structure and instruments are drawn below the map of a structure in space.
    """
    sized = table.assign(size=table["score"].abs())
    kinds = list(sized.groupby("kind")["size"].max().sort_values().index)
    found = {kind: at for kind, at in (places or {}).items() if kind in kinds}
    if "z" in sized and sized["z"].notna().any():
        return _in_space(sized, kinds, found, experiment)
    return _on_a_line(sized, kinds, found)


def _in_space(
    table: pd.DataFrame,
    kinds: list[str],
    found: Mapping[str, Any],
    experiment: Experiment | None,
) -> Figure:
    placed = table[table["z"].notna()]
    shown = [kind for kind in reversed(kinds) if kind in set(placed["kind"])][:MOST_MAPS]
    seen = structure_plots.view(structure_plots.extent(experiment, placed))
    figure, maps, ranked = maps_beside(len(shown), seen.projection, _MAP, 1.4 * _height(kinds))
    for axis, kind in zip(maps, shown, strict=True):
        if experiment is not None:
            structure_plots.structure(axis, seen, experiment)
        rows = placed[placed["kind"] == kind]
        gap = " " if seen.projection else "\n"
        structure_plots.suspects(figure, axis, seen, rows, f"{_SIZE}{gap}[standard deviations]")
        if kind in found:
            structure_plots.fitted(axis, seen, found[kind])
        structure_plots.dressed(axis, seen)
        axis.set_title(f"suspicion of {kind}")
    _greatest(ranked, table, kinds)
    ranked.set_yticks(range(len(kinds)), [_with_setting(table, kind) for kind in kinds])
    return legend(figure, np.array([*maps, ranked]))


def _with_setting(table: pd.DataFrame, kind: str) -> str:
    """A kind, and on a second line what of the structure its greatest score is about."""
    worst = table[table["kind"] == kind].nlargest(1, "size")
    said = worst["setting"].iloc[0] if "setting" in worst else ""
    return "\n".join([kind, *textwrap.wrap(said, _WIDE)])


def _on_a_line(table: pd.DataFrame, kinds: list[str], found: Mapping[str, Any]) -> Figure:
    figure, axes = panels(1, 2, panel=(PANEL[0], _height(kinds)))
    mapped, ranked = axes[0]
    _map(figure, mapped, table, kinds)
    _greatest(ranked, table, kinds)
    if found:
        rows = [kinds.index(kind) for kind in found]
        mapped.plot(list(found.values()), rows, **STAR, label="place as fitted")
    for axis in axes[0]:
        axis.set_ylim(-0.5, len(kinds) - 0.5)
    mapped.set_yticks(range(len(kinds)), kinds)
    ranked.set_yticks([])
    return legend(figure, axes)


def _map(figure: Figure, axis: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    """One strip for each kind; blank for kinds that have no place."""
    # What a misplaced sensor has is a shift, not a place.
    placed = table[table["at"].notna() & (table["kind"] != _SHIFTED)]
    top = Normalize(0.0, max(float(table["size"].max()), structure_plots.LEAST_BRIGHT))
    for kind, rows in placed.groupby("kind"):
        most = rows.groupby("at")["size"].max()
        strip = kinds.index(str(kind)) + np.array([-0.4, 0.4])
        axis.pcolormesh(edges(most.index.to_numpy()), strip, most.to_numpy()[None], norm=top)
    blank = [kinds.index(kind) for kind in kinds if kind not in set(placed["kind"])]
    for row in blank:
        axis.annotate("no place", (0.5, row), **_MIDDLE)
    axis.set_xlabel("place along the structure [m]")
    axis.set_ylabel("effect [kind]")
    axis.set_title("suspicion along the structure")
    figure.colorbar(ScalarMappable(top), ax=axis, label=f"{_SIZE} [standard deviations]")


def _greatest(axis: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    most = table.groupby("kind").agg({"size": "max", "p_value": "min"}).loc[kinds]
    told = (most["p_value"] < LEVEL).to_numpy()
    for chosen, color, label in (
        (told, _SUSPECT, f"more than chance (corrected p < {LEVEL:g})"),
        (~told, _CHANCE, "no more than chance"),
    ):
        if chosen.any():
            axis.barh(np.flatnonzero(chosen), most["size"][chosen], color=color, label=label)
    for place, value in enumerate(most["size"]):
        axis.annotate(_short(value), (value, place), **_BESIDE)
    axis.margins(x=0.12)
    axis.set_xlim(left=0)
    axis.set_xlabel(f"greatest {_SIZE} [standard deviations]")
    axis.set_title("suspicion of each kind")


def probabilities(found: Explanation | Ledger) -> Figure:
    """Probability of each effect, of nothing missing and of none of these."""
    share = pd.Series(found.probabilities).sort_values(kind="stable")
    figure, axes = panels(1, 1, panel=(PANEL[0], 1.2 + _BAR * len(share)))
    axis = axes[0, 0]
    axis.barh(range(len(share)), share, color=_SUSPECT)
    for place, value in enumerate(share):
        text = f"{value:.3f}" if value >= _TINY else f"< {_TINY:g}"
        axis.annotate(text, (value, place), **_BESIDE)
    axis.set_yticks(range(len(share)), share.index)
    axis.set_xlim(0, 1.15)
    axis.set_xlabel("posterior probability [1]")
    return figure


def error_falls(ledger: Ledger) -> Figure:
    """Misfit of the model as given, then with one more effect each time."""
    names = ["as given", *(f"+ {step.added}" for step in ledger.steps[1:])]
    misfit = [step.chi2_per_datum for step in ledger.steps]
    figure, axes = panels(1, 1)
    axis = axes[0, 0]
    axis.plot(range(len(misfit)), misfit, "o-", color=_SUSPECT, label="misfit of the best fit")
    for place, value in enumerate(misfit):
        axis.annotate(_short(value), (place, value), (8, 4), textcoords="offset points")
    axis.axhline(1.0, color=_FLOOR, linestyle="--", label="noise floor: a right model gives 1")
    axis.set_yscale("log")
    axis.set_ylim(0.5 * min(1.0, *misfit, 1.0), 2 * max(1.0, *misfit, 1.0))
    axis.set_xlim(-0.5, len(misfit) - 0.5)
    axis.set_xticks(range(len(names)), names)
    axis.set_xlabel("model [effects added one after the other]")
    axis.set_ylabel("chi2 per datum [1]")
    return legend(figure, axes)


def before_and_after(fits: Mapping[str, xr.Dataset]) -> Figure:
    """Measured and fitted outputs of each model, and below each pair the error beside the noise.

    Parameters
    ----------
    fits
        What each model says beside the data, by its name: `measured`, `predicted`, `error` and
        `noise`.
    """
    first = next(iter(fits.values()))
    figure, axes = channel_panels(first, [1.0, 0.8])
    colors = [_BEFORE, _AFTER] if len(fits) > 1 else [_AFTER]
    for (name, fit), color in zip(fits.items(), colors, strict=True):
        for axis, channel in channels(axes[::2], fit):
            _responses(axis, channel, name, color)
        for axis, channel in channels(axes[1::2], fit):
            _errors(axis, channel, name, color)
    return legend(figure, axes)


def _responses(axis: Axes, at: xr.Dataset, name: str, color: str) -> None:
    (points,) = axis.plot(at["frequency"], at["measured"], ".", color=_DATA)
    points.set(label="measured", markersize=4, zorder=1)
    axis.plot(at["frequency"], at["predicted"], color=color, label=name)
    axis.set_ylabel(on_two_lines(at["measured"].attrs["units"]))


def _errors(axis: Axes, at: xr.Dataset, name: str, color: str) -> None:
    (points,) = axis.plot(at["frequency"], at["error"], ".", color=color)
    points.set(label=f"error, {name}", markersize=4)
    axis.plot(at["frequency"], at["noise"], color=_FLOOR, linewidth=1, label="noise")
    axis.set_yscale("log")
    whole = at["error"].attrs["units"]
    unit = "log10 of ratio]" if whole.startswith("log10") else whole.rpartition("[")[2]
    axis.set_ylabel(f"size of error\n[{unit}")


def _height(kinds: list[str]) -> float:
    return max(PANEL[1], 1.2 + _BAR * len(kinds))


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"
