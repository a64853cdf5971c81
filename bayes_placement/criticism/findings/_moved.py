"""Which parameters moved from the model as drawn to the models that were fitted."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..._shared.sites import Unknown
from ...inference.estimates import scalars
from ...inference.units import readable

MOST = 3
"""Parameters that are told, those that moved the most."""


def moved_in_words(
    unknowns: Sequence[Unknown],
    priors: Mapping[str, np.ndarray],
    drawn: Mapping[str, float],
    fitted: Mapping[str, Mapping[str, float]],
) -> list[str]:
    """Say, a sentence for each model, how far the fit moved which parameters.

    Draws [draw, ...] are of the priors; values as drawn are recorded positions and means of priors.
    Elements of arrays are given one by one. Fitted values are by the name of a model.
    """
    rows = [
        (word, unknown, drawn[word], float(draws.std()))
        for unknown in unknowns
        if unknown.name in priors
        for word, draws in scalars(unknown.name, np.asarray(priors[unknown.name])[None])
    ]
    return [_sentence(model, values, rows) for model, values in fitted.items()]


def _sentence(
    model: str, values: Mapping[str, float], rows: list[tuple[str, Unknown, float, float]]
) -> str:
    known = [row for row in rows if row[0] in values and row[3] > 0]
    known.sort(key=lambda row: -abs(values[row[0]] - row[2]) / row[3])
    told = [_change(row, values[row[0]]) for row in known[:MOST]]
    if not told:
        return f"Nothing of the model as drawn is unknown, so that fitting moves nothing ({model})."
    return f"Fitted {model}, the model moved the most in {'; '.join(told)}."


def _change(row: tuple[str, Unknown, float, float], value: float) -> str:
    """Say from where to where a parameter moved, in standard deviations of its prior as well."""
    word, unknown, drawn, spread = row
    scale = readable(unknown.unit, unknown.field, max(abs(drawn), abs(value)))
    ends = [scale.number(number, spread / 10) for number in (drawn, value)]
    shift = (value - drawn) / spread
    after = f"{ends[1]} {scale.name}".rstrip()
    return f"{word}, from {ends[0]} to {after} ({shift:+.1f} standard deviations of its prior)"
