"""Results as netCDF files, written and read."""

from pathlib import Path

import xarray as xr

from .._files import write_atomically
from .._types import InputError
from ..inference.results import WARNINGS, warnings_of


def write(result: xr.DataTree, path: str | Path) -> Path:
    """Write a tree of results as netCDF; the file is complete before it replaces an earlier one.

    Parameters
    ----------
    result
        What `infer` or `simulate` returned.
    path
        The file, usually `result.nc`.
    """
    return write_atomically(path, lambda temporary: result.to_netcdf(temporary, engine="h5netcdf"))


def read(path: str | Path) -> xr.DataTree:
    """Read a tree of results into memory.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is damaged or holds something else.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(
            f"There is no file {path}. Results are written by io.netcdf.write(result, "
            f"{str(path)!r}) or by `bayes-placement update MODEL --out DIR`."
        )
    try:
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            result = tree.load()
    except OSError as error:
        raise InputError(
            f"{path} cannot be read as netCDF: {error}. A complete file of results is needed; "
            "write it again, or take another copy."
        ) from error
    if WARNINGS in result.attrs:
        result.attrs[WARNINGS] = warnings_of(result)
    return result
