"""Natural frequencies, damping, assurance criteria: measured beside computed; where errors lie."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from ...._shared.labels import AS_DRAWN
from ..._fit_panels import LABEL, draw_maps, height_of, in_bands, pair_names
from .._saved import Saved
from .._style import drawing, panels
from ..content import Cell, Item, Table
from ..report import AGREEMENT, RESPONSES

TAGS = ("response", "error")

PERCENT = 100.0


def items(saved: Saved) -> Iterator[Item]:
    """List natural frequencies and damping ratios, then how alike FRFs or shapes are."""
    modes, peaks = saved.of_models("modes"), saved.group("peaks")
    if modes:
        yield _table(*_of_modes(modes), "Measured modes beside those of each model.")
    elif peaks is not None:
        yield _table(*_of_peaks(peaks), _FROM_PEAKS)
    rows = [*_assurance(modes)] if modes else [*_frac(saved.of_models("fit"))]
    if rows:
        word = "MAC" if modes else "FRAC"
        table = Table(("model", f"least {word} [1]", f"mean {word} [1]", "worst at"), tuple(rows))
        yield Item(AGREEMENT, _TITLES[word], table, _CAPTIONS[word], TAGS)


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
    return Item(AGREEMENT, "Natural frequencies and damping", table, words, TAGS)


def _column(values: np.ndarray, form: str) -> list[float | None]:
    return [float(format(value, form)) + 0.0 if np.isfinite(value) else None for value in values]


def _frac(fits: dict[str, xr.Dataset]) -> Iterator[tuple[Cell, ...]]:
    """Least and mean FRAC of each model, and the channel pair of the least."""
    for name, fit in fits.items():
        if "frac" in fit and np.isfinite(fit["frac"]).any():
            worst = fit["frac"].isel(fit["frac"].fillna(np.inf).argmin(...))
            pair = f"{worst['sensor'].item()}, {worst['actuator'].item()}"
            yield name, _short(worst), _short(fit["frac"].mean()), pair


def _assurance(modes: dict[str, xr.Dataset]) -> Iterator[tuple[Cell, ...]]:
    """Least and mean MAC of each model with the mode that it is compared with."""
    for name, fit in modes.items():
        if "assurance" in fit:
            paired = fit["assurance"].sel(mode_of_model=fit["number"])
            worst = paired.isel(mode=int(paired.values.argmin()))
            yield name, _short(worst), _short(paired.mean()), f"mode {worst['mode'].item()}"


def _short(value: xr.DataArray) -> float:
    return float(f"{float(value):.3f}")


def residual_map(saved: Saved) -> Iterator[Item]:
    """Draw a map of channel pairs and bands for each fitted model, one below the other."""
    fits = saved.of_models("fit")
    sizes = {name: in_bands(fit) for name, fit in fits.items() if name != AS_DRAWN}
    if not sizes:
        return
    height = height_of(next(iter(sizes.values())))
    figure, axes = panels(len(sizes), 1, height, sharex=True)
    draw_maps(figure, axes, sizes)
    caption = (
        "Root mean square of the residual over the noise, by channel pair and band; where a model "
        "is right it is about 1."
    )
    data = Table.of(_data(sizes))
    item = drawing(figure, data)
    yield Item(RESPONSES, "Where the error lies", item, caption, ("response", "error"))


def _data(sizes: dict[str, xr.DataArray]) -> pd.DataFrame:
    """One row for each model, channel pair and band."""
    rows = [
        (model, name, low, high, value)
        for model, size in sizes.items()
        for name, values in zip(pair_names(size), size.values, strict=True)
        for low, high, value in zip(
            size.attrs["edges"][:-1], size.attrs["edges"][1:], values, strict=True
        )
    ]
    return pd.DataFrame(rows, columns=["model", "channel pair", "from [Hz]", "to [Hz]", LABEL])
