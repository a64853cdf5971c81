"""Figures of a posterior on pages, as a command writes them: each no higher than A4."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ._marginal_panels import (
    COLUMNS,
    MOST_ROWS,
    MOST_STRIPS,
    Rows,
    ScaledUnknown,
    by_owner,
    draw_marginal,
    draw_methods,
    drawn_as_strips,
    drawn_in_rows,
    in_rows,
    inferred,
    rows_of,
)

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
