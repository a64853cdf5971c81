"""What an earlier run found, kept in the user's cache by a hash of all that it follows from.

Inputs of a question come in, what was found goes out; what is asked is not known here.
"""

import os
import pickle
import stat
import sys
from pathlib import Path
from typing import Any

import numpy as np

from .._shared.errors import WritingError, warn
from ..experiment.array_store import ArrayStore
from ..experiment.content_hash import content_hash
from ..inference.record import versions
from ..io.model import _sources

NOT_WRITTEN = (pickle.PicklingError, AttributeError, TypeError)
"""Raised where an object of the user cannot be written to bytes."""


class KeptAnswer:
    """A result that follows from inputs, the text of the model and versions of libraries alone.

    Nothing is kept without a folder, or in one to which others may write: a result is a pickle.
    """

    def __init__(self, folder: Path | None, *inputs: object):
        self._files = ArrayStore(folder) if folder and _is_private(folder) else None
        try:
            self._key = "" if self._files is None else content_hash(versions(), _sources(), *inputs)
        except NOT_WRITTEN:
            self._files = None

    def read(self) -> Any:
        """Return what an earlier run found; None where none did."""
        known = None if self._files is None else self._files.read(self._key)
        return None if known is None else pickle.loads(known["content"].tobytes())

    def write(self, result: object) -> None:
        """Keep what was found; a run does not end where that fails."""
        if self._files is None:
            return
        try:
            content = np.frombuffer(pickle.dumps(result), np.uint8)
            self._files.write(self._key, {"content": content})
        except NOT_WRITTEN:
            return
        except WritingError as error:
            warn(f"What this run found is not kept for a later one: {error}")


def _is_private(folder: Path) -> bool:
    """Whether the user alone may write to a folder, which is made; on Windows its place says so."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if sys.platform == "win32":
        return True
    state = folder.stat()
    return state.st_uid == os.getuid() and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
