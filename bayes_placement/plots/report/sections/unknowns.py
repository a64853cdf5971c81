"""Prior and posterior of every unknown with units; where what has a place was inferred to be."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes

from ....inference.summary import INTERVAL, summary
from ..._colours import AFTER, DATA, FLOOR, INK, Style
from ..._instruments import INSTRUMENT, few, near_each_other
from ..._marginal_panels import ScaledUnknown, draw_interval, unknowns
from .._saved import Saved, name_of, placed_items
from .._style import Projection, draw_outline, drawing, legend, panels
from ..content import Cell, Drawing, Item, Table, Text, rounded_summary
from ..report import PLACES, UNKNOWNS

COLUMNS, MOST_PANELS = 3, 24
BINS = 30

UNKNOWN_TAGS = ("unknowns",)


def items(saved: Saved) -> Iterator[Item]:
    """List every unknown, and draw what the data say of it."""
    prior, posterior = saved.group("prior"), saved.group("posterior")
    if prior is None:
        return
    listed = list(unknowns(prior, posterior))
    if not listed:
        return
    yield Item(
        UNKNOWNS,
        "Every unknown",
        _table(listed),
        "What was known before, from bound to bound (95 % of a prior without bounds), and what the "
        "data say: mean, standard deviation, and the interval that holds 95 %.",
        UNKNOWN_TAGS,
    )
    peaks = tuple(f"{row.in_words()}." for row in summary(saved.findings) if row.peaks)
    if peaks:
        yield Item(UNKNOWNS, "More than one likely value", Text(peaks), tags=UNKNOWN_TAGS)
    inferred = [unknown for unknown in listed if unknown.posterior.size]
    if inferred:
        yield _densities(inferred[:MOST_PANELS], of=len(inferred))


def _table(listed: list[ScaledUnknown]) -> Table:
    columns = (
        "unknown",
        "unit",
        "prior from",
        "prior to",
        "mean",
        "standard deviation",
        "95 % from",
        "95 % to",
        "for",
    )
    rows = []
    for unknown in listed:
        before = [float(f"{end:.3g}") for end in _bounds(unknown)]
        after: tuple[float | None, ...] = (None,) * 4
        if unknown.posterior.size:
            after = rounded_summary(unknown.posterior)
        rows.append(
            (
                unknown.name,
                unknown.scale.name,
                *before,
                *after,
                str(unknown.attributes["role"]).removesuffix(" h"),
            )
        )
    return Table(columns, tuple(rows))


def _bounds(unknown: ScaledUnknown) -> list[float]:
    """Bounds of a prior in the unit of its unknown; of one without, the ends of 95 %."""
    bounds = unknown.attributes.get("prior_bounds")
    if bounds is None:
        return [float(end) for end in np.quantile(unknown.prior, INTERVAL)]
    return [unknown.scaled(float(end)) for end in bounds]


def _densities(unknowns: list[ScaledUnknown], of: int) -> Item:
    """Draw the densities of some unknowns, which are the first of so many."""
    columns = min(COLUMNS, len(unknowns))
    figure, axes = panels(-(-len(unknowns) // columns), columns, 1.6)
    for panel, unknown in zip(axes.flat, unknowns, strict=False):
        _draw(panel, unknown)
    for panel in axes.flat[len(unknowns) :]:
        panel.set_axis_off()
    legend(figure, axes)
    rows = [
        pd.DataFrame({"unknown": unknown.name, "unit": unknown.scale.name, "draw": thinned})
        for unknown in unknowns
        for thinned in [unknown.posterior[:: -(-unknown.posterior.size // 200)]]
    ]
    data = Table.of(pd.concat(rows))
    caption = (
        "Prior (grey) and posterior (blue); where the posterior is narrow, the axis shows it alone."
    )
    if of > len(unknowns):
        caption += f" The first {len(unknowns)} of {of} unknowns are drawn; the table has all."
    return Item(UNKNOWNS, "Prior and posterior", drawing(figure, data), caption, UNKNOWN_TAGS)


def _draw(panel: Axes, unknown: ScaledUnknown) -> None:
    prior, posterior = unknown.prior, unknown.posterior
    for draws, colour, label in ((prior, FLOOR, "prior"), (posterior, AFTER, "posterior")):
        density, edges = np.histogram(draws, bins=BINS, density=True)
        panel.stairs(density, edges, fill=True, color=colour, alpha=0.55, label=label)
    low, high = float(posterior.min()), float(posterior.max())
    if high - low < 0.2 * np.ptp(prior):
        margin = 0.6 * (high - low) or 0.05 * np.ptp(prior)
        panel.set_xlim(low - margin, high + margin)
    panel.set_yticks([])
    panel.locator_params(axis="x", nbins=4)
    panel.set_title(unknown.name, fontsize=8)
    panel.set_xlabel(unknown.scale.name, fontsize=8)


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


def positions(saved: Saved) -> Iterator[Item]:
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
