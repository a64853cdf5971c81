"""Figures of what a model lacks: suspicion, probabilities, the falling error, before and after."""

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from .._shared.arguments import arguments_checked
from .._shared.labels import AS_DRAWN
from ..criticism.missing.ledger import Ledger
from ..criticism.missing.ranking import Ranking
from ..effects.library import kind_of
from ..experiment.experiment import Experiment
from ..inference.chi2 import LEVEL
from ..positions.vectors import Recorded, triple
from . import structure as structure_plots
from ._colours import AFTER, INK, Style
from ._falling import draw_falling, short, told_misfit
from ._figures import (
    LONG,
    PAGE,
    PANEL,
    STAR,
    channel_panels,
    channels,
    color_bar,
    edges,
    maps_and_bars,
    pages_of,
    panels,
    share_frequency,
    worst_pairs,
)
from ._fit_panels import (
    colours_of,
    draw_error,
    draw_measured,
    draw_phase,
    draw_response,
    have_one_noise,
    mark_outside,
)
from ._fits import Fits, fits_of
from ._instruments import thinness
from ._line import Line, line_through

MOST_MAPS = 4
"""Greatest number of maps of a structure in space; half as many high ones, or above many bars."""

CROWD = 20
"""Kinds of effects whose bars leave less room for maps."""

CLAIMED, SUSPECT, CHANCE, FLOOR = "#009E73", AFTER, "0.7", INK
"""Colours."""

BAR, ON_TWO_LINES = 0.3, 0.22
"""Height of a bar, and that from which two lines fit, before the figure is laid out [inch]."""

LETTERS = 44
"""Letters in a line of text beside a bar."""

SMALLEST = 1e-3
"""Probability below which no digits are shown."""

WORST = 3
"""Channel pairs that are drawn where one page does not hold all."""

_SCORE = "size of score"
# The numbers of their scores are shifts.
_WITHOUT_PLACE = ("misplaced_sensor", "misplaced_actuator")
_RIGHT_OF: Style = {"xytext": (4, 0), "textcoords": "offset points", "va": "center"}
_CENTRED: Style = {
    "xycoords": ("axes fraction", "data"),
    "ha": "center",
    "va": "center",
    "color": "0.5",
    "fontsize": "small",
}


@arguments_checked
def suspicion(
    result: Ranking | Ledger,
    *,
    experiment: Experiment | None = None,
    places: Mapping[str, Recorded] | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw the score of every candidate on the structure, and the greatest of each kind.

    A score compares the model as given with a trace of the effect, once all that the model can
    absorb is left out: where it fails badly, everything is suspect, and the brightest is a first
    guess that the evidence confirms or not. Effects that a ledger claims come first, in a colour
    of their own.

    A line has one strip for each kind. A structure in space has one map for each of the most
    suspect kinds that have a place, seen along its thin side where it has one; effects on a region,
    a member or a sensor are drawn in the middle of it, or where it was recorded.

    Parameters
    ----------
    result
        What `explain` or `improve` returned.
    experiment
        Experiment whose structure and instruments are drawn below the map of a structure in
        space; that of a ledger by default.
    places
        Places to mark [m], by kinds or names of effects: numbers on a line, three in space;
        those where a ledger found its effects by default.
    axes
        Axes to draw in, the maps and then the bars; None for a new figure.

    Returns
    -------
    Figure
        That of `axes`, or a new one.

    Examples
    --------
    >>> bp.plots.ledger.suspicion(ledger).axes[0].get_ylabel()
    'effect [kind]'
    """
    claimed: tuple[str, ...] = ()
    kind_by_name: Mapping[str, str] = {}
    if isinstance(result, Ledger):
        experiment = result.experiment if experiment is None else experiment
        places = result.places if places is None else places
        claimed = result.verdict
        kind_by_name = {effect.name: kind_of(effect) for effect in result.experiment.effects}
    table = result.suspicion.assign(size=result.suspicion["score"].abs())
    table["claimed"] = table["kind"].isin(claimed)
    greatest = table.groupby("kind")[["claimed", "size"]].max()
    kinds = list(greatest.sort_values(["claimed", "size"]).index)
    of_names = [(kind_by_name.get(name, name), place) for name, place in (places or {}).items()]
    marked = [(kind, place) for kind, place in of_names if kind in kinds]
    if "z" not in table or not table["z"].notna().any():
        return _on_a_line(table, kinds, marked, axes, Line())
    line = line_through(structure_plots.extent(experiment, table[table["z"].notna()]))
    if line is None:
        return _in_space(table, kinds, marked, experiment, axes)
    return _on_a_line(line.with_at(table), kinds, marked, axes, line)


def _in_space(
    table: pd.DataFrame,
    kinds: list[str],
    places: Sequence[tuple[str, Recorded]],
    experiment: Experiment | None,
    axes: Sequence[Axes] | np.ndarray | None,
) -> Figure:
    located = table[table["z"].notna()]
    thin = thinness(None if axes is None else np.asarray(axes).flat[0])
    view = structure_plots.view(structure_plots.extent(experiment, located), thin=thin)
    are_narrow = view.proportion < 1 / LONG
    most = MOST_MAPS // 2 if are_narrow or len(kinds) > CROWD else MOST_MAPS
    shown = [kind for kind in reversed(kinds) if kind in set(located["kind"])][:most]
    height = 0.8 + BAR * len(kinds)
    shape = view.projection, view.proportion
    layout = maps_and_bars(len(shown), axes, *shape, height)
    *maps, bars = layout.axes.flat
    label = f"{_SCORE}{' ' if view.projection else chr(10)}[standard deviations]"
    for panel, kind in zip(maps, shown, strict=True):
        if experiment is not None:
            structure_plots.draw_structure(panel, view, experiment)
        rows = located[located["kind"] == kind]
        structure_plots.draw_scores(panel, view, rows, label)
        for place in (place for marked, place in places if marked == kind):
            structure_plots.mark_place(panel, view, triple(place))
        structure_plots.name_axes(panel, view)
        panel.set_title(f"suspicion of{chr(10) if are_narrow else ' '}{kind}")
    _draw_greatest(bars, table, kinds)
    room = bars.get_position().height * bars.figure.get_figheight() / len(kinds)
    names = [_with_setting(table, kind, 2 if room > ON_TWO_LINES else 1) for kind in kinds]
    bars.set_yticks(range(len(kinds)), names)
    bars.set_ylim(-0.6, len(kinds) - 0.4)
    return layout.with_legend()


def _with_setting(table: pd.DataFrame, kind: str, lines: int) -> str:
    """A kind, and what of the structure its greatest score is about, on no more lines."""
    worst = table[table["kind"] == kind].nlargest(1, "size")
    setting = worst["setting"].iloc[0] if "setting" in worst else ""
    words = ", ".join(filter(None, [kind, setting]))
    return textwrap.fill(words, LETTERS, max_lines=lines, placeholder="…")


def _on_a_line(
    table: pd.DataFrame,
    kinds: list[str],
    places: Sequence[tuple[str, Recorded]],
    axes: object,
    line: Line,
) -> Figure:
    layout = panels(1, 2, axes, size=(PANEL[0], min(PAGE, max(PANEL[1], 1.2 + BAR * len(kinds)))))
    strips, bars = layout.axes[0]
    _draw_strips(strips, table, kinds)
    strips.set_xlabel(line.label)
    _draw_greatest(bars, table, kinds)
    if places:
        rows, at = zip(*((kinds.index(kind), line.at(at)) for kind, at in places), strict=True)
        strips.plot(at, rows, **STAR, label="place as fitted")
    for panel in (strips, bars):
        panel.set_ylim(-0.5, len(kinds) - 0.5)
    strips.set_yticks(range(len(kinds)), kinds)
    bars.set_yticks([])
    return layout.with_legend()


def _draw_strips(panel: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    """One strip for each kind; blank for kinds that have no place."""
    located = table[table["at"].notna() & ~table["kind"].isin(_WITHOUT_PLACE)]
    norm = Normalize(0.0, max(float(table["size"].max()), structure_plots.LEAST_COLOUR_RANGE))
    if located["at"].nunique() > 1:  # strips of few places reach beyond
        panel.set_xlim(located["at"].min(), located["at"].max())
    for kind, rows in located.groupby("kind"):
        most = rows.groupby("at")["size"].max()
        strip = kinds.index(str(kind)) + np.array([-0.4, 0.4])
        panel.pcolormesh(edges(most.index.to_numpy()), strip, most.to_numpy()[None], norm=norm)
    for row, kind in enumerate(kinds):
        if kind not in set(located["kind"]):
            panel.annotate("no place", (0.5, row), **_CENTRED)
    panel.set_ylabel("effect [kind]")
    panel.set_title("suspicion along the structure")
    label = f"{_SCORE} [standard deviations]"
    color_bar(ScalarMappable(norm), panel, label)


def _draw_greatest(panel: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    greatest = {"size": "max", "p_value": "min", "claimed": "max"}
    most = table.groupby("kind").agg(greatest).loc[kinds]
    significant, claimed = (most["p_value"] < LEVEL).to_numpy(), most["claimed"].to_numpy()
    for rows, color, label in (
        (claimed, CLAIMED, "missing, by its evidence"),
        (significant & ~claimed, SUSPECT, f"more than chance (corrected p < {LEVEL:g})"),
        (~significant & ~claimed, CHANCE, "no more than chance"),
    ):
        if rows.any():
            panel.barh(np.flatnonzero(rows), most["size"][rows], color=color, label=label)
    for row, size in enumerate(most["size"]):
        panel.annotate(short(size), (size, row), **_RIGHT_OF)
    panel.margins(x=0.12)
    panel.set_xlim(left=0)
    panel.set_xlabel(f"greatest {_SCORE} [standard deviations]")
    panel.set_title("suspicion of each kind")


@arguments_checked
def probabilities(result: Ranking | Ledger, *, ax: Axes | None = None) -> Figure:
    """Draw the probability of each effect, of nothing missing and of none of these.

    Those below 0.001 are counted and not drawn.

    Parameters
    ----------
    result
        What `explain` or `improve` returned.
    ax
        Axes to draw in; None for a new figure.

    Examples
    --------
    >>> bp.plots.ledger.probabilities(ledger).axes[0].get_xlabel()
    'posterior probability [1]'
    """
    every = pd.Series(result.probabilities).sort_values(kind="stable")
    share = every[every >= SMALLEST]
    layout = panels(1, 1, ax, size=(PANEL[0], min(PAGE, 1.2 + BAR * len(share))))
    panel = layout.only
    panel.barh(range(len(share)), share, color=SUSPECT)
    for row, probability in enumerate(share):
        panel.annotate(f"{probability:.3f}", (probability, row), **_RIGHT_OF)
    panel.set_yticks(range(len(share)), share.index)
    panel.set_xlim(0, 1.15)
    panel.set_xlabel("posterior probability [1]")
    rest = len(every) - len(share)
    more = f" ({rest} more below {SMALLEST:g})" if rest else ""
    panel.set_title(f"probability of each kind{more}", fontsize="medium")
    return layout.figure


@arguments_checked
def error_falls(ledger: Ledger, *, ax: Axes | None = None) -> Figure:
    """Draw the misfit of the model as given, then with one more effect each time.

    Beside a model error that is the misfit of the best fit without it, which takes up nothing.
    Where the noise is not known, it is the noise needed, above the scatter of neighbouring lines.

    Parameters
    ----------
    ledger
        What `improve` returned.
    ax
        Axes to draw in; None for a new figure.

    Examples
    --------
    >>> bp.plots.ledger.error_falls(ledger).axes[0].get_ylabel()
    'reduced chi-square [1]'
    """
    names = ["as given", *(f"+ {step.title}" for step in ledger.steps[1:])]
    misfit = told_misfit([step.to_json() for step in ledger.steps])
    layout = panels(1, 1, ax)
    panel = layout.only
    draw_falling(panel, names, misfit, FLOOR, top=2.0, beside=0.5)
    panel.set_xlabel("model [effects added one after the other]")
    panel.set_ylabel(misfit.quantity)
    return layout.with_legend()


@arguments_checked
def before_and_after_pages(result: Fits) -> list[Figure]:
    """Draw `before_and_after` on pages; of more pairs than one holds, the worst three, one each.

    `misfit.residual_maps` shows all of them.

    Parameters
    ----------
    result
        As for `before_and_after`.

    Examples
    --------
    >>> len(bp.plots.ledger.before_and_after_pages(ledger))
    1
    """
    fits = fits_of(result)
    pages = pages_of(next(iter(fits.values())))
    fitted = next(fit for name, fit in fits.items() if name != AS_DRAWN)
    shown = pages if len(pages) == 1 else worst_pairs(fitted, WORST)
    return [
        before_and_after({name: fit.isel(page) for name, fit in fits.items()}) for page in shown
    ]


@arguments_checked
def before_and_after(result: Fits, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw measured and fitted outputs, and below each channel pair the error and the noise.

    Amplitudes are in dB; marks at an edge tell where the model as drawn lies beyond it. Where the
    fits have phases, as those of the findings of a run, these stand in between.

    Parameters
    ----------
    result
        What `improve` returned of FRFs; or its `fits`, by the name of a model `measured`,
        `predicted`, `error` and `noise`.
    axes
        Axes to draw in: for each sensor a row of responses, a column for each actuator and force
        level, below it a row of phases, if there are any, and one of errors; None for a new figure.

    Examples
    --------
    >>> bp.plots.ledger.before_and_after(ledger).axes[-1].get_xlabel()
    'frequency [Hz]'
    """
    fits = fits_of(result)
    first = next(iter(fits.values()))
    has_phase = "measured_phase" in first
    heights = [1.0, 0.5, 0.8] if has_phase else [1.0, 0.8]
    layout, rows = channel_panels(first, heights, axes), len(heights)
    has_own_noise = not have_one_noise(fits)
    for name, color in colours_of(fits).items():
        fit = fits[name]
        for panel, channel in channels(layout.axes[::rows], fit):
            draw_response(panel, channel, name, color)
        for panel, channel in channels(layout.axes[1::rows], fit) if has_phase else ():
            draw_phase(panel, channel, color)
        for panel, channel in channels(layout.axes[rows - 1 :: rows], fit):
            draw_error(panel, channel, name, color, has_own_noise=has_own_noise)
    draw_measured(layout.axes, first, rows)
    if AS_DRAWN in fits:
        for panel, channel in channels(layout.axes[::rows], fits[AS_DRAWN]):
            mark_outside(panel, channel)
    share_frequency(layout.axes, rows)
    return layout.with_legend()
