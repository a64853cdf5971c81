"""Distinct rows of an array, by their bytes: NumPy sorts them number by number, for seconds."""

import numpy as np
from jaxtyping import Int, Shaped


def distinct_rows(
    rows: Shaped[np.ndarray, "row column"],
) -> tuple[Int[np.ndarray, "different"], Int[np.ndarray, "row"]]:
    """Return the first index of each distinct row, and for each row which of these it is."""
    number: dict[bytes, int] = {}
    which = np.array([number.setdefault(row.tobytes(), len(number)) for row in rows], dtype=int)
    _, first = np.unique(which, return_index=True)
    return first, which
