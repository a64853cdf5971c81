"""The table of an experiment: every unknown with its prior, unit and role."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._sites import Unknown


def prior_table(unknowns: Sequence[Unknown]) -> list[str]:
    """Return the lines of the table: column headings, then one line for each unknown."""
    rows = [
        (unknown.name, _described(unknown.distribution), unknown.unit, unknown.role.value)
        for unknown in unknowns
    ]
    return _table([("unknown", "prior", "unit", "role"), *rows])


def _described(distribution: Any) -> str:
    """Write a distribution as its name and arguments: Uniform(0.02, 0.06)."""
    values = [getattr(distribution, name, None) for name in distribution.arg_constraints]
    return (
        f"{type(distribution).__name__}({', '.join(_number(v) for v in values if v is not None)})"
    )


def _number(value: Any) -> str:
    array = np.asarray(value)
    return f"{array:.6g}" if array.ndim == 0 else f"array{array.shape}"


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return ["  ".join(word.ljust(w) for word, w in zip(row, widths, strict=True)) for row in rows]
