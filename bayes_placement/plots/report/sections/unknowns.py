"""Prior and posterior of every unknown, with units."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from ....inference.summary import INTERVAL, summary
from ..._colours import AFTER, FLOOR
from ..._marginal_panels import ScaledUnknown, unknowns
from .._saved import Saved
from .._style import drawing, legend, panels
from ..content import Item, Table, Text, rounded_summary
from ..report import UNKNOWNS

COLUMNS, MOST_PANELS = 3, 24
BINS = 30

TAGS = ("unknowns",)


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
        TAGS,
    )
    peaks = tuple(f"{row.in_words()}." for row in summary(saved.findings) if row.peaks)
    if peaks:
        yield Item(UNKNOWNS, "More than one likely value", Text(peaks), tags=TAGS)
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
    return Item(UNKNOWNS, "Prior and posterior", drawing(figure, data), caption, TAGS)


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
