"""Frames of the socket: a header of JSON, then arrays of single precision."""

import json
from collections.abc import Mapping

import numpy as np

from .._shared.files import Json

ALIGNED = 4
"""Bytes of a number, at multiples of which the arrays begin."""


def packed(header: Mapping[str, object], arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return a frame: the length of the header, the header, and the numbers of the arrays.

    To what the page is told besides the shapes of the arrays are added; they are laid out in order.
    """
    shapes = [[name, list(array.shape)] for name, array in arrays.items()]
    text = json.dumps(finite({**header, "arrays": shapes}), allow_nan=False).encode()
    text += b" " * (-len(text) % ALIGNED)
    numbers = [np.asarray(array, dtype="<f4").tobytes() for array in arrays.values()]
    return b"".join([len(text).to_bytes(ALIGNED, "little"), text, *numbers])


def unpacked(frame: bytes) -> tuple[Json, dict[str, np.ndarray]]:
    """Return header and arrays of a frame, as the page does."""
    end = ALIGNED + int.from_bytes(frame[:ALIGNED], "little")
    header = json.loads(frame[ALIGNED:end])
    numbers, arrays = np.frombuffer(frame, dtype="<f4", offset=end), {}
    for name, shape in header["arrays"]:
        size = int(np.prod(shape))
        arrays[name], numbers = numbers[:size].reshape(shape), numbers[size:]
    return header, arrays


def finite(content: object) -> object:
    """Content with None for numbers that JSON has no words for."""
    if isinstance(content, Mapping):
        return {str(key): finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [finite(value) for value in content]
    if isinstance(content, np.ndarray):
        return finite(content.tolist())
    if isinstance(content, float | np.floating):
        return float(content) if np.isfinite(content) else None
    return content.item() if isinstance(content, np.generic) else content
