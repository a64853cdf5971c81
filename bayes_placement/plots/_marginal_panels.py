"""Panels of one unknown: densities before and after the data, and their intervals."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._shared.sites import Role
from ..inference.estimates import scalars
from ..inference.summary import INTERVAL
from ..inference.units import ReadableUnit, readable
from ._colours import AFTER, BEFORE, DATA, FAINT, FOURTH, INK, Style
from ._figures import PAGE, PANEL, Panels, edges, panels

Draws = Float[np.ndarray, "draw"]


class ScaledUnknown(NamedTuple):
    """One number that was unknown."""

    name: str
    """Its name."""
    attributes: Mapping[str, str]
    """What it belongs to and is for, as in a tree of results."""
    scale: ReadableUnit
    """The unit in which it is told."""
    prior: Draws
    posterior: Draws
    """Its draws in that unit; no posterior where nothing was inferred."""

    @property
    def unit(self) -> str:
        """Its unit, 1 for a plain number."""
        return self.scale.name or "1"

    @property
    def label(self) -> str:
        """Name with its unit; of an angle of `orientation.rotation` also the axis of rotation."""
        component = self.attributes.get("component", "")
        is_angle = self.attributes.get("field") == "angles" and component
        about = f" about {'xyz'[int(component) - 1]}" if is_angle else ""
        return f"{self.name}{about} [{self.unit}]"

    @property
    def is_placement(self) -> bool:
        """Whether it says where a sensor or an actuator is, or how it is turned."""
        return bool(self.attributes["role"] == Role.PLACEMENT.value)

    @property
    def is_told_apart(self) -> bool:
        """Whether it is told by itself: not one of hundreds of errors in units of their size."""
        role, field = self.attributes["role"], self.attributes.get("field")
        return not (role == Role.MODEL_ERROR.value and field == "standard")

    def scaled(self, value: float) -> float:
        """Return a value in SI in its unit."""
        return value * self.scale.factor


def unknowns(prior: xr.Dataset, posterior: xr.Dataset | None) -> Iterator[ScaledUnknown]:
    """List every number of a prior, with its posterior where there is one."""
    known = {} if posterior is None else {str(name): posterior[name] for name in posterior}
    for name, draws in prior.data_vars.items():
        after = dict(scalars(str(name), known[str(name)].values)) if str(name) in known else {}
        for word, before in scalars(str(name), draws.values):
            yield _unknown(word, draws.attrs, np.ravel(before), np.ravel(after.get(word, [])))


def _unknown(
    name: str, attributes: Mapping[str, str], prior: np.ndarray, posterior: np.ndarray
) -> ScaledUnknown:
    size = float(np.abs(posterior if posterior.size else prior).max())
    scale = readable(str(attributes["units"]), str(attributes["field"]), size)
    return ScaledUnknown(name, attributes, scale, prior * scale.factor, posterior * scale.factor)


def inferred(result: xr.DataTree) -> list[ScaledUnknown]:
    """Every number that was inferred and is told by itself."""
    listed = unknowns(result["prior"].to_dataset(), result["posterior"].to_dataset())
    return [unknown for unknown in listed if unknown.posterior.size and unknown.is_told_apart]


Rows: TypeAlias = list[list[ScaledUnknown]]

BINS = 40
"""Bins of a histogram of a posterior; that of a prior has half as many."""

MOST_NODES = 100
"""Draws of fewer values than this, many times each, are taken for nodes of a quadrature."""

PRIOR = "0.6"
"""Colour of priors."""

METHODS = (AFTER, BEFORE, FOURTH, DATA)
"""Colours of methods."""

LINE_STYLES = ("-", "--", "-.", ":")

SMALL_PANEL = (4.2, 3.0)
"""Width and height [inch] of a panel that has others beside it."""

MOST_ROWS = 8
"""Panels below each other on a page."""

DENSITY, MOST_ROWS_OF_LONG_NAMES = "probability density", 4
"""Name of the axis of a density, and rows up to which a panel is as high as it is long."""

MOST_IN_A_COLUMN, COLUMNS = 3, 3
"""Parameters that stand one below the other, and columns of more of them on a page."""

STRIP, ABOVE = (6.4, 0.54), 0.8
"""Width and height [inch] of the interval of one unknown, and height of the legend."""

MOST_STRIPS = 18
"""Intervals below each other on a page."""


def in_rows(unknowns: list[ScaledUnknown]) -> Rows:
    """A few unknowns one below the other, more of them beside each other, no higher than a page."""
    columns = 1 if len(unknowns) <= MOST_IN_A_COLUMN else COLUMNS
    return rows_of(unknowns, max(columns, -(-len(unknowns) // MOST_ROWS)))


def rows_of(unknowns: list[ScaledUnknown], columns: int) -> Rows:
    """Unknowns in rows of so many."""
    return [unknowns[start : start + columns] for start in range(0, len(unknowns), columns)]


def abreast(rows: Rows) -> Rows:
    """Put rows abreast where they are more than a page holds."""
    blocks = max(1, -(-len(rows) // MOST_ROWS))
    height = -(-len(rows) // blocks)
    return [[*itertools.chain(*rows[start::height])] for start in range(height)]


def by_owner(unknowns: list[ScaledUnknown]) -> Rows:
    """Placement in rows: one for each sensor and actuator."""
    placed = [unknown for unknown in unknowns if unknown.is_placement]
    owners = itertools.groupby(placed, lambda unknown: unknown.attributes["owner"])
    return [list(row) for _, row in owners]


def drawn_in_rows(rows: Rows, axes: object, draw: Callable[[Axes, ScaledUnknown], None]) -> Figure:
    """Draw rows of unknowns, each on axes of its own, or on those of the caller."""
    layout = _ragged(rows) if axes is None else panels(1, max(1, sum(map(len, rows))), axes)
    for panel, unknown in zip(layout.axes.flat, itertools.chain(*rows), strict=False):
        draw(panel, unknown)
        if axes is None and len(rows) > MOST_ROWS_OF_LONG_NAMES:
            panel.set_ylabel(panel.get_ylabel().replace(f"{DENSITY} ", "density\n"))
    return layout.with_legend()


def _ragged(rows: Rows) -> Panels:
    """Panels of a new figure, of which the last of a row are left out where it has fewer."""
    columns = max(map(len, rows), default=1)
    width, height = PANEL if columns == 1 else SMALL_PANEL
    height = min(height, PAGE / max(1, len(rows)))
    layout = panels(max(1, len(rows)), columns, size=(width, height))
    lengths = [len(row) for row in rows] or [1]
    used = []
    for row, length in zip(layout.axes, lengths, strict=True):
        used += list(row[:length])
        for unused in row[length:]:
            unused.remove()
    return layout._replace(axes=np.array([used], dtype=object))


def drawn_as_strips(
    unknowns: list[ScaledUnknown], truth: Mapping[str, float], axes: object = None
) -> Figure:
    """Draw the intervals of unknowns below each other, in columns no higher than a page."""
    count = max(1, len(unknowns))
    columns = 1 if axes is not None else -(-count // MOST_STRIPS)
    rows = -(-count // columns)
    layout = panels(rows, columns, axes, size=(STRIP[0], STRIP[1] + ABOVE / rows))
    for panel, unknown in zip(layout.axes.T.flat, unknowns, strict=False):
        draw_strip(panel, unknown, truth)
    for panel in layout.axes.T.flat[count:]:
        panel.remove()
    return layout._replace(axes=layout.axes.T.reshape(1, -1)[:, :count]).with_legend()


def draw_marginal(panel: Axes, unknown: ScaledUnknown, truth: Mapping[str, float]) -> None:
    """Draw the densities of prior and posterior."""
    draw_density(panel, unknown.prior, label="prior", color=PRIOR, alpha=0.5, bins=BINS // 2)
    draw_density(panel, unknown.posterior, label="posterior", color=AFTER, alpha=0.6)
    draw_true_value(panel, unknown, truth)
    name_density(panel, unknown)
    set_limits(panel, unknown.prior, unknown.posterior)


def draw_methods(
    panel: Axes,
    unknown: ScaledUnknown,
    unknowns: Mapping[str, list[ScaledUnknown]],
    truth: Mapping[str, float],
) -> None:
    """Draw the density of an unknown by each method, in the unit that the first one has."""
    draws = {
        method: other.posterior * (unknown.scale.factor / other.scale.factor)
        for method, listed in unknowns.items()
        for other in listed
        if other.name == unknown.name
    }
    for number, (method, values) in enumerate(draws.items()):
        colour, line = METHODS[number % len(METHODS)], LINE_STYLES[number % len(LINE_STYLES)]
        style: Style = {"color": colour, "linestyle": line, "linewidth": 1.5}
        draw_density(panel, values, label=method, fill=False, **style)
    set_limits(panel, unknown.prior, np.concatenate(list(draws.values())))
    draw_true_value(panel, unknown, truth)
    name_density(panel, unknown)


def draw_density(
    panel: Axes, draws: np.ndarray, *, bins: int = BINS, fill: bool = True, **style: Any
) -> None:
    """Density of draws; each set over its own range, so that a narrow one keeps its shape."""
    # Edges are midway between nodes, so that each stands for the interval about it.
    is_of_nodes = 1 < np.unique(draws).size < min(MOST_NODES, draws.size / 10)
    ends = edges(np.unique(draws)) if is_of_nodes else np.histogram_bin_edges(draws, bins)
    panel.stairs(*np.histogram(draws, ends, density=True), fill=fill, **style)


def draw_true_value(panel: Axes, unknown: ScaledUnknown, truth: Mapping[str, float]) -> None:
    """Mark the true value where it is known."""
    if unknown.name in truth:
        true = unknown.scaled(truth[unknown.name])
        panel.axvline(true, color=INK, linestyle=":", label="true value")


def set_limits(panel: Axes, prior: np.ndarray, posterior: np.ndarray) -> None:
    """Show the whole prior where the posterior fills a part of it, else the posterior alone."""
    low, high = posterior.min(), posterior.max()
    if high - low < 0.2 * np.ptp(prior):
        margin = 0.5 * (high - low) if high > low else 0.05 * np.ptp(prior)
        panel.set_xlim(low - margin, high + margin)
    panel.locator_params(axis="x", nbins=6)
    panel.ticklabel_format(axis="x", useOffset=False)


def name_density(panel: Axes, unknown: ScaledUnknown) -> None:
    """Name both axes, with units."""
    panel.set_xlabel(unknown.label)
    unit = "1" if unknown.unit == "1" else f"1/{unknown.unit}"
    panel.set_ylabel(f"{DENSITY} [{unit}]")


def draw_strip(panel: Axes, unknown: ScaledUnknown, truth: Mapping[str, float]) -> None:
    """Draw the intervals of prior and posterior on an axis of their own."""
    before = np.quantile(unknown.prior, INTERVAL)
    labels = "prior, 95 % interval", "posterior, 95 % interval", "posterior, mean"
    draw_interval(panel, 0.0, (float(before[0]), float(before[1])), unknown.posterior, labels)
    draw_true_value(panel, unknown, truth)
    panel.set(yticks=[], ylim=(-0.6, 0.6))
    panel.set_ylabel(unknown.label, rotation=0, ha="right", va="center")
    panel.locator_params(axis="x", nbins=6)
    panel.ticklabel_format(axis="x", useOffset=False)
    panel.tick_params(axis="x", labelsize="small")
    panel.spines[["top", "left", "right"]].set_visible(False)


def draw_interval(
    panel: Axes,
    row: float,
    before: tuple[float, float],
    posterior: np.ndarray,
    labels: tuple[str, str, str],
) -> None:
    """Draw what was known before as a pale bar, and what is known now as a dot with 95 %.

    Labels are the names of the bar, of the interval and of the dot.
    """
    low, high = before
    panel.barh(row, high - low, left=low, height=0.6, color=FAINT, label=labels[0])
    ends = np.quantile(posterior, INTERVAL)
    panel.plot(ends, [row, row], color=AFTER, linewidth=2.5, label=labels[1])
    panel.plot(posterior.mean(), row, "o", color=AFTER, markersize=5, label=labels[2])


Truth = Mapping[str, float]
Item = TypeVar("Item")


def intervals(result: xr.DataTree, truth: Truth) -> list[Figure]:
    """Draw `posterior.intervals` on pages."""
    unknowns = inferred(result)
    return [drawn_as_strips(page, truth) for page in _pages(unknowns, MOST_STRIPS)]


def parameters(result: xr.DataTree, truth: Truth) -> list[Figure]:
    """Draw `posterior.parameters` on pages."""
    return _drawn(_parameters(inferred(result)), partial(draw_marginal, truth=truth))


def placement(result: xr.DataTree, truth: Truth) -> list[Figure]:
    """Draw `posterior.placement` on pages; position and angles of one item are rows of three."""
    rows = [part for row in by_owner(inferred(result)) for part in rows_of(row, COLUMNS)]
    return _drawn(rows, partial(draw_marginal, truth=truth))


def methods(results: Mapping[str, xr.DataTree], truth: Truth) -> list[Figure]:
    """Draw `posterior.methods` on pages."""
    unknowns = {name: inferred(result) for name, result in results.items()}
    rows = _parameters(next(iter(unknowns.values())))
    return _drawn(rows, partial(draw_methods, unknowns=unknowns, truth=truth))


def _parameters(unknowns: list[ScaledUnknown]) -> Rows:
    """Parameters in rows: as many columns as on one page, however many pages there are."""
    parameters = [unknown for unknown in unknowns if not unknown.is_placement]
    is_one_page = len(parameters) <= COLUMNS * MOST_ROWS
    return in_rows(parameters) if is_one_page else rows_of(parameters, COLUMNS)


def _drawn(rows: Rows, draw: Callable[[Axes, ScaledUnknown], None]) -> list[Figure]:
    return [drawn_in_rows(page, None, draw) for page in _pages(rows, MOST_ROWS)]


def _pages(items: list[Item], count: int) -> list[list[Item]]:
    """Parts of so many items; one without any where there are none."""
    return [items[start : start + count] for start in range(0, max(1, len(items)), count)]
