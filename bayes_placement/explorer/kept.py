"""The state of a page in a file, so that a closed page or a killed process is taken up again."""

import json
import os
import secrets
from pathlib import Path
from typing import NamedTuple

from .._shared.errors import InputError, WritingError
from .._shared.files import Json, write_json
from ..experiment.content_hash import content_hash
from .session import SCHEMA, Session

FOLDER = "explored"
"""Folder of such files, in that of the model."""


class KeptPage(NamedTuple):
    """Files of one model and measurement."""

    folder: Path | None
    """Their folder; None where nothing is kept."""
    key: str
    """Hash of model and measurement."""

    def take_up(self, session: Session) -> str:
        """Do again in a session what a file holds; say so where it does not fit any more."""
        content = self._read("json")
        if content is None or content.get("schema") != SCHEMA:
            return ""
        try:
            session.take_up(content)
        except (InputError, LookupError, TypeError, ValueError) as error:
            return f"Not all steps of the last time were taken up: {error}"
        return ""

    def write(self, session: Session) -> str:
        """Keep a session; say so where that fails."""
        if self.folder is None:
            return ""
        try:
            write_json(self._path("json"), session.to_json())
        except WritingError as error:
            return str(error)
        return ""

    def secret(self) -> str:
        """Return the token of the address, the same after a restart; it is for the user alone."""
        if self.folder is None:
            return secrets.token_urlsafe(24)
        kept = self._read("token")
        token = (kept or {}).get("token", "")
        if isinstance(token, str) and len(token) >= 32:
            return token
        token = secrets.token_urlsafe(24)
        self._write_secret(token)
        return token

    def _write_secret(self, token: str) -> None:
        path = self._path("token")
        path.parent.mkdir(parents=True, exist_ok=True)
        # Not for other users of this machine.
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump({"token": token}, file)

    def _path(self, suffix: str) -> Path:
        assert self.folder is not None
        return self.folder / f"{self.key}.{suffix}"

    def _read(self, suffix: str) -> Json | None:
        """Content of a file; None where there is none, or none that was written in full."""
        if self.folder is None:
            return None
        try:
            content = json.loads(self._path(suffix).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return content if isinstance(content, dict) else None


def kept_page(folder: Path | None, *about: object) -> KeptPage:
    """Return the files of a model and what was measured; without a folder nothing is kept."""
    return KeptPage(folder, content_hash(*about)[:16])
