"""Results of several methods on the same data: one table, and where they disagree."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.special import ndtri

from .._shared.arguments import arguments_checked, check_kind
from .._shared.errors import InputError
from .._shared.reprs import notebook_html
from .results import misfit_of, warnings_of

FALSE_ALARM = 0.01
"""Probability that methods that agree are reported to disagree, over all comparisons."""

EXACT_TOLERANCE = 1e-3
"""Relative difference that two figures without sampling error may have: quadrature's own error."""


class MethodComparison(NamedTuple):
    """Two methods' values of one figure."""

    figure: str
    first: str
    second: str
    values: tuple[float, float]
    errors: tuple[float, float]

    @property
    def deviation(self) -> float:
        """Difference in standard errors; infinite where neither has one and they differ."""
        difference, error = abs(self.values[0] - self.values[1]), float(np.hypot(*self.errors))
        if error > 0:
            return difference / error
        return np.inf if difference > EXACT_TOLERANCE * max(map(abs, self.values)) else 0.0

    def __str__(self) -> str:
        """Both values and how far they are apart."""
        first, second = map(_with_error, self.values, self.errors)
        distance = (
            f"{self.deviation:.0f} standard errors apart"
            if np.isfinite(self.deviation)
            else "though neither has a sampling error"
        )
        return f"{self.figure}, {first} against {second}, {distance}"


class Figure(NamedTuple):
    """A figure of a result with its standard error."""

    unknown: str
    """Name of the unknown that it is of; empty for one of the entire result."""
    statistic: str
    """What it is: `mean`, `variation`, `log evidence`."""
    value: float
    error: float
    """Its value and standard error."""

    @property
    def name(self) -> str:
        """Unknown and statistic."""
        return f"{self.unknown} {self.statistic}".strip()


class CrossCheck(NamedTuple):
    """A cross-check of several methods.

    Parameters
    ----------
    table
        One row for each method, one column for each figure; figures with a standard error are
        written with it.
    disagreements
        Figures on which two methods differ by more than their errors.
    comparisons
        Number of pairs of figures that were compared.
    warnings
        What each method warns of, after its name.
    of_unknowns
        Unknown and statistic of each column of the table that is a figure of an unknown.
    misfits
        What says, after the name of the method, that the model does not explain the data.

    Examples
    --------
    >>> bp.report({"MAP": posterior}).words()
    ['One method alone checks nothing; give a second one to compare with.']
    """

    table: pd.DataFrame
    disagreements: list[MethodComparison]
    comparisons: int
    warnings: list[str]
    of_unknowns: Mapping[str, tuple[str, str]] = {}
    misfits: Sequence[str] = ()

    def words(self) -> list[str]:
        """Sentences: where the model fails, what each method warns of, and where two disagree."""
        return [
            *self.misfits,
            *self.warnings,
            *(_summaries(self.disagreements) or self._agreement()),
        ]

    def _agreement(self) -> list[str]:
        if self.comparisons:
            return ["All methods agree within their errors."]
        if len(self.table) > 1:
            return ["No two methods have a figure with a standard error in common to compare."]
        return ["One method alone checks nothing; give a second one to compare with."]

    def __repr__(self) -> str:
        """Say which methods are compared, and the last sentence."""
        return f"CrossCheck of {', '.join(map(str, self.table.index))}: {self.words()[-1]}"

    def _repr_html_(self) -> str:
        return notebook_html(self.words()[-1], self.table.T, self.words()[:-1])

    def __str__(self) -> str:
        """Table and sentences."""
        return "\n".join([self.table.T.to_string(), *(f"- {line}" for line in self.words())])


@arguments_checked
def report(results: Mapping[str, xr.DataTree]) -> CrossCheck:
    """Compare methods on the same experiment and measurement.

    Parameters
    ----------
    results
        What `infer` returned, by a name for each method.

    Returns
    -------
    CrossCheck
        The table; the pairs of methods that disagree on a mean, a coefficient of variation, the
        divergence or the log evidence by more than their standard errors allow, at a probability
        of one false alarm in a hundred over all comparisons; and their own warnings.

    Examples
    --------
    >>> bp.report({"MAP": posterior}).table.index.tolist()[:2]
    ['MAP']
    """
    needed = "results by the names of their methods are needed, since they are compared"
    instead = 'report({"SMC": bp.infer(experiment, measurement)})'
    check_kind("results", results, Mapping, needed, instead)
    if not results:
        raise InputError(
            "No results were given; those of at least one method are needed, since they are "
            'compared: report({"SMC": bp.infer(experiment, measurement)}).'
        )
    for name, result in results.items():
        why = "methods are compared by figures with standard errors"
        example = f'report({{"{name}": bp.infer(experiment, measurement, engine="map")}})'
        check_result(name, result, why, example)
    rows = {name: _row(result) for name, result in results.items()}
    warnings, misfits = (
        [f"{name}: {line}" for name, result in results.items() for line in sentences_of(result)]
        for sentences_of in (warnings_of, misfit_of)
    )
    comparisons = _comparisons(results)
    table = pd.DataFrame.from_dict(rows, orient="index")
    of_unknowns = {
        figure.name: (figure.unknown, figure.statistic)
        for result in results.values()
        for figure in _figures(result)
        if figure.unknown
    }
    figures = _disagreements(comparisons), len(comparisons)
    return CrossCheck(table, *figures, warnings, of_unknowns, misfits)


def check_result(name: str, result: xr.DataTree, why: str, example: str) -> None:
    """Refuse a tree of another program, such as that of ArviZ's `from_numpyro`.

    For the message: its name, why it is needed, and an example of a call that gets it.
    """
    if not isinstance(result, xr.DataTree) or "estimates" not in result.children:
        raise InputError(
            f'"{name}" holds no group "estimates", so bp.infer did not return it; results of '
            f"bp.infer are needed, since {why}, which a tree of arviz.from_numpyro or another "
            f"program lacks: {example}."
        )


def numbers(results: Mapping[str, xr.DataTree]) -> pd.DataFrame:
    """Figures of several results as numbers, for a file.

    One row for each method and figure: `method`, `figure`, `value`, `standard_error`.
    """
    rows = [
        (name, figure.name, figure.value, figure.error)
        for name, result in results.items()
        for figure in _figures(result)
    ]
    return pd.DataFrame(rows, columns=["method", "figure", "value", "standard_error"])


def _summaries(disagreements: list[MethodComparison]) -> list[str]:
    """One sentence for each pair of methods, about the figure that they differ most on."""
    pairs: dict[tuple[str, str], list[MethodComparison]] = {}
    for comparison in disagreements:
        pairs.setdefault((comparison.first, comparison.second), []).append(comparison)
    return [_summary(*pair, comparisons) for pair, comparisons in pairs.items()]


def _summary(first: str, second: str, disagreements: list[MethodComparison]) -> str:
    largest = max(disagreements, key=lambda comparison: comparison.deviation)
    if len(disagreements) == 1:
        return f"{first} and {second} disagree on one figure: {largest}."
    count = len(disagreements)
    return f"{first} and {second} disagree on {count} figures, most on one: {largest}."


def _figures(result: xr.DataTree) -> Iterator[Figure]:
    """Every figure that has a standard error."""
    estimates = result["estimates"].to_dataset()
    for unknown in map(str, estimates["unknown"].values):
        row = estimates.sel(unknown=unknown)
        yield Figure(unknown, "mean", float(row["mean"]), float(row["mean_error"]))
        yield Figure(unknown, "variation", float(row["cv"]), float(row["cv_error"]))
    kl, kl_error = estimates["kl_parameters"], estimates["kl_parameters_error"]
    yield Figure("", "KL of parameters", float(kl), float(kl_error))
    yield Figure("", "log evidence", float(estimates["log_evidence"]), _evidence_error(result))


def _evidence_error(result: xr.DataTree) -> float:
    error = float(result["estimates"]["log_evidence_error"])
    return 0.0 if result.attrs["engine"] == "Grid" else error


def _row(result: xr.DataTree) -> dict[str, str]:
    estimates = result["estimates"].to_dataset()
    row = {figure.name: _with_error(figure.value, figure.error) for figure in _figures(result)}
    sampled = estimates["ess"].values[estimates["mean_error"].values > 0]
    row["smallest ESS"] = _number(np.round(_among_finite(np.min, sampled)))
    row["largest R-hat"] = _number(_among_finite(np.max, estimates["r_hat"].values))
    row["Pareto k"] = _number(float(estimates.get("pareto_k", np.nan)))
    stats = result["sample_stats"].to_dataset()
    row["node ESS"] = _number(float(stats["node_ess"].mean()) if "node_ess" in stats else np.nan)
    row["seconds"] = f"{result.attrs['seconds']:.1f}"
    return row


def _among_finite(choose: Callable[[np.ndarray], float], values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(choose(finite)) if finite.size else float("nan")


def _number(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.0f}" if value > 1e3 else f"{value:.4g}"


def _with_error(value: float, error: float) -> str:
    """Write a figure to the first digit of its error: 0.03505 ± 0.00003."""
    if np.isnan(value):
        return "-"
    if error == 0:
        return f"{value:.5g} exact"
    if not np.isfinite(error):
        return f"{value:.4g}"
    rounded = float(f"{error:.0e}")
    size = int(np.floor(np.log10(max(abs(value), rounded))))
    power = 0 if -4 < size < 5 else size
    digits = max(0, power - int(np.floor(np.log10(rounded))))
    pair = f"{value / 10.0**power:.{digits}f} ± {error / 10.0**power:.{digits}f}"
    return f"({pair})e{power}" if power else pair


def _comparisons(results: Mapping[str, xr.DataTree]) -> list[MethodComparison]:
    tables = {
        name: {figure.name: (figure.value, figure.error) for figure in _figures(result)}
        for name, result in results.items()
    }
    return [
        MethodComparison(figure, first, second, (a, b), (da, db))
        for first, second in combinations(tables, 2)
        for figure, (a, da) in tables[first].items()
        for b, db in [tables[second].get(figure, (np.nan, np.nan))]
        if np.all(np.isfinite([a, b, da, db]))
    ]


def _disagreements(comparisons: list[MethodComparison]) -> list[MethodComparison]:
    threshold = -ndtri(FALSE_ALARM / 2 / max(1, len(comparisons)))
    return [comparison for comparison in comparisons if comparison.deviation > threshold]
