"""Misfit of a fitted model: statistics, a verdict and sentences."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from ..._shared.labels import FORCE_LEVEL
from ..._shared.reprs import notebook_html
from ...inference.chi2 import chi2_in_words, p_in_words
from ...inference.output_residuals import shows_modes
from ...inference.units import three_digits
from ..noise_needed import TOO_FEW, NoiseNeeded
from ._edges import Errors, edges_in_words, errors_in_words

_UNTESTED = "the noise is not known, and there are too few lines to test residuals for correlation."


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
                "it has as many unknowns as data." if self.noise_known else _UNTESTED
            )
        verdict = "explains the data" if self.passed else "fails"
        verdict += ", given its model error" if self.passed and self.has_model_error else ""
        if not self.noise_known:
            return self._of_unknown_noise(verdict)
        low = self.p_value > 1 - self.level / 2
        chi2, p = chi2_in_words(self.overall), p_in_words(self.p_value)
        return f"The model {verdict}: reduced chi-square is {chi2} ({p})." + (
            " It is smaller than the noise allows: the stated noise is too large." if low else ""
        )

    def _of_unknown_noise(self, verdict: str) -> str:
        """Say it where the noise is not known; not that it does where lines tell no noise."""
        noise, whiteness = self.noise_needed, float(self.overall["whiteness"])
        correlation = "correlated" if self.failed else "not significantly correlated"
        said = f"The model {verdict}: residuals of neighbouring lines are {correlation}"
        if noise is not None and self.failed and not noise.p_value > whiteness:
            said = f"The model {verdict}: its noise exceeds the scatter of neighbouring lines"
        untold = noise is not None and noise.is_misfit_alike and self.passed
        if untold:
            said = "Whether the model explains the data cannot be told"
        return (
            f"{said} ({p_in_words(self.p_value)}). The noise level is not known, so chi2 cannot be "
            f"used; the model needs noise of {noise}.{f' {TOO_FEW}' if untold else ''}"
        )


def decides(noise_known: bool) -> str:
    """Name of the p-value that decides."""
    return "p_value" if noise_known else "whiteness"


_CORRELATED = "residuals of neighbouring lines are correlated"
_ROWS = ("sensor", "actuator", FORCE_LEVEL, "band")
_COLUMNS = {
    "data": "data",
    "chi2_per_datum": "reduced chi-square",
    "expected": "expected",
    "spread": "spread",
    "p_value": "p",
    "whiteness": "p of whiteness",
    "predictive": "predictive p",
    "over_scatter": "residual / scatter",
}
_OF_MODES = {"sensor": "row", "actuator": "column", "band": "mode"}
"""Words for the groups of modal parameters."""

_HIDDEN = {True: ("over_scatter",), False: ("chi2_per_datum", "expected", "spread", "p_value")}
"""Columns that say nothing, by whether the noise is known."""


@dataclass(frozen=True, repr=False)
class Misfit:
    """Misfit of a fitted model, over all data and by group.

    Parameters
    ----------
    overall
        The statistics below of all data. `whiteness` is the smaller of the p-values of all
        residuals and of the worst channel pair, corrected for the number of tests (Bonferroni).
    groups
        Statistics by `sensor`, `actuator`, `channel` (pair of both), `force_level` where there are
        several, and frequency `band`: number of `data`; `chi2_per_datum` at the posterior mean
        response, its mean `expected` of a correct model with the standard deviation `spread`, and
        its upper tail `p_value` (NaN where the noise is not known); p-value of `whiteness` along
        frequency; `predictive` p-value. `corrected` is the p-value that decides (of chi2, or of
        whiteness where the noise is not known), corrected for the number of groups of the kind
        (Bonferroni).
    response
        At each line: `residual` of each output, `residual_over_noise`, and `misfit`, the root mean
        square of the latter over the parts of an output.
    edges
        Posterior probability at the edges of the prior.
    correlation
        FRAC of each channel pair and FDAC, with 90 % bands over the posterior.
    discrepancy
        Smooth part of the residual, with its 95 % band.
    level
        Probability that a correct model does not pass.
    noise_known
        Whether the noise level is known. If so, chi2 decides; otherwise whiteness does.
    data_faults
        Faults of the measurement that were seen before the inference, `Experiment.check_data`.
    model_error
        How large the errors of the model had to be, and where they are largest; by kind.
    noise_needed
        Noise that the model needs; None where it is known.
    chi2_without_errors
        Chi2 per datum against the known noise without the errors of the model; NaN without either.

    Examples
    --------
    >>> misfit.passed, sorted(misfit.groups)
    (True, ['actuator', 'band', 'channel', 'sensor'])
    """

    overall: xr.Dataset
    groups: dict[str, xr.Dataset]
    response: xr.Dataset
    edges: xr.Dataset
    correlation: xr.Dataset
    discrepancy: xr.Dataset
    level: float
    noise_known: bool
    data_faults: tuple[str, ...] = ()
    model_error: tuple[Errors, ...] = ()
    noise_needed: NoiseNeeded | None = None
    chi2_without_errors: float = float("nan")

    @property
    def p_value(self) -> float:
        """p-value of chi2 where the noise is known; NaN where undefined.

        Else the smaller p-value of whiteness and of the scatter of neighbouring lines (Bonferroni).
        """
        return self._of_all_data().p_value

    @property
    def passed(self) -> bool:
        """Whether the p-value reaches the level."""
        return self._of_all_data().passed

    def _of_all_data(self) -> Verdict:
        overall = {str(name): float(value) for name, value in self.overall.items()}
        noise = self.noise_known, self.noise_needed
        return Verdict(overall, self.level, *noise, bool(self.model_error))

    def worst(self, kind: str) -> xr.Dataset:
        """The group of a kind with the largest misfit, with its statistics and its name."""
        table = self.groups[kind]
        stacked = table.stack(group=table["chi2_per_datum"].dims, create_index=False)
        return stacked.isel(group=int(np.argmin(_severity(stacked, self.noise_known))))

    def words(self) -> list[str]:
        """Say what is wrong with the data, whether and where the model fails, and of priors."""
        return [
            *self.data_faults,
            self.verdict(),
            *self._model_error_words(),
            *self._whiteness_words(),
            *(self._worst_words(kind) for kind in _ROWS if self._some_fail(kind)),
            *self._predictive_words(),
            *self._discrepancy_words(),
            *edges_in_words(self.edges),
        ]

    def __repr__(self) -> str:
        """State the verdict."""
        return f"Misfit: {self.verdict()}"

    def _repr_html_(self) -> str:
        further = [sentence for sentence in self.words() if sentence != self.verdict()]
        return notebook_html(self.verdict(), self.table(), further)

    def __str__(self) -> str:
        """Table of the groups, then the sentences."""
        return "\n".join([self.table().to_string(), *(f"- {line}" for line in self.words())])

    def table(self) -> pd.DataFrame:
        """One row for all data and for each sensor, actuator, force level and band."""
        tables = {"": self.overall.expand_dims("all")} | {k: self.groups[k] for k in self._shown()}
        rows = {
            " ".join([self._word(kind), _name(group, kind)]).strip() or "all data": group
            for kind, table in tables.items()
            for group in _split(table)
        }
        columns = {n: word for n, word in _COLUMNS.items() if n not in _HIDDEN[self.noise_known]}
        cells = {name: _cells(group, columns) for name, group in rows.items()}
        return pd.DataFrame.from_dict(cells, "index")

    def _shown(self) -> list[str]:
        return [kind for kind in _ROWS if kind in self.groups]

    def _word(self, kind: str) -> str:
        """Word for the groups of a kind."""
        word = _OF_MODES.get(kind, kind) if shows_modes(self.response) else kind
        return word.replace("_", " ")

    def _some_fail(self, kind: str) -> bool:
        """Whether there are several groups of this kind, of which at least one fails."""
        if kind not in self.groups or self.groups[kind]["data"].size < 2:
            return False
        return float(self.worst(kind)["corrected"]) < self.level

    def verdict(self) -> str:
        """Say in one sentence whether the model explains the data."""
        return self._of_all_data().sentence()

    def _model_error_words(self) -> list[str]:
        without = self.chi2_without_errors
        chi2 = [f"Without these errors the reduced chi-square is {three_digits(without)}."]
        return errors_in_words(self.model_error) + (chi2 if np.isfinite(without) else [])

    def _worst_words(self, kind: str) -> str:
        worst, table = self.worst(kind), self.groups[kind]
        failing = int((table["corrected"] < self.level).sum())
        groups = self._word(kind) + "s"
        misfit = (
            f"reduced chi-square is {chi2_in_words(worst)}" if self.noise_known else _CORRELATED
        )
        return (
            f"{failing} of {table['data'].size} {groups} {'fail' if failing > 1 else 'fails'}, "
            f"{'most of all ' if failing > 1 else ''}{_name(worst, kind)}: {misfit} "
            f"(corrected {p_in_words(float(worst['corrected']))})."
        )

    def _whiteness_words(self) -> list[str]:
        """Whiteness detects a smooth misfit smaller than the noise, which chi2 does not."""
        value = float(self.overall["whiteness"])
        if not (self.noise_known and self.passed and value < self.level):
            return []
        return [
            f"However, residuals of neighbouring lines are correlated ({p_in_words(value)}), which "
            "a smooth misfit smaller than the noise or a window over the time signals causes."
        ]

    def _predictive_words(self) -> list[str]:
        share = float(self.overall["predictive"])
        if np.isnan(share) or self.level / 2 <= share <= 1 - self.level / 2:
            return []
        return [
            f"In {100 * share:.3g} % of the posterior draws, data simulated by the model have a "
            "larger misfit than the measured data (posterior predictive p-value)."
        ]

    def _discrepancy_words(self) -> list[str]:
        share = self.discrepancy["share"]
        if self.passed or not bool(share.max() > 0):
            return []
        index = np.unravel_index(int(np.argmax(share.values)), share.shape)
        worst = self.discrepancy.isel(dict(zip(share.dims, index, strict=True)))
        size = abs(worst["mean"]).max("part") if "part" in worst.dims else abs(worst["mean"])
        peak = float(size["frequency"][int(np.argmax(size.fillna(0).values))])
        return [
            f"A smooth discrepancy is significant at {100 * float(share.mean()):.0f} % of all "
            f"lines, most often between sensor {worst['sensor'].item()} and actuator "
            f"{worst['actuator'].item()} ({100 * float(worst['share']):.0f} % of the lines), where "
            f"it is largest at {peak:.4g} Hz."
        ]


def _severity(table: xr.Dataset, noise_known: bool) -> np.ndarray:
    """Smallest for the group with the largest misfit; by chi2, since p-values may all be zero."""
    if not noise_known:
        return table["whiteness"].fillna(1.0).values
    excess = (table["chi2_per_datum"] - table["expected"]) / table["spread"]
    return -excess.where(table["p_value"].notnull(), -np.inf).values


def _split(table: xr.Dataset) -> list[xr.Dataset]:
    (dimension,) = table["data"].dims
    return [table.isel({dimension: i}) for i in range(table.sizes[dimension])]


def _name(group: xr.Dataset, kind: str) -> str:
    if kind not in group.coords:
        return ""
    value = group[kind].item()
    return f"{value:g} N" if kind == FORCE_LEVEL else str(value)


def _cells(group: xr.Dataset, columns: Mapping[str, str]) -> dict[str, str]:
    numbers = {name: float(group[name]) for name in columns}
    return {columns[name]: "-" if np.isnan(x) else f"{x:.3g}" for name, x in numbers.items()}
