"""What an earlier run found, kept in the user's cache by a hash of all that it follows from."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np

from .._shared.errors import WritingError, warn
from ..experiment.array_store import ArrayStore
from ..experiment.content_hash import content_hash
from ..inference.record import versions
from ..io.model import sources

NOT_WRITTEN = (pickle.PicklingError, AttributeError, TypeError)
"""Raised where an object of the user cannot be written to bytes."""


class KeptAnswer:
    """A result that follows from inputs, the text of the model and versions of libraries alone.

    Without a folder nothing is kept.
    """

    def __init__(self, folder: Path | None, *inputs: Any):
        self._files = None if folder is None else ArrayStore(folder)
        try:
            self._key = "" if folder is None else content_hash(versions(), sources(), *inputs)
        except NOT_WRITTEN:
            self._files = None

    def read(self) -> Any:
        """Return what an earlier run found; None where none did."""
        known = None if self._files is None else self._files.read(self._key)
        return None if known is None else pickle.loads(known["content"].tobytes())

    def write(self, result: Any) -> None:
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
