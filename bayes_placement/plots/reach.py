"""Figures of reach: where something missing may act, and the law that the data ask for."""

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from .._types import arguments_checked
from ..criticism.reach.reach import Reach
from ..experiment.experiment import Experiment
from . import structure as structure_plots
from ._colours import AFTER, BEFORE, DATA, FAINT
from ._figures import PANEL, STAR, color_bar, panels
from ._instruments import thinness

HEIGHT = 2.4
"""Height of a panel of one kind of port [inch]."""

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

    Along a line, a pale curve for any law and a dark one for a law of few numbers: where only the
    pale one is high, a law could do it that no few elements make. A map of both ends for a strut,
    and places in colour for a structure in space. The best law, fitted with its place, is a star.

    Parameters
    ----------
    reach
        What `bp.reach` returned.
    experiment
        Experiment whose structure and instruments are drawn; None for places alone.
    axes
        Axes to draw in, one for each kind of port; None for a new figure.

    Examples
    --------
    >>> bp.plots.reach.curves(bp.reach(experiment, surprise)).axes[0].get_xlabel()
    'place along the structure [m]'
    """
    kinds = list(reach.kinds().index)
    layout = panels(len(kinds), 1, axes, size=(PANEL[0], HEIGHT))
    for panel, kind in zip(layout.axes.flat, kinds, strict=True):
        curve = reach.curves[reach.curves["acts_on"] == kind]
        best = reach.laws[reach.laws["acts_on"] == kind].iloc[0]
        if curve["z"].notna().any():
            _in_space(panel, curve, best, experiment)
        elif curve["to_x"].notna().any():
            _between(panel, curve, best)
        else:
            _along(panel, curve, best, experiment)
        probability = reach.kinds()["probability"][kind]
        panel.set_title(f"{kind}: {best['law'].in_words()} (probability {probability:.2g})")
    return layout.with_legend()


@arguments_checked
def law(
    reach: Reach,
    *,
    acts_on: str | None = None,
    axes: Sequence[Axes] | np.ndarray | None = None,
) -> Figure:
    """Draw the dynamic stiffness that the data ask for at a port, and the best law through it.

    Parameters
    ----------
    reach
        What `bp.reach` returned.
    acts_on
        Kind of port; by default the most probable one.
    axes
        Axes to draw in, of the magnitude and of the phase; None for a new figure.

    Examples
    --------
    >>> bp.plots.reach.law(bp.reach(experiment, surprise)).axes[1].get_ylabel()
    'phase [degrees]'
    """
    kind = str(reach.laws["acts_on"].iloc[0]) if acts_on is None else acts_on
    measured = reach.law_as_measured(kind)
    best = reach.laws[reach.laws["acts_on"] == kind].iloc[0]["law"]
    layout = panels(2, 1, axes, size=(PANEL[0], HEIGHT))
    magnitude, phase = layout.axes.flat
    frequency = measured["frequency"].to_numpy()
    stiffness = measured["real"].to_numpy() + 1j * measured["imaginary"].to_numpy()
    fitted = np.asarray(best.dynamic_stiffness(jnp.asarray(2 * np.pi * frequency)))
    relative = measured["deviation"].to_numpy() / np.maximum(np.abs(stiffness), 1e-300)
    is_known = NORMAL_95 * relative < 1.0  # beyond, not even the sign is known
    dots = {"fmt": ".", "color": DATA, "ecolor": FAINT, "label": "as measured, with 95 % interval"}
    size = np.abs(stiffness[is_known])
    spread = NORMAL_95 * relative[is_known]
    magnitude.errorbar(frequency[is_known], size, yerr=spread * size, **dots)
    of_law = np.degrees(np.angle(fitted[is_known]))
    apart = np.degrees(np.angle(stiffness[is_known] / fitted[is_known]))
    angle = of_law + apart  # half a turn from the law at most
    phase.errorbar(frequency[is_known], angle, yerr=np.degrees(np.arcsin(spread)), **dots)
    magnitude.plot(frequency, np.abs(fitted), color=AFTER, label=best.in_words())
    phase.plot(frequency, np.degrees(np.angle(fitted)), color=AFTER)
    unit = "N m/rad" if kind == "rotation" else "N/m"
    magnitude.set(xscale="log", yscale="log", ylabel=f"dynamic stiffness [{unit}]")
    phase.set(xscale="log", xlabel="frequency [Hz]", ylabel="phase [degrees]")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    return layout.with_legend()


def _along(panel: Axes, curve: pd.DataFrame, best: Any, experiment: Experiment | None) -> None:
    place, any_law, few = (curve[name].to_numpy() for name in ("x", "any_law", "few_numbers"))
    panel.fill_between(place, 100 * any_law, color=FAINT, label="any law")
    panel.plot(place, 100 * few, ".-", color=AFTER, label="a law of few numbers")
    panel.plot(best["x"], 100 * best["few_numbers"], **STAR, label="best law, with its place")
    for kind, marker in (("sensor", "v"), ("actuator", "^")):
        instruments = getattr(experiment, kind, {}).values()
        places = [float(np.ravel(each.recorded)[0]) for each in instruments]
        if places:
            style: Any = {"color": BEFORE, "linestyle": "none", "clip_on": False}
            panel.plot(places, np.zeros(len(places)), marker, **style, label=f"{kind} as recorded")
    panel.set(xlabel="place along the structure [m]", ylabel=SHARE, ylim=(0, 105))


def _between(panel: Axes, curve: pd.DataFrame, best: Any) -> None:
    shares = 100 * curve["few_numbers"]
    marks = panel.scatter(curve["x"], curve["to_x"], c=shares, vmin=0, vmax=100, marker="s")
    color_bar(marks, panel, SHARE)
    panel.plot(best["x"], best["to_x"], **STAR, label="best law, with its place")
    panel.set(xlabel="one end [m]", ylabel="other end [m]")


def _in_space(panel: Axes, curve: pd.DataFrame, best: Any, experiment: Experiment | None) -> None:
    rows = curve.assign(size=100 * curve["few_numbers"])
    view = structure_plots.view(structure_plots.extent(experiment, rows), thin=thinness(panel))
    if experiment is not None:
        structure_plots.draw_structure(panel, view, experiment)
    structure_plots.draw_scores(panel, view, rows, SHARE)
    structure_plots.mark_place(panel, view, (best["x"], best["y"], best["z"]))
    structure_plots.name_axes(panel, view)
