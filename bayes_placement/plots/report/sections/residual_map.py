"""Where the error lies: the residual over the noise of every channel pair in bands."""

from collections.abc import Iterator

import pandas as pd
import xarray as xr

from ...._shared.labels import AS_DRAWN
from ..._fit_panels import LABEL, draw_maps, height_of, in_bands, pair_names
from .._saved import Saved
from .._style import drawing, panels
from ..content import Item, Table
from ..report import RESPONSES


def items(saved: Saved) -> Iterator[Item]:
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
