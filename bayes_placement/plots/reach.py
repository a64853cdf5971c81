"""Figures of reach: where something missing may act, and the law that the data ask for."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import jax.numpy as jnp
import numpy as np
import pandas as pd
from jaxtyping import Inexact
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from .._shared.arguments import arguments_checked
from ..criticism.reach._at_port import subject_in_words
from ..criticism.reach._channels import CHANNELS, NOWHERE
from ..criticism.reach._filters import ChannelFilter
from ..criticism.reach.reach import Reach
from ..experiment.experiment import Experiment
from ..laws.law import Law
from ..laws.tabulated import COMPLIANCES
from ..positions.vectors import triple
from . import structure as structure_plots
from ._colours import AFTER, BEFORE, DATA, FAINT, FIFTH, FLOOR, FOURTH, Style
from ._figures import LONG, PANEL, STAR, color_bar, panels
from ._impedance_paper import rule
from ._instruments import View, thinness
from ._line import Line, line_through
from ._plain_figure import HIGHEST

Values: TypeAlias = Inexact[np.ndarray, "frequency"]

LAW_HEIGHT = 2.3
"""Height of a panel of a law [inch]."""

ABOVE = 16.0
"""Distance of a title from a panel with numbers above [pt]."""

MARGIN, ROOM, LEAST_RANGE = 1.05, 2.0, 10**0.75
"""Factors beyond what is drawn: of frequency, of magnitude, and its least, to either side."""

LEAST = 1e-2
"""Odds against the best law from which on others are not drawn."""

STYLES: list[Style] = [
    {"color": AFTER},
    {"color": FOURTH, "linestyle": "--"},
    {"color": FIFTH, "linestyle": ":", "linewidth": 2.0},
]
"""The best laws, one after the other."""

HEIGHT, OF_MAP = 2.4, 1.6
"""Height of a panel of one kind of port [inch], and the factor for a map that is not long."""

LETTERS = 70
"""Letters of a line of a title."""

TITLE: Style = {"fontsize": "medium", "loc": "center"}
"""Style of a title: in the middle in a report too, where it may be wider than its map."""

BAR, AROUND = 0.22, 0.9
"""Height of the bar of a channel, with the gap to the next, and of title and axis [inch]."""

MOST_BARS = 16
"""Bars that find room beside maps; those of the greatest shares."""

_SIDES = r"(?:sensor|actuator) |, channel"
"""What the name of a channel does not need beside its bar."""

SHARE = "misfit removed [%]"

NORMAL_95 = 1.96
"""Standard deviations between which 95 % of a normal distribution lie."""


@arguments_checked
def curves(
    reach: Reach,
    *,
    experiment: Experiment | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw what laws at each place could remove of the misfit, one panel for each kind of port.

    The last panel has a bar for the modulus, and for each channel and for all, where a law is a
    factor on their FRFs; of amplitudes there is none of channels.

    Along a line, a pale curve for any law and a dark one for a law of few numbers: where only the
    pale one is high, a law could do it that no few elements make; of laws on a part that of the
    best part that holds the place. Places that the data do not tell apart are shaded. A map of both
    ends for a strut, and places in colour for a structure in space that lies along no line. The
    best law, fitted with its place, is a star.

    Parameters
    ----------
    reach
        What `bp.reach` returned.
    experiment
        Experiment whose structure and instruments are drawn; None for places alone.
    axes
        Axes to draw in, one for each kind of port and one for channels, those of a structure in
        space that is not thin with the projection 3d; None for a new figure.

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> bp.plots.reach.curves(bp.reach(experiment, surprise)).axes[0].get_xlabel()
    'place along the structure [m]'
    """
    line = _line(reach.curves, experiment)
    reach = replace(reach, curves=line.of(reach.curves), laws=line.of(reach.laws))
    kinds = [kind for kind in reach.kinds().index if kind not in NOWHERE]
    bars = reach.curves[reach.curves["acts_on"].isin(NOWHERE)]
    views = [_seen(_of_kind(reach.curves, kind), experiment) for kind in kinds]
    heights = _heights(views, len(bars))
    projections = [view and view.projection for view in views] + [None] * (not bars.empty)
    size = PANEL[0], 1.0
    layout = panels(len(heights), 1, axes, heights=heights, size=size, projection=projections)
    for panel, kind in zip(layout.axes.flat, kinds, strict=False):
        _draw_kind(panel, reach, kind, experiment, line)
    if not bars.empty:
        best = reach.laws[reach.laws["acts_on"].isin(NOWHERE)].iloc[0]
        _bars(layout.axes.flat[-1], bars, best)
        layout.axes.flat[-1].set_title(_title(reach, best["setting"], best), **TITLE)
    return layout.with_legend()


def _line(curves: pd.DataFrame, experiment: Experiment | None) -> Line:
    """The line along which the structure lies, that of a beam where it lies along none."""
    located = curves[curves["z"].notna()]
    if located.empty:
        return Line()
    return line_through(structure_plots.extent(experiment, located)) or Line()


def _of_kind(table: pd.DataFrame, kind: str) -> pd.DataFrame:
    return table[table["acts_on"] == kind]


def _seen(curve: pd.DataFrame, experiment: Experiment | None) -> View | None:
    """View of a map of a kind of port; none along a line."""
    return _view(curve, experiment) if curve["z"].notna().any() else None


def _heights(views: Sequence[View | None], bars: int) -> list[float]:
    """Heights of panels [inch], of which bars need theirs for their names."""
    shares = [1.0 if view is None or view.proportion > LONG else OF_MAP for view in views]
    of_bars = [BAR * min(bars, MOST_BARS) + AROUND] * (bars > 0)
    unit = min(HEIGHT, (HIGHEST - sum(of_bars)) / max(sum(shares), 1.0))
    return [unit * share for share in shares] + of_bars


def _view(curve: pd.DataFrame, experiment: Experiment | None, panel: Axes | None = None) -> View:
    return structure_plots.view(structure_plots.extent(experiment, curve), thin=thinness(panel))


def _draw_kind(
    panel: Axes, reach: Reach, kind: str, experiment: Experiment | None, line: Line
) -> None:
    """Draw what laws at the places of one kind of port could remove."""
    curve, best = _of_kind(reach.curves, kind), _of_kind(reach.laws, kind).iloc[0]
    if curve["z"].notna().any():
        _in_space(panel, curve, best, experiment)
    elif kind == "region":
        middle = pd.Series({**best, "x": (best["x"] + best["to_x"]) / 2})
        _along(panel, _by_place(curve), middle, experiment, line)
    elif curve["to_x"].notna().any():
        _between(panel, curve, best)
    else:
        _along(panel, curve.groupby("x", as_index=False).max(), best, experiment, line)
        _shade(panel, curve, reach.as_good(kind))
    panel.set_title(_title(reach, kind, best), **TITLE)


def _title(reach: Reach, subject: str, best: pd.Series) -> str:
    chance = reach.chance(reach.kinds()["probability"][best["acts_on"]])
    unbroken = chance[:1] + chance[1:].replace(" ", "\u00a0")
    return textwrap.fill(f"{subject}: {best['law'].in_words()}{unbroken}", LETTERS)


@arguments_checked
def law(
    reach: Reach, *, acts_on: str | None = None, axes: Sequence[Axes] | np.ndarray | None = None
) -> Figure:
    """Draw the law that the data ask for at a port as on impedance paper, and laws through it.

    Magnitude and phase of the dynamic stiffness, of a cut of the compliance, line by line with
    95 % intervals, and the most probable networks of that kind of port. Straight lines are those of
    one spring, labelled at the right, one dashpot, above, and one mass, below. Of channels the
    factor on their FRFs, and filters through it.

    Parameters
    ----------
    reach
        What `bp.reach` returned.
    acts_on
        Kind of port, or `channel` or `all_channels`; by default the most probable one.
    axes
        Axes to draw in, of the magnitude and of the phase; None for a new figure.

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> bp.plots.reach.law(bp.reach(experiment, surprise)).axes[1].get_ylabel()
    'phase [°]'
    """
    kind = str(reach.laws["acts_on"].iloc[0]) if acts_on is None else acts_on
    measured = _polar(reach.law_as_measured(kind))
    unit = str(measured["unit"].iloc[0])
    of_kind = _of_kind(reach.laws, kind)
    laws = _likely(of_kind[of_kind["setting"] == of_kind["setting"].iloc[0]])
    lines = measured["frequency"].to_numpy()
    curves = [_values(row["law"], lines, unit) for _, row in laws.iterrows()]
    layout = panels(2, 1, axes, size=(PANEL[0], LAW_HEIGHT))
    magnitude, phase = layout.axes.flat
    _dots(magnitude, phase, measured, curves[0])
    for (_, row), values, style in zip(laws.iterrows(), curves, STYLES, strict=False):
        label = f"{row['law'].in_words()}{reach.chance(row['probability'])}"
        magnitude.plot(lines, np.abs(values), label=label, zorder=3, **style)
        phase.plot(lines, np.degrees(np.angle(values)), zorder=3, **style)
    ends = lines[0] / MARGIN, lines[-1] * MARGIN
    magnitude.set(xscale="log", xlim=ends, ylabel=f"{_noun(kind, unit)} [{unit}]")
    magnitude.set_title(subject_in_words(kind, laws.iloc[0]), pad=ABOVE, **TITLE)
    if kind in CHANNELS:
        magnitude.set(ylim=(0.0, ROOM * np.abs(curves[0]).max()))
    else:
        magnitude.set(yscale="log", ylim=_range(measured, curves[0]))
        if kind not in NOWHERE:
            rule(magnitude, unit, with_masses=kind in ("displacement", "rotation", "region"))
        phase.yaxis.set_major_locator(MultipleLocator(45))
    magnitude.tick_params(axis="x", which="both", labelbottom=False)
    phase.set(xscale="log", xlim=ends, xlabel="frequency [Hz]", ylabel="phase [°]")
    return layout.with_legend()


def _polar(measured: pd.DataFrame) -> pd.DataFrame:
    """Lines of which more than the size is known: with their size and angle, and the half widths.

    Those of which not even the sign is known are left out.
    """
    values = measured["real"].to_numpy() + 1j * measured["imaginary"].to_numpy()
    size = np.maximum(np.abs(values), np.finfo(float).tiny)
    real, imaginary = measured["deviation_real"] ** 2, measured["deviation_imaginary"] ** 2
    both = measured["covariance"] * np.sin(2 * np.angle(values))
    cosine, sine = np.cos(np.angle(values)) ** 2, np.sin(np.angle(values)) ** 2
    along, across = real * cosine + imaginary * sine + both, real * sine + imaginary * cosine - both
    widths = [NORMAL_95 * np.sqrt(np.maximum(each, 0.0)) / size for each in (along, across)]
    known = np.maximum(*widths) < 1.0
    return measured.assign(value=values, size=size, along=widths[0], across=widths[1], known=known)


def _dots(magnitude: Axes, phase: Axes, measured: pd.DataFrame, near: Values) -> None:
    """Draw the lines with their intervals, phases at most half a turn from a law."""
    known = measured["known"].to_numpy()
    rows, law = measured[known], near[known]
    dots: Style = {"fmt": ".", "color": DATA, "ecolor": DATA, "elinewidth": 0.5, "markersize": 4}
    label = "as measured, with 95 % interval"
    size = rows["size"]
    magnitude.errorbar(rows["frequency"], size, yerr=rows["along"] * size, label=label, **dots)
    angle = np.degrees(np.angle(law) + np.angle(rows["value"].to_numpy() / law))
    phase.errorbar(rows["frequency"], angle, yerr=np.degrees(rows["across"]), **dots)


def _likely(laws: pd.DataFrame) -> pd.DataFrame:
    """The best laws of a kind of port, as far as they are not far behind the best."""
    share = laws["probability"] / max(laws["probability"].iloc[0], np.finfo(float).tiny)
    return laws[(share > LEAST) | (np.arange(len(laws)) == 0)].head(len(STYLES))


def _noun(kind: str, unit: str) -> str:
    if unit == "1":
        return "factor" if kind in CHANNELS else "added modulus, relative"
    return "compliance" if unit in COMPLIANCES else "dynamic stiffness"


def _values(law: Law | ChannelFilter, lines: np.ndarray, unit: str) -> Values:
    if isinstance(law, ChannelFilter):
        return np.asarray(law.factor(2 * np.pi * lines))
    stiffness = np.asarray(law.dynamic_stiffness(jnp.asarray(2 * np.pi * lines)))
    return 1 / stiffness if unit in COMPLIANCES else stiffness


def _range(measured: pd.DataFrame, law: np.ndarray) -> tuple[float, float]:
    """Limits of the magnitude: a law, and most of what was measured."""
    sizes = measured["size"][measured["known"]]
    shown = np.concatenate([np.abs(law), np.quantile(sizes, [0.02, 0.98]) if len(sizes) else []])
    middle, half = np.sqrt(shown.min() * shown.max()), np.sqrt(shown.max() / shown.min())
    half = max(half * ROOM, LEAST_RANGE)
    return middle / half, middle * half


def _along(
    panel: Axes, curve: pd.DataFrame, best: pd.Series, experiment: Experiment | None, line: Line
) -> None:
    place, any_law, few = (curve[name].to_numpy() for name in ("x", "any_law", "few_numbers"))
    panel.fill_between(place, 100 * any_law, color=FAINT, label="any law")
    panel.plot(place, 100 * few, ".-", color=AFTER, label="a law of few numbers")
    panel.plot(best["x"], 100 * best["few_numbers"], **STAR, label="best law, with its place")
    for kind, marker in (("sensor", "v"), ("actuator", "^")):
        instruments = getattr(experiment, kind, {}).values()
        places = [line.at(each.recorded) for each in instruments]
        if places:
            style: Style = {"color": BEFORE, "linestyle": "none", "clip_on": False}
            panel.plot(places, np.zeros(len(places)), marker, **style, label=f"{kind} as recorded")
    panel.set(xlabel=line.label, ylabel=SHARE, ylim=(0, 105))


def _shade(panel: Axes, curve: pd.DataFrame, as_good: pd.DataFrame) -> None:
    """Shade places that the data do not tell from the best one, each as far as to the next ones."""
    places = np.sort(curve["x"].unique())
    ends = np.concatenate([places[:1], (places[1:] + places[:-1]) / 2, places[-1:]])
    if len(as_good) < 2:
        return
    label = "not told apart"
    style: Style = {"facecolor": "none", "edgecolor": FLOOR, "linewidth": 0, "hatch": "////"}
    for number in np.searchsorted(places, as_good["x"].unique()):
        panel.axvspan(*ends[number : number + 2], label=label, **style)
        label = "_"


def _by_place(curve: pd.DataFrame) -> pd.DataFrame:
    """Shares at places along a line: the greatest of the parts that hold each."""
    ends = np.unique(curve[["x", "to_x"]])
    places = (ends[1:] + ends[:-1]) / 2
    first, last = (curve[name].to_numpy()[:, None] for name in ("x", "to_x"))
    holds = (first <= places) & (places <= last)
    shares = {
        name: np.max(np.where(holds, curve[name].to_numpy()[:, None], 0.0), axis=0)
        for name in ("any_law", "few_numbers")
    }
    return pd.DataFrame({"x": places, **shares})


def _bars(panel: Axes, curve: pd.DataFrame, best: pd.Series) -> None:
    further = max(len(curve) - MOST_BARS, 0)
    curve = curve.loc[curve["few_numbers"].nlargest(MOST_BARS).sort_index().index]
    short = curve["setting"].str.replace(_SIDES, "", regex=True)
    names = short if short.is_unique else curve["setting"]
    panel.barh(names, 100 * curve["any_law"], color=FAINT, label="any law")
    few = 100 * curve["few_numbers"]
    panel.barh(names, few, height=0.4, color=AFTER, label="a law of few numbers")
    best_name = names[curve["setting"] == best["setting"]].iloc[:1]
    panel.plot([100 * best["few_numbers"]] * len(best_name), best_name, **STAR, clip_on=False)
    panel.invert_yaxis()  # as in the table
    more = f"; {further} more channels remove less" if further else ""
    panel.set(xlabel=f"{SHARE}{more}", xlim=(0, 105))


def _between(panel: Axes, curve: pd.DataFrame, best: pd.Series) -> None:
    shares = 100 * curve["few_numbers"]
    marks = panel.scatter(curve["x"], curve["to_x"], c=shares, vmin=0, vmax=100, marker="s")
    color_bar(marks, panel, SHARE)
    panel.plot(best["x"], best["to_x"], **STAR, label="best law, with its place")
    panel.set(xlabel="one end [m]", ylabel="other end [m]")


def _in_space(
    panel: Axes, curve: pd.DataFrame, best: pd.Series, experiment: Experiment | None
) -> None:
    rows = curve.assign(size=100 * curve["few_numbers"])
    view = _view(rows, experiment, panel)
    if experiment is not None:
        structure_plots.draw_structure(panel, view, experiment)
    structure_plots.draw_scores(panel, view, rows, SHARE)
    ends = [best[["x", "y", "z"]], best[["to_x", "to_y", "to_z"]].dropna()]
    for end in filter(len, ends):
        structure_plots.mark_place(panel, view, triple(end))
    structure_plots.name_axes(panel, view)
