"""Comparison of fitted models of the same data by evidence and leave-one-out predictive density."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import arviz_stats
import numpy as np
import pandas as pd
import xarray as xr
from arviz_stats.utils import ELPDData

from ..._shared.arguments import arguments_checked, check_kind
from ..._shared.errors import InputError
from ..._shared.labels import FORCE_LEVEL
from ..._shared.reprs import notebook_html
from ...experiment.experiment import MEASURED
from ...inference.estimates import GOOD_PARETO_K
from ...inference.results import warnings_of
from ._same_data import log_jacobian

LEAST_DRAWS = 100
"""Fewest distinct posterior draws for Pareto smoothing."""

LEAST_DIFFERENCE = 4.0
"""Difference in elpd below which its error is underestimated (doi:10.48550/arXiv.2008.10296)."""

ERRORS = 2.0
"""Number of standard errors from which a difference counts as significant."""

Row = dict[str, float]

SCALE = {1.0: "not worth more than a bare mention", 3.0: "positive", 5.0: "strong"}
"""Upper bound of the log Bayes factor for each word; above the last, evidence is very strong."""

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
        One row for each model: `log_evidence`; `log_bayes_factor` against the model of the largest
        evidence; `elpd_loo`, the log predictive density of each datum given all others, summed
        over the data; `elpd_difference` to the model of the largest elpd; standard errors of these,
        `_error`; the effective number of parameters `p_loo`; the largest `pareto_k`, and the share
        of data `pareto_k_bad` for which it is above 0.7. Densities are those of the outputs of the
        first model. NaN where a figure is not available.
    warnings
        Warnings of each inference, with the name of the model.

    Examples
    --------
    >>> comparison = bp.compare({"placed": posterior, "as recorded": posterior})
    >>> comparison.table.columns[0]
    'log_evidence'
    """

    table: pd.DataFrame
    warnings: tuple[str, ...] = ()

    def words(self) -> list[str]:
        """Say which model is preferred, how strongly, and which figures are unreliable."""
        return [
            *self.warnings,
            *self._absent_words(),
            *self._evidence_words(),
            *self._loo_words(),
            *self._disagreement(),
            *self._pareto_words(),
        ]

    def __repr__(self) -> str:
        """Say which models are compared, and which one is preferred."""
        preferred = [*self._evidence_words(), *self._loo_words()][:1]
        return ": ".join([f"ModelComparison of {', '.join(self.table.index)}", *preferred])

    def _repr_html_(self) -> str:
        return notebook_html(repr(self), self.table, self.words())

    def __str__(self) -> str:
        """Table of the models, then the sentences."""
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
        """Names of the models that have a figure, the largest first."""
        figures = {name: row[column] for name, row in self._rows().items()}
        names = [name for name, figure in figures.items() if not np.isnan(figure)]
        return sorted(names, key=lambda name: -figures[name])

    def _gap(self, column: str, name: str) -> tuple[float, float]:
        """Difference of a model to the best, with the standard error."""
        row = self._rows()[name]
        return 0.0 - row[column], float(np.nan_to_num(row[f"{column}_error"]))

    def _evidence_words(self) -> list[str]:
        if len(names := self._ranked("log_evidence")) < 2:
            return []
        gap, error = self._gap("log_bayes_factor", names[1])
        size = f"log Bayes factor {_cell(gap, error)}"
        if gap <= ERRORS * error:
            return [
                f'The evidence does not separate "{names[0]}" and "{names[1]}": {size}, within the '
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
                f'PSIS-LOO does not separate "{names[0]}" and "{names[1]}": elpd differs by '
                f"{_cell(*gap)}, which is not significant."
            ]
        return [
            f'PSIS-LOO prefers "{names[0]}" to "{names[1]}": elpd is larger by {_cell(*gap)}, '
            f"{gap[0] / gap[1]:.0f} standard errors."
        ]

    def _disagreement(self) -> list[str]:
        """Say where evidence and PSIS-LOO contradict each other, both significantly."""
        by_evidence, by_loo = self._ranked("log_evidence")[:1], self._ranked("elpd_loo")[:1]
        if by_evidence == by_loo or not (by_evidence and by_loo):
            return []
        evidence = self._gap("log_bayes_factor", by_loo[0])
        loo = self._gap("elpd_difference", by_evidence[0])
        certain = evidence[0] > max(ERRORS * evidence[1], min(SCALE))
        if not (certain and _predicts_better(*loo)):
            return []
        return [
            f'Evidence and PSIS-LOO disagree: evidence prefers "{by_evidence[0]}", PSIS-LOO '
            f'prefers "{by_loo[0]}". The evidence decreases with the width of the priors, '
            f'so check the priors of "{by_loo[0]}".'
        ]

    def _pareto_words(self) -> list[str]:
        return [
            f'PSIS-LOO of "{name}" is unreliable: {100 * row["pareto_k_bad"]:.2g} % of its data '
            f"have a Pareto k above {GOOD_PARETO_K} (largest {row['pareto_k']:.2f}), since each of "
            "them alone changes the posterior strongly. Use the evidence, or refit without them."
            for name, row in self._rows().items()
            if row["pareto_k_bad"] > 0
        ]

    def _absent_words(self) -> list[str]:
        sentences = []
        for name, row in self._rows().items():
            if np.isnan(row["log_evidence"]):
                sentences.append(f'"{name}" has no evidence; engines.SMC() computes it.')
            if np.isnan(row["elpd_loo"]):
                sentences.append(
                    f'"{name}" has no PSIS-LOO, which needs {LEAST_DRAWS} distinct draws and a '
                    "likelihood of each datum: use engines.SMC() and noise.Gaussian() or "
                    "noise.FromCoherence()."
                )
        return sentences


@arguments_checked
def compare(results: Mapping[str, xr.DataTree]) -> ModelComparison:
    """Compare fitted models of the same data by evidence and leave-one-out predictive density.

    Parameters
    ----------
    results
        What `infer` returned, by the name of the model. The models may observe the data in
        different quantities (displacement, velocity, acceleration); the Jacobian between these
        makes their densities comparable.

    Returns
    -------
    ModelComparison
        Log evidence with log Bayes factors, and the expected log pointwise predictive density by
        Pareto-smoothed importance sampling (PSIS-LOO), with sentences that interpret them.

    Raises
    ------
    ValueError
        If there are fewer than two models, if they describe different data, or if fewer than two
        have the same figure.

    Notes
    -----
    Bayes factors are named by Kass and Raftery (doi:10.1080/01621459.1995.10476572), PSIS-LOO is
    that of Vehtari, Gelman and Gabry (doi:10.1007/s11222-016-9696-4). One datum is one line of
    one channel pair, both parts of a complex FRF together. PSIS-LOO therefore measures how well a
    line between measured lines is predicted. Where the error of a model is smooth along frequency,
    lines are not independent, and the standard errors of elpd are too small.

    Examples
    --------
    >>> observed = {"placed": posterior, "as recorded": posterior}
    >>> bp.compare(observed).table.index.tolist()
    ['placed', 'as recorded']
    """
    needed = "results by the names of their models are needed, since they are compared"
    instead = 'compare({"nominal": bp.infer(experiment, measurement), "changed": ...})'
    check_kind("results", results, Mapping, needed, instead)
    _check_count(results)
    jacobians = log_jacobian(results)
    rows_and_elpd = {name: _row(results[name], jacobians[name]) for name in results}
    rows = {name: row for name, (row, _) in rows_and_elpd.items()}
    pointwise = {name: elpd for name, (_, elpd) in rows_and_elpd.items()}
    _check_figures(rows)
    table = pd.DataFrame.from_dict(
        {
            name: row | _evidence_gap(row, rows) | _elpd_gap(pointwise[name], pointwise)
            for name, row in rows.items()
        },
        orient="index",
    )
    return ModelComparison(table, tuple(_warnings(results)))


def _check_count(results: Mapping[str, xr.DataTree]) -> None:
    if len(results) < 2:
        raise InputError(
            f"compare was given {len(results)} model; two or more are needed, since only "
            "differences of evidence and elpd between models of the same data have a meaning: "
            'compare({"bar": first, "bar with a mass": second}).'
        )


def _check_figures(rows: dict[str, Row]) -> None:
    counts = [
        sum(_has(row, column) for row in rows.values()) for column in ("log_evidence", "elpd_loo")
    ]
    if max(counts) < 2:
        raise InputError(
            "No two of these models have an evidence, nor likelihoods of each datum, so they "
            "cannot be compared. Infer with engines.SMC(), which computes the evidence, or give "
            "the experiment noise.Gaussian(sigma), which gives each datum a likelihood."
        )


def _warnings(results: Mapping[str, xr.DataTree]) -> list[str]:
    return [
        f"{name}: {sentence}"
        for name, result in results.items()
        for sentence in warnings_of(result)
    ]


def _has(row: Row, column: str) -> bool:
    return not np.isnan(row[column])


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
    row |= {"pareto_k": shape.max(), "pareto_k_bad": float(np.mean(shape > GOOD_PARETO_K))}
    return row, loo.elpd_i.values


def _loo(result: xr.DataTree, jacobian: xr.DataArray) -> ELPDData | None:
    """PSIS-LOO of one model; None without a likelihood of each datum or with too few draws."""
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
    # Warnings of arviz-stats are repeated by the sentences of a comparison.
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
    """Mask of the data for which the weights 1 / likelihood have a tail that can be fitted.

    Where the weights underflow, the fit returns its prior, whose Pareto k is small.
    """
    values = likelihood.transpose("chain", "draw", "datum").values
    ordered = np.sort(values.reshape(-1, values.shape[-1]), axis=0)
    tail = int(min(0.2 * len(ordered), 3 * np.sqrt(len(ordered))))
    fall = ordered[tail] - ordered[0]
    return xr.DataArray(fall < -np.log(np.finfo(float).tiny), dims="datum")


def _per_datum(outputs: xr.DataArray, jacobian: xr.DataArray) -> xr.DataArray:
    """Sum over the parts of a complex FRF, at the measured data alone."""
    summed = [name for name in ("part",) if name in outputs.dims]
    levels = [name for name in (FORCE_LEVEL,) if name in outputs.dims]
    dimensions = ("sensor", "actuator", *levels, "frequency")
    flat = outputs.sum(summed, skipna=False).drop_vars(dimensions, errors="ignore")
    present = jacobian.notnull().all(summed).transpose(*dimensions).values.ravel()
    return flat.stack(datum=dimensions, create_index=False).isel(datum=np.flatnonzero(present))


def _evidence_gap(row: Row, rows: dict[str, Row]) -> Row:
    """Log Bayes factor against the model of the largest evidence."""
    candidates = [candidate for candidate in rows.values() if _has(candidate, "log_evidence")]
    best = max(candidates, key=lambda candidate: candidate["log_evidence"], default=row)
    error = float(np.hypot(row["log_evidence_error"], best["log_evidence_error"]))
    return {
        "log_bayes_factor": row["log_evidence"] - best["log_evidence"],
        "log_bayes_factor_error": 0.0 if row is best else error,
    }


def _elpd_gap(elpd: np.ndarray, pointwise: dict[str, np.ndarray]) -> Row:
    """Difference in elpd to the model of the largest elpd, and its error over the data."""
    candidates = [values for values in pointwise.values() if not np.any(np.isnan(values))]
    difference = elpd - max(candidates, key=np.sum, default=elpd)
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
