"""Sensors and actuators on a structure: their tolerances, and along what their channels read."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from ..positions._outlines import outline_of
from ..positions.places import AtNode
from ..positions.vectors import unit_vector
from ._colours import AFTER, BEFORE, INK, Style

if TYPE_CHECKING:  # a report draws channels without it
    from ..experiment.experiment import Experiment
    from ..experiment.transducers import Transducer

Panel = Any  # Axes, or Axes3D where the structure does not lie in a plane

INSTRUMENT: Style = {
    "linestyle": "none",
    "markersize": 8,
    "markerfacecolor": "none",
    "markeredgecolor": INK,
}
"""Mark of a recorded place."""

ARROW = 0.08
"""Length of an arrow, as a share of the longest side of what is shown."""

FLAT = 1e-6
"""Share of the largest side below which a structure has no extent."""

THIN = 0.15
"""Share of the largest side up to which a structure is seen along its thinnest side, in a plane."""

POINTS = 26.0
"""Length of an arrow on a line [points]."""

NEAR = 0.06
"""Share of the longest side up to which transducers are named together."""

MOST_NAMES = 4
"""Names that are written at one place."""

CLEARANCE = 0.3
"""Distance from a line to the arrows along it, of half of what is shown."""

_SIDES = {"sensor": 1, "actuator": -1}
_KINDS = {"sensor": ("measuring axis", AFTER), "actuator": ("driving axis", BEFORE)}
_TOLERANCE: Style = {"color": AFTER, "alpha": 0.45, "solid_capstyle": "round"}


class View(NamedTuple):
    """Axes that are drawn, and the part of space that is shown [m].

    Parameters
    ----------
    axes
        Coordinates that are drawn: 0, 1, 2 for x, y, z.
    low, high
        Corners of the part of space [m].

    Examples
    --------
    >>> view = bp.plots.structure.View((0, 1), np.zeros(3), np.array([1.0, 0.8, 0.0]))
    >>> view.project(plane.position[:2])
    array([[0. , 0.5],
           [0. , 0. ]])
    """

    axes: tuple[int, ...]
    low: np.ndarray
    high: np.ndarray

    @property
    def projection(self) -> str | None:
        """Projection of its axes: none where the structure lies in a plane."""
        return "3d" if len(self.axes) == 3 else None

    @property
    def proportion(self) -> float:
        """Width over height of a plane; 1 in space."""
        width, *heights = (self.high - self.low)[list(self.axes)]
        return 1.0 if self.projection else float(width / heights[0])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Coordinates [axis, point] along the axes of points [point, 3], of which none may be."""
        return np.reshape(points, (-1, 3))[:, list(self.axes)].T


LINE = View((0,), np.zeros(3), np.zeros(3))
"""View of a structure along a line, whose other axis has no meaning."""


def thinness(axes: Axes | None) -> float:
    """Share of the largest side that a view leaves out: hardly any where axes are in space."""
    return FLAT if axes is not None and axes.name == "3d" else THIN


def draw_tolerances(panel: Panel, view: View, experiment: "Experiment") -> None:
    """Draw where each transducer may sit: segments, boxes, patches, balls, nodes."""
    bounds = experiment.structure.modes.bounds()
    for transducer in _transducers(experiment):
        points = outline_of(transducer.position, bounds)
        if points.size:
            height = (np.zeros(len(points)),) if view is LINE else ()
            style = _tolerance_style(transducer.position, len(points))
            panel.plot(*view.project(points), *height, zorder=2, **style)


def _tolerance_style(position: object, count: int) -> Style:
    """Style of a stretch, of edges or of nodes."""
    if isinstance(position, AtNode):
        dots = {"marker": "o", "linestyle": "none", "markersize": 7, "markeredgewidth": 0}
        return dots | {"label": "nodes within the tolerance", "color": AFTER, "alpha": 0.45}
    return {"label": "tolerance", "linewidth": 5.0 if count == 3 else 2.0, **_TOLERANCE}


def draw_channels(panel: Panel, view: View, experiment: "Experiment") -> None:
    """Draw an arrow along each axis that a sensor measures or an actuator drives.

    An axis that is at right angles to the plane of the view is a dot in a circle where it points to
    the reader, else a cross in a circle.
    """
    size = float(np.max(view.high - view.low))
    length = ARROW * size
    for kind, direction, start in _arrows(experiment, size):
        vector = length * unit_vector(direction)
        along = view.project(vector[None])[:, 0]
        if view.projection:
            _draw_arrow_in_space(panel, start, vector, kind, direction)
        elif np.any(along):
            tail = view.project(start[None])[:, 0]
            _draw_arrow(panel, tail, {"xytext": tail + along}, kind, direction)
        else:
            transducers = _transducers(experiment)
            recorded = np.array([start, *(transducer.recorded for transducer in transducers)])
            near = [transducers[number - 1] for number in near_each_other(recorded, size)[0][1:]]
            side = -side_of_names(view, near)
            _draw_out_of_plane(panel, view, start, kind, direction, side)
    _name_arrows(panel, experiment)


def near_each_other(points: Float[np.ndarray, "point axis"], size: float) -> list[list[int]]:
    """Numbers of the points of each place, where names of one by one would collide."""
    remaining, places = list(range(len(points))), []
    while remaining:
        apart = np.abs(points[remaining] - points[remaining[0]]).max(axis=1) > NEAR * size
        places.append([number for number, far in zip(remaining, apart, strict=True) if not far])
        remaining = [number for number, far in zip(remaining, apart, strict=True) if far]
    return places


def few(names: list[str]) -> list[str]:
    """The first of many names at one place, and how many more there are."""
    further = len(names) - MOST_NAMES
    return names if further <= 0 else [*names[:MOST_NAMES], f"and {further} more"]


def side_of_names(view: View, transducers: Sequence["Transducer"]) -> int:
    """1 where names stand at the right of a place, -1 where an arrow points there."""
    axes = [axis for transducer in transducers for axis in transducer.directions]
    return -1 if any(view.project(unit_vector(axis))[0, 0] > 0 for axis in axes) else 1


def draw_channels_on_a_line(panel: Axes, experiment: "Experiment") -> None:
    """Draw the axes of the channels, those along the line to the side and all others upright.

    What belongs to sensors stands above the line, to actuators below.
    """
    for kind, transducer, direction in _channels(experiment):
        is_along = abs(direction) == 1
        step = POINTS * np.sign(direction) * np.array([is_along, not is_along])
        tail = np.array([transducer.recorded, CLEARANCE * _SIDES[kind] * is_along])
        head = {"xytext": tuple(step), "textcoords": "offset points"}
        _draw_arrow(panel, tail, head, kind, direction)
    size = float(np.subtract(*experiment.structure.modes.bounds()[::-1]))
    for kind, side in _SIDES.items():
        transducers = list(getattr(experiment, kind).values())
        places = np.reshape([transducer.recorded for transducer in transducers], (-1, 1))
        for numbers in near_each_other(places, size):
            at = [transducers[number] for number in numbers]
            place, sign = (at[0].recorded, 0.0), 1 if -1 in at[0].directions else -1
            near: Style = {"textcoords": "offset points"}
            near["ha"] = "left" if sign > 0 else "right"
            names = ", ".join(few([transducer.name for transducer in at]))
            panel.annotate(names, place, (8 * sign, 14 * side), va="center", **near)
    _name_arrows(panel, experiment)


def _transducers(experiment: "Experiment") -> list["Transducer"]:
    return [*experiment.sensor.values(), *experiment.actuator.values()]


def _channels(experiment: "Experiment") -> Iterator[tuple[str, "Transducer", int]]:
    """Kind, transducer and recorded direction of every channel."""
    for kind in _KINDS:
        for transducer in getattr(experiment, kind).values():
            for direction in transducer.directions:
                yield kind, transducer, direction


def _arrows(experiment: "Experiment", size: float) -> Iterator[tuple[str, int, np.ndarray]]:
    """Kind, direction and place of every arrow: one for channels that are near and read alike."""
    alike: dict[tuple[str, int], list[np.ndarray]] = {}
    for kind, transducer, direction in _channels(experiment):
        place = np.asarray(transducer.recorded, dtype=float)
        alike.setdefault((kind, direction), []).append(place)
    for (kind, direction), places in alike.items():
        for numbers in near_each_other(np.array(places), size):
            yield kind, direction, places[numbers[0]]


def _draw_arrow(panel: Axes, tail: np.ndarray, head: Style, kind: str, direction: int) -> None:
    """Draw an arrow from a place; the name of its axis stands at its head."""
    colour = _KINDS[kind][1]
    style: Style = {"color": colour, "fontsize": "small", "ha": "center", "va": "center"}
    shaft = {"arrowstyle": "<|-", "color": colour, "linewidth": 1.5, "shrinkA": 0, "shrinkB": 0}
    panel.annotate(_axis(direction), tuple(tail), arrowprops=shaft, zorder=5, **head, **style)


def _draw_arrow_in_space(
    panel: Panel, start: np.ndarray, vector: np.ndarray, kind: str, direction: int
) -> None:
    colour = _KINDS[kind][1]
    panel.quiver(*start, *vector, color=colour, linewidth=1.5, arrow_length_ratio=0.3)
    panel.text(*(start + 1.25 * vector), _axis(direction), color=colour, fontsize="small")


def _draw_out_of_plane(
    panel: Axes, view: View, start: np.ndarray, kind: str, direction: int, side: int
) -> None:
    to_reader = np.sign(direction) * (-1 if view.axes == (0, 2) else 1) > 0
    colour, place = _KINDS[kind][1], view.project(start[None])
    panel.plot(*place, "o", markersize=15, markerfacecolor="none", markeredgecolor=colour, zorder=5)
    inner: Style = {"color": colour, "markersize": 5, "linestyle": "none", "zorder": 5}
    label = f"axis {'towards' if to_reader else 'away from'} the reader"
    panel.plot(*place, marker="." if to_reader else "x", label=label, **inner)
    up = -_SIDES[kind]  # an actuator's above, since a sensor may sit at the same place
    near: Style = {"textcoords": "offset points", "color": colour, "fontsize": "small"}
    near |= {"ha": "left" if side > 0 else "right", "va": "bottom" if up > 0 else "top"}
    panel.annotate(_axis(direction), tuple(place[:, 0]), (7 * side, 7 * up), **near)


def _name_arrows(panel: Panel, experiment: "Experiment") -> None:
    """Add arrows to the legend."""
    nowhere = ([np.nan],) * (3 if panel.name == "3d" else 2)
    for kind in dict.fromkeys(kind for kind, *_ in _channels(experiment)):
        label, colour = _KINDS[kind]
        style: Style = {"linestyle": "none", "markersize": 12, "color": colour}
        panel.plot(*nowhere, marker=r"$\rightarrow$", label=label, **style)


def _axis(direction: int) -> str:
    return f"{'+' if direction > 0 else '-'}{'xyz'[abs(direction) - 1]}"
