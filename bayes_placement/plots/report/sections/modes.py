"""Measured modal parameters and FRFs beside those of the models, how alike, and how shapes move."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from ...._shared.files import Json
from ..._colours import AFTER, BEFORE, DATA, INK
from ..._fit_panels import (
    Colours,
    draw_assurance,
    draw_damping,
    draw_frequencies,
    has_damping,
    with_shapes,
)
from .._saved import Saved, name_of, placed_items
from .._style import drawing, legend, panels
from ..content import Cell, Item, MovingShapes, Table
from ..report import AGREEMENT, RESPONSES, SHAPES

SHAPE_TAGS = ("structure", "mode shapes")
UP = 2
"""Axis along which displacements of a line are drawn, z."""

WORDS = {1: "x", 2: "y", 3: "z"}


def shapes(saved: Saved) -> Iterator[Item]:
    """Show the shapes, and list the natural frequencies."""
    outline = saved.group("outline")
    shapes = {
        name: group
        for number, name in enumerate(saved.models)
        for group in [saved.group(f"shapes_{number}")]
        if group is not None
    }
    if outline is None or not any(group.sizes["mode"] for group in shapes.values()):
        return
    on_a_line = bool(outline.attrs["on_a_line"])
    models = [_model(name, group, on_a_line) for name, group in shapes.items()]
    content = MovingShapes(
        points=outline["point"].values.tolist(),
        lines=outline["line"].values.astype(int).tolist(),
        models=models,
        note=_note(next(iter(shapes.values())), on_a_line),
        marks=_marks(saved.group("places")),
    )
    caption = (
        "Undamped natural modes of both models, side by side and scaled to the same greatest "
        "displacement."
    )
    yield Item(SHAPES, "Mode shapes", content, caption, SHAPE_TAGS)
    yield Item(
        SHAPES,
        "Natural frequencies",
        _frequencies(shapes),
        "The first undamped natural frequencies, up to a little above the measured band.",
        SHAPE_TAGS,
    )


def _model(name: str, group: xr.Dataset, on_a_line: bool) -> Json:
    shape = group["shape"].values
    if on_a_line:
        across = np.zeros_like(shape)
        across[..., UP] = shape[..., _axis(group) - 1]
        shape = across
    return {
        "name": name,
        "frequencies": group["natural_frequency"].values.tolist(),
        "shapes": shape.tolist(),
    }


def _axis(group: xr.Dataset) -> int:
    """Axis along which a line moves."""
    return int(np.atleast_1d(group.attrs["axes"])[0])


def _note(group: xr.Dataset, on_a_line: bool) -> str:
    if on_a_line and _axis(group) == 1:
        return "The motion is along the structure (x); it is drawn across it."
    return "Displacements are enlarged."


def _marks(places: xr.Dataset | None) -> list[Json]:
    """Instruments and effects at their inferred places; at the recorded ones where not known."""
    marks = []
    for item in placed_items(places):
        inferred, recorded = item["posterior"].mean("draw").values, item["recorded"].values
        at = inferred if np.isfinite(inferred).all() else recorded
        if np.isfinite(at).all():
            kind = str(item["kind"].item())
            marks.append({"name": name_of(item), "at": at.tolist(), "kind": kind})
    return marks


def _frequencies(shapes: dict[str, xr.Dataset]) -> Table:
    lists = [group["natural_frequency"].values.tolist() for group in shapes.values()]
    count = max(map(len, lists))
    padded = [[*values, *[None] * (count - len(values))] for values in lists]
    columns = ("mode", *(f"{name} [Hz]" for name in shapes))
    return Table(columns, tuple(zip(range(1, count + 1), *padded, strict=True)))


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


AGREEMENT_TAGS = ("response", "error")
PERCENT = 100.0


def agreement(saved: Saved) -> Iterator[Item]:
    """List natural frequencies and damping ratios, then how alike FRFs or shapes are."""
    modes, peaks = saved.of_models("modes"), saved.group("peaks")
    if modes:
        yield _table(*_of_modes(modes), "Measured modes beside those of each model.")
    elif peaks is not None:
        yield _table(*_of_peaks(peaks), _FROM_PEAKS)
    rows = [*_mac(modes)] if modes else [*_frac(saved.of_models("fit"))]
    if rows:
        word = "MAC" if modes else "FRAC"
        table = Table(("model", f"least {word} [1]", f"mean {word} [1]", "worst at"), tuple(rows))
        yield Item(AGREEMENT, _TITLES[word], table, _CAPTIONS[word], AGREEMENT_TAGS)


_FROM_PEAKS = (
    "Read in the same way from the peaks of the measured and of the computed FRFs, summed over all "
    "channel pairs, each as a single mode; a blank is a peak that a model has not, or whose width "
    "the lines do not show."
)
_TITLES = {"MAC": "Modal assurance criterion", "FRAC": "Frequency response assurance criterion"}
_CAPTIONS = {
    "MAC": "MAC of each measured shape with the mode of the model beside it; equal shapes have 1.",
    "FRAC": "FRAC of each measured FRF with the computed one, over all lines; equal FRFs have 1.",
}


def _of_modes(modes: dict[str, xr.Dataset]) -> tuple[np.ndarray, list[tuple[str, np.ndarray]]]:
    first = next(iter(modes.values()))
    names = ("natural_frequency", "damping_ratio")
    measured = np.array([first[name].values for name in names])
    rows = [
        (model, np.array([fit[f"{name}_of_model"].values for name in names]))
        for model, fit in modes.items()
    ]
    return measured, rows


def _of_peaks(peaks: xr.Dataset) -> tuple[np.ndarray, list[tuple[str, np.ndarray]]]:
    names = ("natural_frequency", "damping_ratio")
    measured = np.array([peaks[name].values for name in names])
    of_models = [peaks[f"{name}_of_model"].values for name in names]
    rows = [
        (str(model), np.array([values[row] for values in of_models]))
        for row, model in enumerate(peaks["model"].values)
    ]
    return measured, rows


def _table(measured: np.ndarray, models: list[tuple[str, np.ndarray]], caption: str) -> Item:
    """One row a mode: measured, then the error of each model, and damping ratios."""
    columns = ["mode", "frequency [Hz]", *(f"{name}, off by [%]" for name, _ in models)]
    frequencies, ratios = measured
    errors = [PERCENT * (of[0] / frequencies - 1) for _, of in models]
    cells = [_column(frequencies, ".5g"), *(_column(error, ".2f") for error in errors)]
    if np.isfinite(ratios).any():
        columns += ["damping [%]", *(f"{name}, damping [%]" for name, _ in models)]
        cells += [_column(PERCENT * of, ".3g") for of in (ratios, *(of[1] for _, of in models))]
    numbers = range(1, frequencies.size + 1)
    rows: tuple[tuple[Cell, ...], ...] = tuple(zip(numbers, *cells, strict=True))
    words = f"Off by: natural frequencies of a model less the measured ones. {caption}"
    table = Table(tuple(columns), rows)
    return Item(AGREEMENT, "Natural frequencies and damping", table, words, AGREEMENT_TAGS)


def _column(values: np.ndarray, form: str) -> list[float | None]:
    return [float(format(value, form)) + 0.0 if np.isfinite(value) else None for value in values]


def _frac(fits: dict[str, xr.Dataset]) -> Iterator[tuple[Cell, ...]]:
    """Least and mean FRAC of each model, and the channel pair of the least."""
    for name, fit in fits.items():
        if "frac" in fit and np.isfinite(fit["frac"]).any():
            worst = fit["frac"].isel(fit["frac"].fillna(np.inf).argmin(...))
            pair = f"{worst['sensor'].item()}, {worst['actuator'].item()}"
            yield name, _short(worst), _short(fit["frac"].mean()), pair


def _mac(modes: dict[str, xr.Dataset]) -> Iterator[tuple[Cell, ...]]:
    """Least and mean MAC of each model with the mode that it is compared with."""
    for name, fit in modes.items():
        if "assurance" in fit:
            paired = fit["assurance"].sel(mode_of_model=fit["number"])
            worst = paired.isel(mode=int(paired.values.argmin()))
            yield name, _short(worst), _short(paired.mean()), f"mode {worst['mode'].item()}"


def _short(value: xr.DataArray) -> float:
    return float(f"{float(value):.3f}")
