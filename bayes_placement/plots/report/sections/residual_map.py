"""Where the error lies: the residual over the noise of every channel pair in bands."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.colors import LogNorm

from ....criticism.findings.findings import AS_DRAWN
from ....experiment.experiment import FORCE_LEVEL
from ..._figures import edges
from .._saved import Saved
from .._style import drawing, panels
from ..content import Item, Table
from ..report import RESPONSES

BANDS = 40
"""Bands, at most, in which the residual is told."""

FAINTEST, BRIGHTEST = 0.3, 10.0
"""Least range of colours [noise deviations]."""

ROW = 0.13
"""Height of a channel pair [inch]."""

SMALLEST = 7
"""Size of its name [pt]."""

MOST_NAMES = 30
"""Channel pairs whose names are written."""


def items(saved: Saved) -> Iterator[Item]:
    """Draw a map of channel pairs and bands for each model, one below the other."""
    fits = {name: fit for name, fit in saved.of_models("fit").items() if name != AS_DRAWN}
    if not fits:
        return
    sizes = {name: in_bands(fit) for name, fit in fits.items()}
    first = next(iter(sizes.values()))
    count = len(sizes)
    height = 0.55 + ROW * first.sizes["channel"]
    figure, axes = panels(count, 1, height, sharex=True)
    worst = max(float(size.max()) for size in sizes.values())
    norm = LogNorm(FAINTEST, max(BRIGHTEST, worst), clip=True)
    for panel, (name, size) in zip(axes.flat, sizes.items(), strict=True):
        mesh = _draw(panel, size, norm)
        panel.set_title(name)
    axes[-1, 0].set_xlabel("frequency [Hz]")
    label = "residual / noise [1]"
    figure.colorbar(mesh, ax=axes.ravel().tolist(), label=label, fraction=0.05, pad=0.01)
    caption = (
        "Root mean square of the residual over the noise, by channel pair and band; where a model "
        "is right it is about 1."
    )
    data = Table.of(_data(sizes))
    item = drawing(figure, data)
    yield Item(RESPONSES, "Where the error lies", item, caption, ("response", "error"))


def in_bands(fit: xr.Dataset) -> xr.DataArray:
    """Root mean square of the error over the noise by channel pair and band [channel, band]."""
    dimensions = [word for word in ("sensor", "actuator", FORCE_LEVEL) if word in fit.dims]
    flat = (fit["error"] / fit["noise"]).stack(channel=dimensions, create_index=False)
    measured = flat.isel(channel=np.flatnonzero(flat.notnull().any("frequency")))
    parts = np.array_split(np.arange(fit.sizes["frequency"]), min(BANDS, fit.sizes["frequency"]))
    # Errors of complex outputs are of both parts, as the noise is.
    squares = [(measured.isel(frequency=part) ** 2).mean("frequency") for part in parts]
    bounds = edges(fit["frequency"].values)[[0, *(int(part[-1]) + 1 for part in parts)]]
    sizes: xr.DataArray = xr.concat(squares, "band") ** 0.5
    return sizes.transpose("channel", "band").assign_attrs(edges=bounds)


def names_of(channels: xr.DataArray) -> list[str]:
    """Names of channel pairs, with their force level where there are several."""
    levels = channels.coords.get(FORCE_LEVEL)
    ends = [""] * channels.sizes["channel"] if levels is None else [f", {f:g} N" for f in levels]
    pairs = zip(channels["sensor"].values, channels["actuator"].values, ends, strict=True)
    return [f"{sensor}, {actuator}{end}" for sensor, actuator, end in pairs]


def _draw(panel: Any, size: xr.DataArray, norm: LogNorm) -> Any:
    names = names_of(size)
    rows = np.arange(len(names) + 1) - 0.5
    mesh = panel.pcolormesh(size.attrs["edges"], rows, size.values, norm=norm, cmap="cividis")
    mesh.set_rasterized(True)
    step = -(-len(names) // MOST_NAMES)
    panel.set_yticks(range(0, len(names), step), names[::step], fontsize=SMALLEST)
    panel.invert_yaxis()
    return mesh


def _data(sizes: dict[str, xr.DataArray]) -> pd.DataFrame:
    """One row for each model, channel pair and band."""
    rows = [
        (model, name, low, high, value)
        for model, size in sizes.items()
        for name, values in zip(names_of(size), size.values, strict=True)
        for low, high, value in zip(
            size.attrs["edges"][:-1], size.attrs["edges"][1:], values, strict=True
        )
    ]
    columns = ["model", "channel pair", "from [Hz]", "to [Hz]", "residual / noise [1]"]
    return pd.DataFrame(rows, columns=columns)
