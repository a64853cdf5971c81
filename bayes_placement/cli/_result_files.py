"""Tables, texts and figures in the folder of the results; each file is complete or not there."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from .._files import write_atomically

DOTS_PER_INCH = 120


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    write_atomically(path, lambda temporary: temporary.write_text(f"{text}\n", encoding="utf-8"))


def write_report(path: Path, table: pd.DataFrame, sentences: Sequence[str]) -> None:
    """Write a table and the sentences below it as text."""
    write_text(path, "\n".join([table.to_string(), "", *(f"- {line}" for line in sentences)]))


def write_table(path: Path, table: pd.DataFrame, *, index: bool = True) -> None:
    """Write a table as CSV."""
    write_atomically(path, lambda temporary: table.to_csv(temporary, index=index))


def write_data(path: Path, data: xr.Dataset) -> None:
    """Write arrays with their coordinates as netCDF."""
    # In memory first: HDF5 ends the interpreter where the disk is full.
    content = bytes(data.to_netcdf(engine="h5netcdf"))
    write_atomically(path, lambda temporary: temporary.write_bytes(content))


def write_figures(figures: Mapping[str, Figure], out: Path) -> None:
    """Write figures to a folder, by the names of their files."""
    for name, figure in figures.items():
        write_atomically(out / name, partial(figure.savefig, dpi=DOTS_PER_INCH))
