"""Prior and posterior of every unknown, with units."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from ....inference.estimates import scalars
from ....inference.summary import INTERVAL, summary
from ....inference.units import ReadableUnit, readable
from .._saved import Saved
from .._style import drawing, legend, panels
from .._svg import AFTER, FLOOR
from .._units import rounded_summary
from ..content import Item, Table, Text
from ..report import UNKNOWNS

COLUMNS, MOST_PANELS = 3, 24
BINS = 30

TAGS = ("unknowns",)


class _Unknown(NamedTuple):
    """Draws of one number in the unit in which it is told."""

    name: str
    role: str
    scale: ReadableUnit
    prior: np.ndarray
    posterior: np.ndarray


def items(saved: Saved) -> Iterator[Item]:
    """List every unknown, and draw what the data say of it."""
    prior, posterior = saved.group("prior"), saved.group("posterior")
    if prior is None:
        return
    unknowns = list(_unknowns(prior, posterior))
    if not unknowns:
        return
    yield Item(
        UNKNOWNS,
        "Every unknown",
        _table(unknowns),
        "What was known before, and what the data say: mean, standard deviation, and the interval "
        "that holds 95 %.",
        TAGS,
    )
    peaks = tuple(f"{row.in_words()}." for row in summary(saved.findings) if row.peaks)
    if peaks:
        yield Item(UNKNOWNS, "More than one likely value", Text(peaks), tags=TAGS)
    inferred = [unknown for unknown in unknowns if unknown.posterior.size]
    if inferred:
        yield _densities(inferred[:MOST_PANELS], of=len(inferred))


def _unknowns(prior: xr.Dataset, posterior: xr.Dataset | None) -> Iterator[_Unknown]:
    known = {} if posterior is None else {str(name): posterior[name] for name in posterior}
    for name, draws in prior.data_vars.items():
        role, unit = str(draws.attrs["role"]), str(draws.attrs["units"])
        after = dict(scalars(str(name), known[str(name)].values)) if str(name) in known else {}
        for word, before in scalars(str(name), draws.values):
            drawn = np.ravel(after.get(word, np.zeros(0)))
            size = float(np.abs(drawn if drawn.size else before).max())
            scale = readable(unit, str(draws.attrs["field"]), size)
            drawn = drawn * scale.factor
            yield _Unknown(word, role, scale, np.ravel(before) * scale.factor, drawn)


def _table(unknowns: list[_Unknown]) -> Table:
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
    for unknown in unknowns:
        before = [float(f"{end:.3g}") for end in np.quantile(unknown.prior, INTERVAL)]
        after: tuple[Any, ...] = (None,) * 4
        if unknown.posterior.size:
            after = rounded_summary(unknown.posterior)
        rows.append(
            (unknown.name, unknown.scale.name, *before, *after, unknown.role.removesuffix(" h"))
        )
    return Table(columns, tuple(rows))


def _densities(unknowns: list[_Unknown], of: int) -> Item:
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


def _draw(panel: Any, unknown: _Unknown) -> None:
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
