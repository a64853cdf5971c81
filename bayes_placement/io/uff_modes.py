"""The former name of `io.uff.modes`, for scripts that call `io.uff_modes.read`."""

from .uff.modes import read

__all__ = ["read"]
