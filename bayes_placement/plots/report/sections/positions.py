"""Where sensors, actuators and effects were recorded, and where they are inferred to be."""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from ..._colours import AFTER, DATA, FLOOR, INK, Style
from ..._instruments import INSTRUMENT, few, near_each_other
from ..._marginal_panels import draw_interval
from .._saved import Saved, name_of, placed_items
from .._style import Projection, draw_outline, drawing, legend, panels
from ..content import Cell, Drawing, Item, Table, rounded_summary
from ..report import PLACES

DEVIATIONS = 2.45
"""Deviations of an ellipse that holds 95 % of a normal distribution in the plane."""

MILLIMETRE = 1e3
"""Millimetres in a metre."""

MOST_ROWS = 36
"""Coordinates below each other."""

TAGS = ("structure", "placement")
_LABELS = {
    "sensor": ((0, 9), "right"),
    "actuator": ((2, 9), "left"),
    "effect": ((0, -17), "center"),
}
_MARKS = {"sensor": "^", "actuator": "v", "effect": "*"}


def items(saved: Saved) -> Iterator[Item]:
    """Draw the structure, and the deviation of every instrument from its record."""
    places, outline = saved.group("places"), saved.group("outline")
    if places is None or outline is None:
        return
    caption = (
        "Open marks: recorded places; filled marks: inferred places, with 95 % ellipses; stars: "
        "effects that were found."
    )
    table = Table(_COLUMNS, tuple(_rows(places)))
    yield Item(PLACES, "Structure", _structure(places, outline, table), caption, TAGS)
    if _moved(places):
        yield Item(
            PLACES,
            "Deviation from the record",
            _deviations(places, table),
            "Pale bar: stated tolerance; dot: inferred place with its 95 % interval.",
            TAGS,
        )
    yield Item(
        PLACES,
        "Positions and orientations",
        table,
        "Recorded and inferred coordinates; tilt is the angle between the first channel and its "
        "recorded direction.",
        TAGS,
    )


_COLUMNS = (
    "name",
    "kind",
    "axis",
    "recorded",
    "inferred",
    "standard deviation",
    "95 % from",
    "95 % to",
    "unit",
)


def _rows(places: xr.Dataset) -> Iterator[tuple[Cell, ...]]:
    """One row for each coordinate along which anything lies, and for each tilt."""
    along = np.nanmax(np.abs(places["posterior"].values), axis=(0, 1), initial=0.0) > 0
    for item in placed_items(places):
        kind = str(item["kind"].item())
        recorded = item["recorded"].values * MILLIMETRE
        draws = item["posterior"].values * MILLIMETRE
        for axis, word in enumerate("xyz"):
            values = draws[:, axis]
            if (along[axis] or axis == 0) and np.isfinite(values).all():
                known = None if np.isnan(recorded[axis]) else float(recorded[axis])
                yield (name_of(item), kind, word, known, *rounded_summary(values), "mm")
        if np.isfinite(item["tilt"].values).all():
            yield (name_of(item), kind, "tilt", 0.0, *rounded_summary(item["tilt"].values), "deg")


def _structure(places: xr.Dataset, outline: xr.Dataset, data: Table) -> Drawing:
    on_a_line = bool(outline.attrs["on_a_line"])
    view = Projection.of(outline["point"].values)
    figure, axes = panels(1, 1, 1.5 if on_a_line else 3.8)
    panel = axes[0, 0]
    draw_outline(panel, outline, view)
    for item in placed_items(places):
        _draw_item(panel, item, view)
    _name_items(panel, places, view, float(np.ptp(outline["point"].values, axis=0).max()))
    if on_a_line:
        panel.set(yticks=[], ylabel="", xlabel="position along the structure [m]", aspect="auto")
        panel.spines["left"].set_visible(False)
        panel.set_ylim(-1.2, 1.6)
    legend(figure, axes)
    return drawing(figure, data)


def _draw_item(panel: Axes, item: xr.Dataset, view: Projection) -> None:
    """Draw the record, the inferred place and its ellipse, and the direction."""
    kind = str(item["kind"].item())
    marker, colour = _MARKS[kind], DATA if kind == "effect" else AFTER
    recorded, draws = item["recorded"].values, item["posterior"].values
    if np.isfinite(recorded).all():
        at, label = view.at(recorded[None]), f"{kind} as recorded"
        panel.plot(*at, marker=marker, label=label, **INSTRUMENT)
    if not np.isfinite(draws).all():
        return
    at = view.at(draws.mean(axis=0)[None])
    label = "effect as found" if kind == "effect" else f"{kind} as inferred"
    size = 11 if kind == "effect" else 4.5
    panel.plot(*at, marker, color=colour, markersize=size, label=label)
    panel.plot(*view.ellipse(draws, DEVIATIONS), color=colour, linewidth=1)
    if np.isfinite(item["direction"].values).all():
        _draw_directions(panel, item, view, draws.mean(axis=0))


def _name_items(panel: Axes, places: xr.Dataset, view: Projection, size: float) -> None:
    """Write the names of all of a kind that are near each other beside the first of them."""
    items = [item for item in placed_items(places) if np.isfinite(item["posterior"].values).all()]
    for kind, (offset, side) in _LABELS.items():
        alike = [item for item in items if str(item["kind"].item()) == kind]
        at = [view.at(item["posterior"].values.mean(axis=0)) for item in alike]
        near: Style = {"textcoords": "offset points", "ha": side, "va": "bottom"}
        for numbers in near_each_other(np.reshape(at, (-1, 2)), size):
            names = "\n".join(few([name_of(alike[number]) for number in numbers]))
            panel.annotate(names, (*at[numbers[0]],), offset, fontsize=8, **near)


def _draw_directions(panel: Axes, item: xr.Dataset, view: Projection, at: np.ndarray) -> None:
    """Draw the recorded direction of the first channel, and the inferred one."""
    length = 0.12 * max(np.ptp(panel.get_xlim()), np.ptp(panel.get_ylim()))
    for word, colour in (("direction_recorded", INK), ("direction", AFTER)):
        ends = view.at(np.stack([at, at + length * item[word].values]))
        panel.plot(*ends, color=colour, linewidth=1.2)


def _moved(places: xr.Dataset) -> list[tuple[xr.Dataset, int]]:
    """Coordinates that are uncertain, of instruments."""
    return [
        (item, axis)
        for item in placed_items(places)
        for axis in range(3)
        if str(item["kind"].item()) != "effect"
        if float(np.ptp(item["prior"].values[:, axis])) > 0
        if np.isfinite(item["posterior"].values[:, axis]).all()
    ]


def _deviations(places: xr.Dataset, data: Table) -> Drawing:
    """One row for each uncertain coordinate, in columns no higher than a page."""
    moved = _moved(places)
    columns = -(-len(moved) // MOST_ROWS)
    most = -(-len(moved) // columns)
    figure, axes = panels(1, columns, 0.8 + 0.28 * most)
    for number, panel in enumerate(axes.flat):
        _draw_deviations(panel, moved[number * most : (number + 1) * most])
        panel.set_ylim(most - 0.4, -0.6)
    legend(figure, axes)
    return drawing(figure, data)


def _draw_deviations(panel: Axes, rows: list[tuple[xr.Dataset, int]]) -> None:
    """Draw the tolerance of each coordinate and where it is inferred to be, the first on top."""
    for number, (item, axis) in enumerate(rows):
        recorded = item["recorded"].values[axis]
        prior, posterior = (
            (item[word].values[:, axis] - recorded) * MILLIMETRE for word in ("prior", "posterior")
        )
        low, high = float(prior.min()), float(prior.max())
        words = "tolerance", "95 % interval", "inferred"
        draw_interval(panel, float(number), (low, high), posterior, words)
    panel.axvline(0.0, color=FLOOR, linewidth=0.8)
    names = [f"{name_of(item)} {'xyz'[axis]}" for item, axis in rows]
    panel.set_yticks(range(len(rows)), names)
    panel.set_xlabel("deviation from the recorded place [mm]")
