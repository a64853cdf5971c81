"""Misfit of a fitted model: a verdict and sentences."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr

from . import _edges
from ._residuals import FORCE_LEVEL

_ROWS = ("sensor", "actuator", FORCE_LEVEL, "band")
_COLUMNS = {
    "data": "data",
    "chi2_per_datum": "chi2 per datum",
    "expected": "expected",
    "spread": "spread",
    "p_value": "p",
    "whiteness": "p of whiteness",
    "predictive": "predictive p",
}
_TOO_FEW = "the noise is not known, and there are too few lines to see whether residuals are alike."


@dataclass(frozen=True)
class Misfit:
    """What a fitted model leaves of the data.

    Parameters
    ----------
    overall
        The statistics below of all data. `whiteness` is the smaller of the p-value of all
        residuals together and the corrected one of the worst channel pair, corrected for both
        looks.
    groups
        The same by `sensor`, `actuator`, `channel` (pair of both), `force_level` where there are
        several, and frequency `band`: number of `data`; `chi2_per_datum` at the posterior mean
        response, the mean `expected` of a right model and its `spread` (standard deviation), and
        the upper tail `p_value` (NaN where the noise is not known); p-value of `whiteness` along
        frequency; `predictive` p-value. `corrected` is the smallest level at which a group fails
        among all of its kind (Bonferroni), by chi2 or, where the noise is not known, whiteness.
    response
        By line: `measured`, that of the posterior `mean`, and the 90 % band `low` to `high` of
        the posterior predictive (without output error where the experiment has none), of complex
        outputs as log10 of the amplitude; `residual` of each output, `residual_over_noise`, and
        `misfit`, the root mean square of these over the parts of an output.
    edges
        Share of the posterior at the edges of the prior.
    correlation
        FRAC of each channel pair and FDAC, with 90 % bands over the posterior.
    discrepancy
        Smooth part of the residual, with its 95 % band.
    level
        Probability that a right model does not pass.
    noise_known
        Whether the noise level is known, so that chi2 decides; else whiteness does.
    """

    overall: xr.Dataset
    groups: dict[str, xr.Dataset]
    response: xr.Dataset
    edges: xr.Dataset
    correlation: xr.Dataset
    discrepancy: xr.Dataset
    level: float
    noise_known: bool

    @property
    def p_value(self) -> float:
        """Of chi2 where the noise is known, else of whiteness; NaN where neither can be told."""
        return float(self.overall[decides(self.noise_known)])

    @property
    def passed(self) -> bool:
        """Whether a right model gives such a misfit more often than at the level."""
        return self.p_value >= self.level

    def worst(self, kind: str) -> xr.Dataset:
        """The group of a kind that fails most, with its statistics and its name."""
        table = self.groups[kind]
        stacked = table.stack(group=table["chi2_per_datum"].dims, create_index=False)
        return stacked.isel(group=int(np.argmin(_severity(stacked, self.noise_known))))

    def words(self) -> list[str]:
        """Say in sentences whether the model fails, where, and what is suspect."""
        return [
            self._verdict(),
            *self._whiteness_words(),
            *(self._worst_words(kind) for kind in _ROWS if self._tells(kind)),
            *self._predictive_words(),
            *self._discrepancy_words(),
            *_edges.sentences(self.edges),
        ]

    def __str__(self) -> str:
        """Lay out groups and words."""
        return "\n".join([self.table().to_string(), *(f"- {line}" for line in self.words())])

    def table(self) -> pd.DataFrame:
        """One row for all data and for each sensor, actuator, force level and band."""
        tables = {"": self.overall.expand_dims("all")} | {k: self.groups[k] for k in self._shown()}
        rows = {
            " ".join([kind.replace("_", " "), _name(one, kind)]).strip() or "all data": one
            for kind, table in tables.items()
            for one in _split(table)
        }
        return pd.DataFrame.from_dict({name: _cells(one) for name, one in rows.items()}, "index")

    def _shown(self) -> list[str]:
        return [kind for kind in _ROWS if kind in self.groups]

    def _tells(self, kind: str) -> bool:
        """Whether a group of this kind fails and there are others that could have."""
        if kind not in self.groups or self.groups[kind]["data"].size < 2:
            return False
        return float(self.worst(kind)["corrected"]) < self.level

    def _verdict(self) -> str:
        if np.isnan(self.p_value):
            return "Whether the model explains the data cannot be told: " + (
                "it has as many unknowns as data." if self.noise_known else _TOO_FEW
            )
        says = "explains the data" if self.passed else "fails"
        if not self.noise_known:
            alike = "no more alike" if self.passed else "more alike"
            return (
                f"The model {says}: residuals of neighbouring lines are {alike} than chance allows "
                f"({_p(self.p_value)}); the noise level is not known, so its size says nothing."
            )
        low = self.p_value > 1 - self.level / 2
        return (
            f"The model {says}: chi2 per datum is {_against(self.overall)} ({_p(self.p_value)})."
            + (" It is smaller than noise allows: the stated noise is too large." if low else "")
        )

    def _worst_words(self, kind: str) -> str:
        worst, table = self.worst(kind), self.groups[kind]
        failing = int((table["corrected"] < self.level).sum())
        groups = kind.replace("_", " ") + "s"
        how = _against(worst) if self.noise_known else "neighbouring lines are alike"
        return (
            f"{failing} of {table['data'].size} {groups} {'fail' if failing > 1 else 'fails'}, "
            f"{'most of all ' if failing > 1 else ''}{_name(worst, kind)}: {how} "
            f"(corrected {_p(float(worst['corrected']))})."
        )

    def _whiteness_words(self) -> list[str]:
        """Whiteness sees a smooth misfit below the noise, which chi2 does not."""
        value = float(self.overall["whiteness"])
        if not (self.noise_known and self.passed and value < self.level):
            return []
        return [
            f"Yet residuals of neighbouring lines are alike ({_p(value)}), as a smooth misfit "
            "or a window over the time signals makes them."
        ]

    def _predictive_words(self) -> list[str]:
        share = float(self.overall["predictive"])
        if np.isnan(share) or self.level / 2 <= share <= 1 - self.level / 2:
            return []
        return [
            f"In {100 * share:.3g} % of draws, data simulated by the model have a larger misfit "
            "than the measured data (posterior predictive p-value)."
        ]

    def _discrepancy_words(self) -> list[str]:
        share = self.discrepancy["share"]
        if self.passed or not bool(share.max() > 0):
            return []
        most = np.unravel_index(int(np.argmax(share.values)), share.shape)
        place = dict(zip(share.dims, most, strict=True))
        worst = self.discrepancy.isel(place)
        size = abs(worst["mean"]).max("part") if "part" in worst.dims else abs(worst["mean"])
        peak = float(size["frequency"][int(np.argmax(size.fillna(0).values))])
        return [
            f"A smooth discrepancy stands out at {100 * float(share.mean()):.0f} % of all lines, "
            f"most between sensor {worst['sensor'].item()} and actuator "
            f"{worst['actuator'].item()} ({100 * float(worst['share']):.0f} %), and is largest "
            f"there at {peak:.4g} Hz."
        ]


def decides(noise_known: bool) -> str:
    """Name the p-value that decides."""
    return "p_value" if noise_known else "whiteness"


def _severity(table: xr.Dataset, noise_known: bool) -> np.ndarray:
    """What is smallest for the group that fails most; of two p-values of zero, chi2 tells."""
    if not noise_known:
        return table["whiteness"].fillna(1.0).values
    excess = (table["chi2_per_datum"] - table["expected"]) / table["spread"]
    return -excess.where(table["p_value"].notnull(), -np.inf).values


def _split(table: xr.Dataset) -> list[xr.Dataset]:
    (dimension,) = table["data"].dims
    return [table.isel({dimension: i}) for i in range(table.sizes[dimension])]


def _name(one: xr.Dataset, kind: str) -> str:
    if kind not in one.coords:
        return ""
    value = one[kind].item()
    return f"{value:g} N" if kind == FORCE_LEVEL else str(value)


def _cells(one: xr.Dataset) -> dict[str, str]:
    numbers = {name: float(one[name]) for name in _COLUMNS}
    return {_COLUMNS[name]: "-" if np.isnan(x) else f"{x:.3g}" for name, x in numbers.items()}


def _against(one: xr.Dataset) -> str:
    found, expected, spread = (float(one[n]) for n in ("chi2_per_datum", "expected", "spread"))
    return f"{found:.3g}, where a right model gives {expected:.2f} ± {spread:.2f}"


def _p(value: float) -> str:
    return f"p = {value:.2g}" if value > 1e-12 else "p < 1e-12"
