"""Case folders: `case.json` and universal files, which need no Python."""

from ._json_fields import CaseError
from ._write import write
from .folder import read

__all__ = ["CaseError", "read", "write"]
