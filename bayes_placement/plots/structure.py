"""Figure of a structure with its sensors and actuators, and of scores at its points."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._shared.arguments import arguments_checked
from ..experiment.experiment import Experiment
from ..experiment.transducers import Transducer
from ..modes.finite_elements.outline import outline
from ..positions.bounds import in_space
from ..positions.vectors import PointsInSpace
from ._colours import DATA, Style
from ._figures import LONG, SEEN, STAR, color_bar, panels
from ._instruments import (
    FLAT,
    INSTRUMENT,
    LINE,
    THIN,
    Panel,
    View,
    draw_channels,
    draw_channels_on_a_line,
    draw_tolerances,
    few,
    near_each_other,
    side_of_names,
    thinness,
)

LEAST_COLOUR_RANGE = 5.0
"""Smallest range of colours of a map [standard deviations]."""

MARGIN = 0.12
"""Margin around a structure, as a share of the largest side."""

FORESHORTENED = 1.5
"""Factor on the distance in space within which transducers are named together."""

_GREY = "0.8"
_LABEL_DISTANCE = 12.0  # [points] from the numbers to the name of an axis in space
_LONG_DISTANCE = 40.0  # [points] besides: matplotlib shrinks distances with the other two sides
_BESIDE = 10.0  # [points] from a transducer to its name
_MARKERS = {"sensor": "^", "actuator": "v"}
_RING: Style = INSTRUMENT | {"marker": "o", "markersize": 15, "markeredgecolor": DATA}


@arguments_checked
def experiment(experiment: Experiment, *, ax: Axes | None = None) -> Figure:
    """Draw a structure with its sensors and actuators at their recorded positions.

    A structure that lies in a plane or is thin is drawn in that plane.

    Parameters
    ----------
    experiment
        Experiment to draw.
    ax
        Axes to draw in, with the projection 3d for a structure that is not thin; None for a new
        figure.

    Examples
    --------
    >>> bp.plots.experiment(experiment).axes[0].get_xlabel()
    'position along the structure [m]'
    """
    if not in_space(experiment.structure.modes.bounds()):
        return _on_a_line(experiment, ax)
    shown = view(extent(experiment, pd.DataFrame()), thin=thinness(ax))
    height = 3.0 if shown.proportion > LONG else 5.0
    layout = panels(1, 1, ax, size=(6.4, height), projection=shown.projection)
    draw_structure(layout.only, shown, experiment)
    draw_tolerances(layout.only, shown, experiment)
    draw_channels(layout.only, shown, experiment)
    name_axes(layout.only, shown)
    return layout.with_legend()


def _on_a_line(experiment: Experiment, ax: Axes | None) -> Figure:
    layout = panels(1, 1, ax, size=(6.4, 2.4))
    panel = layout.only
    panel.plot(experiment.structure.modes.bounds(), [0.0, 0.0], color=_GREY, label="structure")
    for kind, marker in _MARKERS.items():
        places = [transducer.recorded for transducer in getattr(experiment, kind).values()]
        if not places:
            continue
        style: Style = {"marker": marker, "label": f"{kind} as recorded"} | INSTRUMENT
        panel.plot(places, np.zeros(len(places)), **style)
    draw_tolerances(panel, LINE, experiment)
    draw_channels_on_a_line(panel, experiment)
    panel.set(yticks=[], ylim=(-1.0, 1.0))
    panel.set_xlabel("position along the structure [m]")
    return layout.with_legend()


def view(points: PointsInSpace, *, thin: float = THIN) -> View:
    """View of all points, without an axis along which a structure is thin.

    Parameters
    ----------
    points
        Points [m].
    thin
        Share of the largest side up to which another is left out.

    Examples
    --------
    >>> bp.plots.structure.view(plane.position).axes
    (0, 1)
    """
    low, high = points.min(axis=0), points.max(axis=0)
    size = high - low
    extended = [axis for axis in range(3) if size[axis] > thin * size.max()]
    # A figure needs two axes, also for a straight line or a single point.
    others = sorted(set(range(3)) - set(extended), key=lambda axis: (-size[axis], axis != 0, -axis))
    axes = tuple(sorted([*extended, *others][: max(2, len(extended))]))
    margin = (MARGIN if len(axes) < 3 else MARGIN / 4) * max(size.max(), FLAT)
    return View(axes, low - margin, high + margin)


def draw_structure(panel: Panel, view: View, experiment: Experiment) -> None:
    """Draw the mesh or the nodes of a structure in grey, and its transducers as recorded.

    Parameters
    ----------
    panel
        Where it is drawn.
    view
        From where the structure is seen: `view(positions)`.
    experiment
        The structure and its transducers.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> placed = {"sensors": [bp.Sensor("s1", at=(0.5, 0.4, 0.0))]}
    >>> placed |= {"actuators": [bp.Actuator("a1", at=(0.1, 0.1, 0.0))]}
    >>> damped = bp.Structure(plate, damping=bp.damping.Modal(0.02))
    >>> panel, view = plt.figure().add_subplot(), bp.plots.structure.view(plane.position)
    >>> bp.plots.structure.draw_structure(panel, view, bp.Experiment(damped, **setup | placed))
    """
    points, line = outline(experiment.structure.modes)
    panel.plot(*view.project(points), line, color=_GREY, markersize=3, zorder=1, label="structure")
    for kind, marker in _MARKERS.items():
        transducers = getattr(experiment, kind)
        if not transducers:
            continue
        recorded = np.array([transducer.recorded for transducer in transducers.values()])
        places = view.project(recorded)
        style = INSTRUMENT | {"path_effects": SEEN}
        panel.plot(*places, zorder=4, marker=marker, label=f"{kind} as recorded", **style)
    _name_transducers(panel, view, [*experiment.sensor.values(), *experiment.actuator.values()])


def _name_transducers(panel: Panel, view: View, transducers: Sequence[Transducer]) -> None:
    if not transducers:
        return
    recorded = np.array([transducer.recorded for transducer in transducers])
    size = float(np.max(view.high - view.low)) * (FORESHORTENED if view.projection else 1.0)
    for numbers in near_each_other(recorded, size):
        names = few([transducers[number].name for number in numbers])
        places = view.project(recorded[numbers])
        place = places[:, 0]
        style: Style = {"fontsize": "small", "va": "center", "zorder": 5, "path_effects": SEEN}
        if view.projection:
            # Axes point to the right.
            panel.text(*place, "\n".join(f"{name}   " for name in names), ha="right", **style)
        else:
            side = side_of_names(view, [transducers[number] for number in numbers])
            place = places[:, np.argmax(side * places[0])]  # the others' marks lie behind it
            beside = {"xytext": (_BESIDE * side, 0), "textcoords": "offset points"}
            style["ha"] = "left" if side > 0 else "right"
            panel.annotate("\n".join(names), place, **beside, **style)


def draw_scores(panel: Panel, view: View, rows: pd.DataFrame, label: str) -> None:
    """Colour each place by its largest score, and mark the largest of all with a ring.

    Parameters
    ----------
    panel
        Axes to draw in.
    view
        Axes and part of space that are drawn.
    rows
        Places `x`, `y`, `z` [m] with the `size` of a score.
    label
        Label of the colour scale.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> import pandas as pd
    >>> rows = pd.DataFrame(plane.position, columns=["x", "y", "z"]).assign(size=np.arange(9.0))
    >>> panel, view = plt.figure().add_subplot(), bp.plots.structure.view(plane.position)
    >>> bp.plots.structure.draw_scores(panel, view, rows, "score of a mass")
    """
    scores = rows.groupby(["x", "y", "z"])["size"].max().sort_values()
    places = np.array(scores.index.to_list())
    marks = panel.scatter(
        *view.project(places),
        c=scores,
        s=np.clip(12000 / len(scores), 14, 130),
        vmin=0.0,
        vmax=max(scores.iloc[-1], LEAST_COLOUR_RANGE),
        zorder=2,
        **({"depthshade": False} if view.projection else {}),
    )
    color_bar(marks, panel, label)
    panel.plot(*view.project(places[-1:]), zorder=3, label="greatest of these places", **_RING)


def mark_place(panel: Panel, view: View, place: tuple[float, float, float]) -> None:
    """Mark the fitted place of an effect.

    Parameters
    ----------
    panel
        Where it is drawn.
    view
        From where the structure is seen.
    place
        The place [m].

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> view = bp.plots.structure.view(plane.position)
    >>> bp.plots.structure.mark_place(plt.figure().add_subplot(), view, (0.5, 0.4, 0.0))
    """
    panel.plot(*view.project(np.array([place])), zorder=6, label="place as fitted", **STAR)


def name_axes(panel: Panel, view: View) -> None:
    """Label the axes, and give all of them the same scale.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> panel = plt.figure().add_subplot()
    >>> bp.plots.structure.name_axes(panel, bp.plots.structure.view(plane.position))
    >>> panel.get_xlabel()
    'x [m]'
    """
    size = view.high - view.low
    for number, name in zip(view.axes, ("x", "y", "z"), strict=False):
        limits = (view.low[number], view.high[number])
        panel.set(**{f"{name}lim": limits, f"{name}label": f"{'xyz'[number]} [m]"})
        panel.locator_params(axis=name, nbins=2 + 2 * (size[number] > 0.3 * size.max()))
    if view.projection:
        panel.set_box_aspect(size)
        panel.tick_params(labelsize="small")
        width = size[1:].mean() / max(size)
        panel.xaxis.labelpad = _LABEL_DISTANCE + _LONG_DISTANCE * max(1.0 - width, 0.0)
        panel.yaxis.labelpad = _LABEL_DISTANCE
    else:
        panel.set_aspect("equal")


def extent(experiment: Experiment | None, rows: pd.DataFrame) -> PointsInSpace:
    """Corners of the structure [m], or the places of the rows where no experiment is known.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = pd.DataFrame(plane.position, columns=["x", "y", "z"])
    >>> bp.plots.structure.extent(None, rows).max(axis=0)
    array([1. , 0.8, 0. ])
    """
    if experiment is None:
        return rows[["x", "y", "z"]].to_numpy()
    return np.array(experiment.structure.modes.bounds())
