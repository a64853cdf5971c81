"""The table of an experiment: every unknown with its prior, unit and role."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpyro.distributions import ExpandedDistribution, Independent, TransformedDistribution
from numpyro.distributions.transforms import AffineTransform, ExpTransform

from .._sites import Role, Unknown

if TYPE_CHECKING:  # the class imports this module
    from .experiment import Experiment

HEADINGS = ("unknown", "prior", "unit", "role")
"""Headings of the table."""


def sentence_on(experiment: "Experiment") -> str:
    """Say how many channels and lines an experiment observes."""
    lines = np.asarray(experiment.frequency)
    sensors, actuators = len(experiment.sensor_channels), len(experiment.actuator_channels)
    if experiment.observe.is_modal:
        return (
            f"Experiment: {lines.size} modes from {lines.min():g} to {lines.max():g} Hz, shapes at "
            f"{sensors} sensor channels, z = {experiment.observe.label}"
        )
    return (
        f"Experiment: {sensors} sensor x {actuators} actuator channels, {lines.size} lines from "
        f"{lines.min():g} to {lines.max():g} Hz, z = {experiment.observe.label}"
    )


def prior_frame(unknowns: Sequence[Unknown]) -> pd.DataFrame:
    """Return the rows of the table, for a notebook."""
    return pd.DataFrame(_rows(unknowns), columns=[*HEADINGS])


def prior_table(unknowns: Sequence[Unknown]) -> list[str]:
    """Return the lines of the table: column headings, then one line for each unknown.

    The standard errors of a model error are one line, since there are many.
    """
    rows: list[tuple[str, ...]] = [HEADINGS, *_rows(unknowns)]
    return [*_table(rows), *_of_noise(unknowns)]


def _rows(unknowns: Sequence[Unknown]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [
        (unknown.name, _described(unknown.distribution), unknown.unit, unknown.role.value)
        for unknown in unknowns
        if not _is_standard_error(unknown)
    ]
    errors = [unknown for unknown in unknowns if _is_standard_error(unknown)]
    count = sum(int(np.prod(unknown.distribution.shape())) for unknown in errors)
    if count:
        rows.append(("model_error.*.standard", f"{count} Normal(0, 1)", "1", errors[0].role.value))
    return rows


def _of_noise(unknowns: Sequence[Unknown]) -> list[str]:
    """Say that the level of the noise is not known, where it is not."""
    names = [unknown.name for unknown in unknowns if unknown.role is Role.OUTPUT_ERROR]
    words = "The level of the noise is not known: it is inferred with all else"
    return [f"{words} ({', '.join(names)})."] if names else []


def _is_standard_error(unknown: Unknown) -> bool:
    return unknown.role is Role.MODEL_ERROR and unknown.field == "standard"


def _described(distribution: Any) -> str:
    """Write a distribution as its name and arguments, Uniform(0.02, 0.06), or as it was made."""
    if isinstance(distribution, Independent):
        return _described(distribution.base_dist)
    if isinstance(distribution, ExpandedDistribution):
        return f"{int(np.prod(distribution.shape()))} {_described(distribution.base_dist)}"
    if type(distribution) is TransformedDistribution:
        words = _described(distribution.base_dist)
        for transform in distribution.transforms:
            words = _transformed(transform, words)
        return words
    values = [getattr(distribution, name, None) for name in distribution.arg_constraints]
    return (
        f"{type(distribution).__name__}({', '.join(_number(v) for v in values if v is not None)})"
    )


def _transformed(transform: Any, words: str) -> str:
    """Write a transform of what is described by words: -1 + exp(Normal(0, 1.5))."""
    if isinstance(transform, ExpTransform):
        return f"exp({words})"
    if isinstance(transform, AffineTransform):
        scaled = words if transform.scale == 1 else f"{_number(transform.scale)} {words}"
        return scaled if transform.loc == 0 else f"{_number(transform.loc)} + {scaled}"
    return f"{type(transform).__name__}({words})"


def _number(value: Any) -> str:
    """Write a number, or the first and the last of several."""
    array = np.asarray(value)
    words = [f"{number:.6g}" for number in np.ravel(array)]
    if len(set(words)) == 1:
        return words[0]
    return f"[{', '.join(words if len(words) < 4 else [words[0], '...', words[-1]])}]"


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return ["  ".join(word.ljust(w) for word, w in zip(row, widths, strict=True)) for row in rows]
