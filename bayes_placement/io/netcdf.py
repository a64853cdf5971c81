"""Results as netCDF files with a checksum, written and read."""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from .._shared.arguments import arguments_checked, check_kind
from .._shared.errors import InputError
from .._shared.files import write_atomically
from ..inference.results import WARNINGS, warnings_of
from ._gate import reading

if TYPE_CHECKING:
    import xarray as xr

_SEAL = b"\nbayes_placement result, sha256 "
_SEAL_BYTES = len(_SEAL) + 64 + 1


@arguments_checked
def write(result: "xr.DataTree", path: str | Path) -> Path:
    """Write a tree of results as netCDF; the file is complete before it replaces an earlier one.

    A checksum of the file stands behind its last byte, where other readers of netCDF ignore it.

    Parameters
    ----------
    result
        What `infer` or `simulate` returned.
    path
        The file, usually `result.nc`.

    Examples
    --------
    >>> bp.io.netcdf.write(posterior, "result.nc").name
    'result.nc'
    """
    import xarray as xr

    needed = "a tree of results is needed, as bp.infer and bp.simulate return it"
    check_kind("result", result, xr.DataTree, needed, "io.netcdf.write(result, path)")
    # In memory first: HDF5 ends the interpreter where the disk is full.
    content = bytes(result.to_netcdf(engine="h5netcdf"))
    sealed = content + _seal_of(content)
    return write_atomically(path, lambda temporary: temporary.write_bytes(sealed))


@arguments_checked
def read(path: str | Path) -> "xr.DataTree":
    """Read a tree of results into memory.

    Only files that `write` wrote and nobody changed since are opened: HDF5, in which netCDF is
    stored, ends the interpreter on some damaged files, and attributes of others say anything.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is damaged, was changed, or holds something else.

    Examples
    --------
    >>> path = bp.io.netcdf.write(posterior, "result.nc")
    >>> list(bp.io.netcdf.read(path)["posterior"].data_vars)
    ['structure.damping.ratio', 'sensor.s1.position']
    """
    import xarray as xr

    if not Path(path).is_file():
        raise FileNotFoundError(
            f"There is no file {path}. Results are written by io.netcdf.write(result, "
            f"{str(path)!r}) or by `bayes-placement update MODEL --out DIR`."
        )
    with reading(Path(path), "netCDF", "Write it again, or take another copy."):
        _check_seal(Path(path))
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            result = tree.load()
    if WARNINGS in result.attrs:
        result.attrs[WARNINGS] = warnings_of(result)
    return result


def _check_seal(path: Path) -> None:
    """Refuse a file without the checksum that `write` puts behind it, or with another one."""
    sealed = memoryview(path.read_bytes())
    content, seal = sealed[:-_SEAL_BYTES], bytes(sealed[-_SEAL_BYTES:])
    if not seal.startswith(_SEAL):
        raise InputError(
            f"{path} cannot be read as netCDF: it does not end with the checksum that results "
            "carry; a complete file of results is needed, as io.netcdf.write wrote it, since "
            "damaged ones of another origin can end the interpreter. Write it again, take another "
            "copy, or open it by xarray.open_datatree(path)."
        )
    if seal != _seal_of(content):
        raise InputError(
            f"{path} cannot be read as netCDF: it was changed since it was written, as its "
            "checksum tells; a complete file of results is needed, since nothing in a changed one "
            "can be believed. Write it again, or take another copy."
        )


def _seal_of(content: bytes | memoryview) -> bytes:
    """What stands behind the content of a file, with its SHA-256."""
    return _SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"
