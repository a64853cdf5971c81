"""_store: in, chunks and their results; out, the same results in a later run, from a folder.

Not known here: where chunks are computed. Each file says by itself what is in it.
"""

import hashlib
import io
import tempfile
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..._files import write_atomically
from ..._types import InputError
from ._cells import Chunk
from ._fingerprint import fingerprint

VERSION = version("bayes_placement")
"""Another version may compute otherwise, so that it is part of the name of each file."""


class Store:
    """A folder with a netCDF file for each finished chunk, named by all that determines it.

    Files are whole or not there: a run that is killed leaves at most a temporary file, whose name
    nothing looks for, and two runs may share a folder.

    Parameters
    ----------
    folder
        The folder, which is made; None keeps nothing.

    Raises
    ------
    ValueError
        If it is a file.
    """

    def __init__(self, folder: str | Path | None):
        self.folder = None if folder is None else Path(folder)
        if self.folder is not None:
            _make(self.folder)

    def read(self, chunk: Chunk) -> np.ndarray | None:
        """Result of a chunk; None where it is missing, or damaged, which is warned of.

        A damaged file (a machine that lost power, a full disk) is of no use to anybody, and its
        name says what to compute in its place; what was computed otherwise has another name.
        """
        if self.folder is None:
            return None
        path = self._path(chunk)
        try:
            # In one go: netCDF libraries lock files, which network file systems may not allow.
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        try:
            return _result(content)
        except (OSError, RuntimeError, ValueError, KeyError) as error:
            warnings.warn(
                f"{path} is damaged ({error}). Its cells are computed anew, and it is replaced.",
                stacklevel=2,
            )
            return None

    def write(self, chunk: Chunk, result: np.ndarray) -> None:
        """Keep the result of a chunk [cell, 1 + replicate]."""
        if self.folder is not None:
            whole = _described(chunk, result)
            path = self._path(chunk)
            write_atomically(path, lambda temporary: whole.to_netcdf(temporary, engine="h5netcdf"))

    def _path(self, chunk: Chunk) -> Path:
        assert self.folder is not None
        return self.folder / f"{fingerprint(VERSION, chunk.content())}.nc"


def _make(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"store={str(folder)!r} is a file. A folder is needed, which is made if it is not "
            'there, since each finished chunk is a file in it: store="finished".'
        )
    folder.mkdir(parents=True, exist_ok=True)
    # Tried now: a folder that cannot be written would cost a chunk, and the library takes its time
    # to load, in which results would wait that a kill would lose.
    with tempfile.TemporaryDirectory(prefix=".trial-", dir=folder) as trial:
        xr.Dataset().to_netcdf(Path(trial) / "trial.nc", engine="h5netcdf")


def _described(chunk: Chunk, result: np.ndarray) -> xr.Dataset:
    """Information at the places of a chunk, with all that a reader may ask."""
    task, cells = chunk.task, chunk.candidate[: len(chunk.place)]
    recorded = np.stack(
        [at[own] for at, own in zip(task.recorded.values(), cells.T, strict=True)]
    )  # [transducer, cell] or [transducer, cell, axis]
    where = ["transducer", "cell", "axis"][: recorded.ndim]
    about = {name: str(value) for name, value in task.estimator.settings().items()}
    return xr.Dataset(
        {
            "recorded": (where, recorded, {"units": "m", "long_name": "recorded place"}),
            "information_gain": (
                "cell",
                result[:, 0],
                {"units": "nat", "long_name": "information"},
            ),
            "information_gain_jackknife": (
                ("cell", "replicate"),
                result[:, 1:],
                {"units": "nat", "long_name": "information without each replicate"},
            ),
        },
        coords={"transducer": list(task.recorded)},
        attrs=about | {"key": task.seed, "bayes_placement": VERSION, "sha256": _checksum(result)},
    )


def _result(content: bytes) -> np.ndarray:
    with xr.open_dataset(io.BytesIO(content), engine="h5netcdf") as found:
        result = np.column_stack(
            [found["information_gain"].values, found["information_gain_jackknife"].values]
        )
        told: Any = found.attrs["sha256"]
    if _checksum(result) != told:
        raise InputError("its numbers are not those that were written")
    return result


def _checksum(result: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(result).tobytes()).hexdigest()
