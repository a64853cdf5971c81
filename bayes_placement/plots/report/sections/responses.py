"""Measured and predicted responses, before and after, with noise and model error, and maps."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes

from ...._shared.labels import AS_DRAWN, FORCE_LEVEL
from ..._colours import DATA, FIFTH, INK, Style
from ..._figures import DECIBELS, HALF_TURN, LOGARITHM, unbroken
from ..._fit_panels import (
    LABEL,
    colours_of,
    draw_maps,
    height_of,
    in_bands,
    line_style,
    mark_outside,
    pair_names,
    show_all_of,
)
from .._saved import Saved
from .._style import decade_labels, drawing, legend, panels, thinned
from ..content import Item, Table, Text
from ..report import RESPONSES

Values = Float[np.ndarray, "frequency"]

MOST_CHANNELS = 3
"""Channel pairs that are drawn; those with the largest error before."""


def items(saved: Saved) -> Iterator[Item]:
    """Draw each channel pair: amplitude, phase, and the error with what explains it."""
    named = saved.of_models("fit")
    if not named:
        return
    if saved.about.get("moved"):
        moved = tuple(str(sentence) for sentence in saved.about["moved"])
        yield Item(RESPONSES, "What the fit moved", Text(moved), tags=("response", "unknowns"))
    channels = [flat(fit) for fit in named.values()]
    order = _by_error(channels[[*named].index(saved.models[0])])
    if len(order) > MOST_CHANNELS:
        words = (
            f"{MOST_CHANNELS} of {len(order)} channel pairs are drawn line by line, those of the "
            "largest error; findings.nc holds all."
        )
        yield Item(RESPONSES, "Channel pairs", Text((words,)), tags=("response",))
    for channel in order[:MOST_CHANNELS]:
        pairs = {name: fit.isel(channel=channel) for name, fit in zip(named, channels, strict=True)}
        yield _item(pairs)


def flat(fit: xr.Dataset) -> xr.Dataset:
    """Put sensors, actuators and force levels into one dimension."""
    dimensions = [word for word in ("sensor", "actuator", FORCE_LEVEL) if word in fit.dims]
    return fit.stack(channel=dimensions, create_index=False)


def _by_error(fit: xr.Dataset) -> list[int]:
    """Numbers of measured channels; where there are too many, those of largest error first."""
    error = (fit["error"] / fit["noise"]).transpose("channel", "frequency").values
    measured = np.isfinite(error).any(axis=1)
    numbers = np.flatnonzero(measured)
    if len(numbers) <= MOST_CHANNELS:
        return [int(number) for number in numbers]
    size = np.sqrt(np.nanmean(error[numbers] ** 2, axis=1))
    return [int(number) for number in numbers[np.argsort(-size)]]


def _item(fits: dict[str, xr.Dataset]) -> Item:
    first = next(iter(fits.values()))
    title = _title(first)
    has_phase = "measured_phase" in first
    heights = [1.0, 0.45, 0.8] if has_phase else [1.0, 0.8]
    figure, axes = panels(
        len(heights), 1, 1.15, sharex=True, gridspec_kw={"height_ratios": heights}
    )
    for name, colour in colours_of(fits).items():
        fit = fits[name]
        shown = fit.isel(frequency=thinned(fit["predicted"].values))
        _draw_response(axes[0, 0], shown, name, colour)
        if has_phase:
            _draw_phase(axes[1, 0], shown, colour)
        _draw_error(axes[-1, 0], shown, colour)
    last = [*fits.values()][-1]  # a model as drawn may lie far below
    is_log = str(last["measured"].attrs["units"]).startswith(LOGARITHM)
    curves = [_decibel(last[word].values, is_log) for word in ("measured", "predicted")]
    show_all_of(axes[0, 0], curves)
    if AS_DRAWN in fits:
        drawn = fits[AS_DRAWN]
        mark_outside(axes[0, 0], drawn.isel(frequency=thinned(drawn["predicted"].values)))
    _draw_measured(axes, first.isel(frequency=thinned(first["measured"].values)), has_phase)
    _draw_floors(axes[-1, 0], last)
    axes[-1, 0].set_xlabel("frequency [Hz]")
    legend(figure, axes)
    errs = float(last["model_error"].max()) > 0
    expected = "the noise and the model error" if errs else "the noise"
    caption = (
        f"Dots below the lines: measured; lines: predicted at {title}; as drawn: before any fit; "
        f"below: the error, of which the part above {expected} is what the model lacks."
    )
    content = drawing(figure, Table.of(_data(fits)))
    return Item(RESPONSES, title, content, caption, ("response", "error"))


def _title(channel: xr.Dataset) -> str:
    level = f", {channel[FORCE_LEVEL].item():g} N" if FORCE_LEVEL in channel.coords else ""
    return f"sensor {channel['sensor'].item()}, actuator {channel['actuator'].item()}{level}"


def _decibel(values: Values, is_logarithm: bool) -> Values:
    return DECIBELS * values if is_logarithm else values


def _draw_response(panel: Axes, fit: xr.Dataset, name: str, colour: str) -> None:
    unit = str(fit["predicted"].attrs["units"])
    logarithm = unit.startswith(LOGARITHM)
    values = _decibel(fit["predicted"].values, logarithm)
    panel.plot(fit["frequency"].values, values, **line_style(colour), label=name)
    panel.set_ylabel(f"dB re 1 {_bracket(unit)}" if logarithm else unit, fontsize=8)


def _bracket(unit: str) -> str:
    """What stands in the brackets of a unit: (m/s²)/N."""
    return unit[unit.rfind("[") + 1 :].removesuffix("]")


def _draw_phase(panel: Axes, fit: xr.Dataset, colour: str) -> None:
    shown = unbroken(fit["predicted_phase"].values)
    panel.plot(fit["frequency"].values, shown, **line_style(colour))
    panel.set_ylabel("phase [deg]", fontsize=8)
    panel.set(yticks=[-HALF_TURN, 0, HALF_TURN], ylim=(-1.15 * HALF_TURN, 1.15 * HALF_TURN))


def _draw_measured(axes: np.ndarray, fit: xr.Dataset, has_phase: bool) -> None:
    """Draw what was measured, below the lines, which it would hide."""
    style: Style = {"color": DATA, "markersize": 3, "linestyle": "none", "zorder": 1}
    style |= {"alpha": 0.5, "markeredgewidth": 0}
    logarithm = str(fit["measured"].attrs["units"]).startswith(LOGARITHM)
    lines, values = fit["frequency"].values, _decibel(fit["measured"].values, logarithm)
    axes[0, 0].plot(lines, values, "o", label="measured", **style)
    if has_phase:
        axes[1, 0].plot(lines, fit["measured_phase"].values, "o", **style)


def _draw_error(panel: Axes, fit: xr.Dataset, colour: str) -> None:
    values = np.where(fit["error"].values > 0, fit["error"].values, np.nan)
    panel.plot(fit["frequency"].values, values, **line_style(colour))
    panel.set_yscale("log")
    unit = str(fit["error"].attrs["units"])
    short = "log10 of ratio" if unit.startswith("log10") else _bracket(unit)
    panel.set_ylabel(f"error [{short}]", fontsize=8)
    decade_labels(panel)


def _draw_floors(panel: Axes, fit: xr.Dataset) -> None:
    """Draw what an error of a correct model is made of."""
    shown = fit.isel(frequency=thinned(fit["noise"].values))
    lines = shown["frequency"].values
    panel.plot(lines, shown["noise"].values, color=INK, linewidth=1, label="noise")
    if float(shown["model_error"].max()) > 0:
        values = shown["model_error"].values
        panel.plot(lines, values, ":", color=FIFTH, linewidth=1.5, label="model error")


def _data(fits: dict[str, xr.Dataset]) -> pd.DataFrame:
    """All numbers of a channel pair, one row a line."""
    first = next(iter(fits.values()))
    unit = first["measured"].attrs["units"]
    columns = {"frequency [Hz]": first["frequency"].values, f"measured, {unit}": first["measured"]}
    if "measured_phase" in first:
        columns["measured phase [deg]"] = first["measured_phase"]
    for name, fit in fits.items():
        columns[f"{name}: predicted"] = fit["predicted"]
        if "predicted_phase" in fit:
            columns[f"{name}: phase [deg]"] = fit["predicted_phase"]
        for word in ("error", "noise", "model_error"):
            columns[f"{name}: {word.replace('_', ' ')}"] = fit[word]
    return pd.DataFrame({name: np.asarray(values) for name, values in columns.items()})


def residual_map(saved: Saved) -> Iterator[Item]:
    """Draw a map of channel pairs and bands for each fitted model, one below the other."""
    fits = saved.of_models("fit")
    sizes = {name: in_bands(fit) for name, fit in fits.items() if name != AS_DRAWN}
    if not sizes:
        return
    height = height_of(next(iter(sizes.values())).sizes["channel"])
    figure, axes = panels(len(sizes), 1, height, sharex=True)
    draw_maps(figure, axes, sizes)
    caption = (
        "Root mean square of the residual over the noise, by channel pair and band; where a model "
        "is right it is about 1."
    )
    item = drawing(figure, Table.of(_by_band(sizes)))
    yield Item(RESPONSES, "Where the error lies", item, caption, ("response", "error"))


def _by_band(sizes: dict[str, xr.DataArray]) -> pd.DataFrame:
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
