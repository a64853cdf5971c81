"""Which of several fitted models of the same data is preferred, and how strongly.

By evidence and by leave-one-out predictive densities.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import arviz_stats
import numpy as np
import pandas as pd
import xarray as xr

from ..._types import InputError
from ...experiment.experiment import MEASURED
from ...inference.results import warnings_of
from ...inference.weights import GOOD_PARETO_K
from ._same_data import log_jacobian

LEAST_DRAWS = 100
"""Fewest different posterior draws whose tail can be smoothed."""

LEAST_DIFFERENCE = 4.0
"""Difference in elpd below which its standard error is no guide (doi:10.48550/arXiv.2008.10296)."""

ERRORS = 2.0
"""Standard errors from which on a difference is taken for real."""

Row = dict[str, float]

SCALE = {1.0: "not worth more than a bare mention", 3.0: "positive", 5.0: "strong"}
"""Log Bayes factors up to which evidence is called so; beyond, it is very strong."""

_SHOWN: dict[str, tuple[str, str | None]] = {
    "log evidence": ("log_evidence", "log_evidence_error"),
    "log Bayes factor": ("log_bayes_factor", "log_bayes_factor_error"),
    "elpd_loo": ("elpd_loo", "elpd_loo_error"),
    "elpd difference": ("elpd_difference", "elpd_difference_error"),
    "p_loo": ("p_loo", None),
    "largest Pareto k": ("pareto_k", None),
    "share of Pareto k > 0.7": ("pareto_k_bad", None),
}


@dataclass(frozen=True)
class ModelComparison:
    """Fitted models side by side.

    Parameters
    ----------
    table
        One row for each model. `log_evidence`; `log_bayes_factor` against the best by evidence;
        `elpd_loo`, the expected log density of a datum left out, summed over the data;
        `elpd_difference` to the best by that, each with its standard error `_error`; the effective
        number of parameters `p_loo`; the largest `pareto_k` and the share of data
        `pareto_k_bad` for which it is above 0.7. Densities are those of the outputs of the first
        model. NaN where a model does not give a figure.
    warnings
        What each inference warns of, after its name.
    """

    table: pd.DataFrame
    warnings: tuple[str, ...] = ()

    def words(self) -> list[str]:
        """Say which model is preferred, how strongly, and what not to trust."""
        return [
            *self.warnings,
            *self._absent_words(),
            *self._evidence_words(),
            *self._loo_words(),
            *self._disagreement(),
            *self._pareto_words(),
        ]

    def __str__(self) -> str:
        """Lay out table and words."""
        columns = {
            word: [_cell(row[value], row[error] if error else 0.0) for row in self._rows().values()]
            for word, (value, error) in _SHOWN.items()
        }
        shown = pd.DataFrame(columns, index=self.table.index)
        return "\n".join([shown.T.to_string(), *(f"- {line}" for line in self.words())])

    def _rows(self) -> dict[str, Row]:
        rows: Any = self.table.to_dict("index")
        return rows

    def _ranked(self, column: str) -> list[str]:
        """Names of the models that have a figure, the best first."""
        figure = {name: row[column] for name, row in self._rows().items()}
        known = [name for name, value in figure.items() if not np.isnan(value)]
        return sorted(known, key=lambda name: -figure[name])

    def _gap(self, column: str, name: str) -> tuple[float, float]:
        """By how much a model falls behind the best, with the standard error."""
        row = self._rows()[name]
        return -row[column], float(np.nan_to_num(row[f"{column}_error"]))

    def _evidence_words(self) -> list[str]:
        if len(names := self._ranked("log_evidence")) < 2:
            return []
        gap, error = self._gap("log_bayes_factor", names[1])
        size = f"log Bayes factor {_cell(gap, error)}"
        if gap <= ERRORS * error:
            return [
                f'The evidence does not rank "{names[0]}" and "{names[1]}": {size}, within the '
                "sampling error of the two runs."
            ]
        return [
            f'The evidence prefers "{names[0]}" to "{names[1]}": {size}, {_strength(gap)} on the '
            "scale of Kass and Raftery."
        ]

    def _loo_words(self) -> list[str]:
        if len(names := self._ranked("elpd_loo")) < 2:
            return []
        gap = self._gap("elpd_difference", names[1])
        if not _predicts_better(*gap):
            return [
                f'PSIS-LOO does not tell "{names[0]}" from "{names[1]}": one more datum of the '
                f"same kind is predicted alike, elpd differs by {_cell(*gap)}."
            ]
        return [
            f'PSIS-LOO prefers "{names[0]}" to "{names[1]}": elpd is larger by {_cell(*gap)}, '
            f"{gap[0] / gap[1]:.0f} standard errors."
        ]

    def _disagreement(self) -> list[str]:
        """Say where the two contradict each other, each beyond its own errors."""
        by_evidence, by_loo = self._ranked("log_evidence")[:1], self._ranked("elpd_loo")[:1]
        if by_evidence == by_loo or not (by_evidence and by_loo):
            return []
        evidence = self._gap("log_bayes_factor", by_loo[0])
        loo = self._gap("elpd_difference", by_evidence[0])
        certain = evidence[0] > max(ERRORS * evidence[1], min(SCALE))
        if not (certain and _predicts_better(*loo)):
            return []
        return [
            f'Evidence and PSIS-LOO disagree: the one is for "{by_evidence[0]}", the other for '
            f'"{by_loo[0]}". The evidence also punishes priors that are wider than the data need, '
            f'so look at the priors of "{by_loo[0]}".'
        ]

    def _pareto_words(self) -> list[str]:
        return [
            f'PSIS-LOO of "{name}" is not to be trusted: {100 * row["pareto_k_bad"]:.2g} % of its '
            f"data have a Pareto k above {GOOD_PARETO_K} (largest {row['pareto_k']:.2f}), since "
            "each of them moves the posterior by itself. Go by the evidence, or refit without them."
            for name, row in self._rows().items()
            if row["pareto_k_bad"] > 0
        ]

    def _absent_words(self) -> list[str]:
        found = []
        for name, row in self._rows().items():
            if np.isnan(row["log_evidence"]):
                found.append(f'"{name}" has no evidence; engines.SMC() gives it.')
            if np.isnan(row["elpd_loo"]):
                found.append(
                    f'"{name}" has no PSIS-LOO, which needs {LEAST_DRAWS} different draws and a '
                    "likelihood of each datum: use engines.SMC() and noise.Gaussian() or "
                    "noise.FromCoherence()."
                )
        return found


def compare(results: Mapping[str, xr.DataTree]) -> ModelComparison:
    """Compare fitted models of the same data by evidence and by leaving out one datum.

    Parameters
    ----------
    results
        What `infer` returned, by a name for each model. The models may observe the data in
        different quantities (displacement, velocity, acceleration), whose densities are made
        comparable by the Jacobian between them.

    Returns
    -------
    ModelComparison
        Log evidence with log Bayes factors, and the expected log pointwise predictive density by
        Pareto-smoothed importance sampling (PSIS-LOO), with sentences that say what follows.

    Raises
    ------
    ValueError
        If there are fewer than two models, they describe different data, or neither figure is
        known of two of them.

    Notes
    -----
    Bayes factors are named by Kass and Raftery (doi:10.1080/01621459.1995.10476572), PSIS-LOO is
    that of Vehtari, Gelman and Gabry (doi:10.1007/s11222-016-9696-4). One datum is one line of
    one channel pair, both parts of a complex FRF together. Leaving out one line asks how well a
    line between measured ones is predicted; where a model fails smoothly along frequency, lines
    are no independent judges, and the standard errors of elpd are too small.
    """
    _check_several(results)
    jacobians = log_jacobian(results)
    found = {name: _row(results[name], jacobians[name]) for name in results}
    rows = {name: row for name, (row, _) in found.items()}
    pointwise = {name: elpd for name, (_, elpd) in found.items()}
    _check_known(rows)
    table = pd.DataFrame.from_dict(
        {
            name: row | _behind_evidence(row, rows) | _behind_elpd(pointwise[name], pointwise)
            for name, row in rows.items()
        },
        orient="index",
    )
    return ModelComparison(table, tuple(_warnings(results)))


def _check_several(results: Mapping[str, xr.DataTree]) -> None:
    if len(results) < 2:
        raise InputError(
            f"compare was given {len(results)} model; two or more are needed, since evidence and "
            "elpd say something only next to those of another model of the same data: "
            'compare({"bar": one, "bar with a mass": other}).'
        )


def _check_known(rows: dict[str, Row]) -> None:
    known = [
        sum(_known(row, name) for row in rows.values()) for name in ("log_evidence", "elpd_loo")
    ]
    if max(known) < 2:
        raise InputError(
            "No two of these models have an evidence, nor likelihoods of each datum, so there is "
            "nothing to compare. Infer with engines.SMC(), which gives the evidence, or give the "
            "experiment noise.Gaussian(sigma), which gives each datum a likelihood."
        )


def _warnings(results: Mapping[str, xr.DataTree]) -> list[str]:
    return [
        f"{name}: {sentence}"
        for name, result in results.items()
        for sentence in warnings_of(result)
    ]


def _known(row: Row, name: str) -> bool:
    return not np.isnan(row[name])


def _row(result: xr.DataTree, jacobian: xr.DataArray) -> tuple[Row, np.ndarray]:
    """Figures of one model, and the elpd of each datum."""
    estimates = result["estimates"].to_dataset() if "estimates" in result else xr.Dataset()
    evidence = float(estimates.get("log_evidence", np.nan)) + float(jacobian.sum())
    row = {
        "log_evidence": evidence,
        "log_evidence_error": float(estimates.get("log_evidence_error", np.nan)),
    }
    loo = _loo(result, jacobian)
    if loo is None:
        missing = ("elpd_loo", "elpd_loo_error", "p_loo", "pareto_k", "pareto_k_bad")
        return row | dict.fromkeys(missing, np.nan), np.full(1, np.nan)
    shape = loo.pareto_k.values
    row |= {"elpd_loo": float(loo.elpd), "elpd_loo_error": float(loo.se), "p_loo": float(loo.p)}
    row |= {"pareto_k": shape.max(), "pareto_k_bad": np.mean(shape > GOOD_PARETO_K)}
    return row, loo.elpd_i.values


def _loo(result: xr.DataTree, jacobian: xr.DataArray) -> Any:
    """PSIS-LOO of one model; None where it has no likelihood of each datum or few draws."""
    if "log_likelihood" not in result:
        return None
    outputs = result["log_likelihood"].to_dataset()[MEASURED]
    if set(outputs.dims) - {"chain", "draw"} != set(jacobian.dims):
        return None
    if np.unique(outputs.sum(jacobian.dims)).size < LEAST_DRAWS:  # resampled draws are copies
        return None
    aligned = outputs.sel(sensor=jacobian["sensor"], actuator=jacobian["actuator"])
    likelihood = _per_datum(aligned, jacobian)
    groups = {
        "/posterior": result["posterior"].to_dataset(),
        "/log_likelihood": likelihood.to_dataset(name=MEASURED),
    }
    # The words of a comparison say what it warns of.
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.filterwarnings("ignore", category=UserWarning, module="arviz_stats")
        loo = arviz_stats.loo(
            xr.DataTree.from_dict(groups),
            pointwise=True,
            log_jacobian=_per_datum(jacobian, jacobian),
        )
    loo.pareto_k = loo.pareto_k.where(np.isfinite(loo.pareto_k) & _has_tail(likelihood), np.inf)
    return loo


def _has_tail(likelihood: xr.DataArray) -> xr.DataArray:
    """Tell for which data the tail of the weights 1 / likelihood is left to be fitted.

    Where the weights underflow, the fit returns nothing but its prior, which looks good.
    """
    values = likelihood.transpose("chain", "draw", "datum").values
    ordered = np.sort(values.reshape(-1, values.shape[-1]), axis=0)
    tail = int(min(0.2 * len(ordered), 3 * np.sqrt(len(ordered))))
    fall = ordered[tail] - ordered[0]
    return xr.DataArray(fall < -np.log(np.finfo(float).tiny), dims="datum")


def _per_datum(outputs: xr.DataArray, jacobian: xr.DataArray) -> xr.DataArray:
    """Sum over the parts of a complex FRF, and leave out what was not measured."""
    parts = [name for name in ("part",) if name in outputs.dims]
    levels = [name for name in ("force_level",) if name in outputs.dims]
    places = ("sensor", "actuator", *levels, "frequency")
    flat = outputs.sum(parts, skipna=False).drop_vars(places, errors="ignore")
    there = jacobian.notnull().all(parts).transpose(*places).values.ravel()
    return flat.stack(datum=places, create_index=False).isel(datum=np.flatnonzero(there))


def _behind_evidence(row: Row, rows: dict[str, Row]) -> Row:
    """Log Bayes factor against the model of the largest evidence."""
    known = [one for one in rows.values() if _known(one, "log_evidence")]
    best = max(known, key=lambda one: one["log_evidence"], default=row)
    error = float(np.hypot(row["log_evidence_error"], best["log_evidence_error"]))
    return {
        "log_bayes_factor": row["log_evidence"] - best["log_evidence"],
        "log_bayes_factor_error": 0.0 if row is best else error,
    }


def _behind_elpd(elpd: np.ndarray, pointwise: dict[str, np.ndarray]) -> Row:
    """Difference in elpd to the model that predicts best, and its error over the data."""
    known = [one for one in pointwise.values() if not np.any(np.isnan(one))]
    difference = elpd - max(known, key=np.sum, default=elpd)
    return {
        "elpd_difference": float(np.sum(difference)),
        "elpd_difference_error": float(np.sqrt(difference.size) * np.std(difference)),
    }


def _predicts_better(gap: float, error: float) -> bool:
    return gap > max(LEAST_DIFFERENCE, ERRORS * error)


def _strength(gap: float) -> str:
    return next((word for limit, word in SCALE.items() if gap < limit), "very strong")


def _cell(value: float, error: float) -> str:
    if np.isnan(value):
        return "-"
    return f"{value:.4g}" if not error > 0 else f"{value:.1f} ± {error:.2g}"
