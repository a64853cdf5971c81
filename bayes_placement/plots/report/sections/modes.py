"""Measured modal parameters beside those of the models, and how alike the shapes are."""

from collections.abc import Iterator

import pandas as pd
import xarray as xr

from ..._colours import AFTER, BEFORE, DATA, INK
from ..._fit_panels import (
    Colours,
    draw_assurance,
    draw_damping,
    draw_frequencies,
    has_damping,
    with_shapes,
)
from .._saved import Saved
from .._style import drawing, legend, panels
from ..content import Item, Table
from ..report import RESPONSES

TAGS = ("response", "error", "mode shapes")

ROW = 0.3
"""Height of a row of a matrix [inch]."""


def items(saved: Saved) -> Iterator[Item]:
    """Draw natural frequencies and damping ratios, and the modal assurance criterion."""
    groups = [saved.group(f"modes_{number}") for number in range(len(saved.models))]
    fits = {name: fit for name, fit in zip(saved.models, groups, strict=True) if fit is not None}
    if not fits:
        return
    colours = Colours(DATA, (BEFORE, AFTER) if len(fits) > 1 else (AFTER,), AFTER, INK)
    yield _parameters(fits, colours)
    if with_shapes(fits):
        yield _assurance(with_shapes(fits), colours)


def _parameters(fits: dict[str, xr.Dataset], colours: Colours) -> Item:
    drawn = [draw_frequencies, draw_damping] if has_damping(fits) else [draw_frequencies]
    figure, axes = panels(1, len(drawn), 2.8)
    for panel, draw in zip(axes.flat, drawn, strict=True):
        draw(panel, fits, colours)
    legend(figure, axes)
    caption = (
        "Bars: measured, with 95 % intervals; the marks of a correct model lie in nearly all of "
        "them."
    )
    content = drawing(figure, Table.of(_data(fits)))
    return Item(RESPONSES, "Natural frequencies and damping ratios", content, caption, TAGS)


def _data(fits: dict[str, xr.Dataset]) -> pd.DataFrame:
    """One row for each measured mode."""
    first = next(iter(fits.values()))
    columns = {"measured mode": first["mode"].values}
    for word, unit in (("natural_frequency", "Hz"), ("damping_ratio", "1")):
        name = word.replace("_", " ")
        columns[f"{name} [{unit}]"] = first[word].values
        columns[f"{name}, standard deviation [{unit}]"] = first[f"{word}_deviation"].values
        for model, fit in fits.items():
            columns[f"{model}: {name} [{unit}]"] = fit[f"{word}_of_model"].values
    return pd.DataFrame(columns)


def _assurance(fits: dict[str, xr.Dataset], colours: Colours) -> Item:
    rows = max(fit.sizes["mode"] for fit in fits.values())
    figure, axes = panels(1, len(fits), 1.0 + ROW * rows)
    for panel, (name, fit) in zip(axes.flat, fits.items(), strict=True):
        draw_assurance(panel, fit, colours)
        panel.set_title(name)
    caption = (
        "Modal assurance criterion (MAC) of each measured shape with those of the model; equal "
        "shapes have 1, and a frame marks the mode that is compared with it."
    )
    content = drawing(figure, Table.of(_matrix(fits)))
    return Item(RESPONSES, "Similarity of mode shapes", content, caption, TAGS)


def _matrix(fits: dict[str, xr.Dataset]) -> pd.DataFrame:
    """One row for each pair of a measured mode and one of a model."""
    tables = [
        fit["assurance"].to_series().rename("modal assurance criterion [1]").reset_index()
        for fit in fits.values()
    ]
    return pd.concat([table.assign(model=name) for name, table in zip(fits, tables, strict=True)])
