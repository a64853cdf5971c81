"""What a reader of time records returns, and the libraries that read some of them."""

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..._types import InputError, MissingExtraError
from .. import _reader_process


class Sampled(NamedTuple):
    """Channels of a file, in its units.

    Parameters
    ----------
    arrays
        Samples by name.
    units
        Units that the file states, by name.
    rates
        Sampling rates [Hz] that the file states, by name.
    left_out
        What was not read, by name, and why.
    """

    arrays: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rates: Mapping[str, float]
    left_out: Mapping[str, str] = MappingProxyType({})


def run_library(
    path: Path, script: Path, library: str, *, extra: str, form: str
) -> _reader_process.ReaderResult:
    """Read a file by a library of an extra, in a separate process."""
    if importlib.util.find_spec(library) is None:
        raise MissingExtraError(
            f"{path} cannot be read, since {library} is not installed, which knows {form} files. "
            f'Install it: pip install "bayes_placement[{extra}]".'
        )

    def refused(reason: str) -> InputError:
        return InputError(
            f"{path} cannot be read as a {form} file by {library} ({reason}); a complete file is "
            "needed. Export it again."
        )

    return _reader_process.run(script, path, f"a {form} file", refused)
