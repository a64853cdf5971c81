"""The verdict on a fitted model, from the statistics of all its data."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...inference.chi2 import chi2_in_words, p_in_words
from ..noise_needed import NoiseNeeded

_TOO_FEW = "the noise is not known, and there are too few lines to test residuals for correlation."


class Verdict(NamedTuple):
    """Whether a fitted model explains its data.

    Statistics of all data are `chi2_per_datum`, `expected`, `spread` and `p_value` of `Misfit`
    where the noise level is known: then chi2 decides. Else `whiteness` does, and `noise_needed`
    tells what noise the model needs. The level is the probability that a correct model does not
    pass; the model may have errors of its own.
    """

    overall: Mapping[str, float]
    level: float
    noise_known: bool
    noise_needed: NoiseNeeded | None
    has_model_error: bool

    @property
    def p_value(self) -> float:
        """p-value of chi2 where the noise is known; NaN where undefined.

        Else the smaller p-value of whiteness and of the scatter of neighbouring lines (Bonferroni).
        """
        value = float(self.overall[decides(self.noise_known)])
        scatter = np.nan if self.noise_needed is None else self.noise_needed.p_value
        return value if np.isnan(scatter) else float(min(1.0, 2 * np.fmin(value, scatter)))

    @property
    def passed(self) -> bool:
        """Whether the p-value reaches the level."""
        return self.p_value >= self.level

    @property
    def failed(self) -> bool:
        """Whether the p-value is below the level; neither passed nor failed where it is NaN."""
        return self.p_value < self.level

    def sentence(self) -> str:
        """Say in one sentence whether the model explains the data."""
        if np.isnan(self.p_value):
            return "Whether the model explains the data cannot be decided: " + (
                "it has as many unknowns as data." if self.noise_known else _TOO_FEW
            )
        verdict = "explains the data" if self.passed else "fails"
        verdict += ", given its model error" if self.passed and self.has_model_error else ""
        if not self.noise_known:
            correlation = "not significantly correlated" if self.passed else "correlated"
            return (
                f"The model {verdict}: residuals of neighbouring lines are {correlation} "
                f"({p_in_words(self.p_value)}). The noise level is not known, so chi2 cannot be "
                f"used; the model needs noise of {self.noise_needed}."
            )
        low = self.p_value > 1 - self.level / 2
        chi2, p = chi2_in_words(self.overall), p_in_words(self.p_value)
        return f"The model {verdict}: reduced chi-square is {chi2} ({p})." + (
            " It is smaller than the noise allows: the stated noise is too large." if low else ""
        )


def decides(noise_known: bool) -> str:
    """Name of the p-value that decides."""
    return "p_value" if noise_known else "whiteness"
