"""Panels of the residual over the noise: channel pairs against bands."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from .._shared.labels import FORCE_LEVEL
from ._figures import edges

BANDS = 40
"""Bands, at most, in which the residual is told."""

FAINTEST, BRIGHTEST = 0.3, 10.0
"""Least range of colours [noise deviations]."""

ROW, MOST_NAMES = 0.13, 30
"""Height of a channel pair [inch], and pairs whose names are written."""

LETTERS = 7
"""Size of its name [pt]."""

LABEL = "residual / noise [1]"


def in_bands(fit: xr.Dataset) -> xr.DataArray:
    """Root mean square of the error over the noise by measured channel pair and band.

    The `edges` of the bands [Hz] are its attribute.
    """
    dimensions = [word for word in ("sensor", "actuator", FORCE_LEVEL) if word in fit.dims]
    flat = (fit["error"] / fit["noise"]).stack(channel=dimensions, create_index=False)
    measured = flat.isel(channel=np.flatnonzero(flat.notnull().any("frequency")))
    parts = np.array_split(np.arange(fit.sizes["frequency"]), min(BANDS, fit.sizes["frequency"]))
    # Errors of complex outputs are of both parts, as the noise is.
    squares = [(measured.isel(frequency=part) ** 2).mean("frequency") for part in parts]
    bounds = edges(fit["frequency"].values)[[0, *(int(part[-1]) + 1 for part in parts)]]
    sizes: xr.DataArray = xr.concat(squares, "band") ** 0.5
    return sizes.transpose("channel", "band").assign_attrs(edges=bounds)


def pair_names(channels: xr.DataArray) -> list[str]:
    """Names of channel pairs, with their force level where there are several."""
    levels = channels.coords.get(FORCE_LEVEL)
    ends = [""] * channels.sizes["channel"] if levels is None else [f", {f:g} N" for f in levels]
    pairs = zip(channels["sensor"].values, channels["actuator"].values, ends, strict=True)
    return [f"{sensor}, {actuator}{end}" for sensor, actuator, end in pairs]


def height_of(size: xr.DataArray) -> float:
    """Height of a panel [inch]."""
    return 0.7 + ROW * min(size.sizes["channel"], MOST_NAMES)


def draw_maps(figure: Any, axes: np.ndarray, sizes: dict[str, xr.DataArray]) -> None:
    """Draw a map for each model below the other, all in one scale of colours."""
    greatest = max([BRIGHTEST, *(float(size.max()) for size in sizes.values())])
    norm = LogNorm(FAINTEST, greatest, clip=True)
    for panel, (name, size) in zip(axes.flat, sizes.items(), strict=True):
        mesh = _draw(panel, size, norm)
        panel.set_title(name)
    axes.flat[-1].set_xlabel("frequency [Hz]")
    figure.colorbar(mesh, ax=axes.ravel().tolist(), label=LABEL, fraction=0.05, pad=0.01)


def _draw(panel: Axes, size: xr.DataArray, norm: LogNorm) -> Any:
    names = pair_names(size)
    rows = np.arange(len(names) + 1) - 0.5
    mesh = panel.pcolormesh(size.attrs["edges"], rows, size.values, norm=norm, cmap="cividis")
    mesh.set_rasterized(True)  # small in an SVG
    step = -(-len(names) // MOST_NAMES)
    panel.set_yticks(range(0, len(names), step), names[::step], fontsize=LETTERS)
    panel.invert_yaxis()
    return mesh
