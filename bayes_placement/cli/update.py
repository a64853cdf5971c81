"""`bayes-placement update`: what the data say about a model, by methods that check each other."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from .._types import UsageError
from ..inference import cross_check
from ..inference.report import Report, report
from ..io._gate import files_read
from ..io.model import Study
from ..plots import posterior as plots
from ._inputs import (
    infer_posterior,
    named_method,
    print_data_faults,
    read_measurement,
    read_study,
)
from ._run import Output, Run
from ._terminal import Screen

Results = dict[str, xr.DataTree]

TITLE = """\
Cross-check. variation: posterior standard deviation over mean, the uncertainty that is left.
±: standard error of the computation, by which methods that agree may differ."""


def run(
    path: Path, data: Path | None, engine: str, marginal: str | None, output: Output, seed: int
) -> int:
    """Infer by one method or several, compare them, and write results, tables and figures.

    Parameters
    ----------
    path
        Model file or case folder.
    data
        Universal file of the measurement; None for that of the study.
    engine
        Name of the engine; `all` for several that check each other.
    marginal
        Name of the marginal that goes with one engine; None for latent placement.
    output
        Where the results go.
    seed
        Seed of all engines.
    """
    screen = output.screen
    with files_read() as files:
        study = read_study(path)
        chosen = _chosen_methods(study, engine, marginal)
        measurement = read_measurement(study, data, path, "update")
    run = output.begin("update", path, files=files, seed=seed, engine=engine, marginal=marginal)
    screen.text(f"{study.experiment}\n")
    print_data_faults(screen, study, measurement)
    with screen.progress([method.name for method in chosen]) as begin_task:
        results = {
            method.name: infer_posterior(
                study.experiment, measurement, method, seed, begin_task(method.name)
            )
            for method in chosen
        }
    comparison = report(results)
    verdict = comparison.words()[-1]
    screen.verdict(verdict)
    _print(screen, comparison)
    _write(results, comparison, study.truth, run)
    return run.finish(screen, verdict, {"methods": comparison.table.to_dict("index")})


def _chosen_methods(study: Study, engine: str, marginal: str | None) -> list[cross_check.Method]:
    if engine != "all":
        return [named_method(study, engine, marginal or "latent")]
    if marginal is not None:
        raise UsageError(
            f"--marginal {marginal} was given without --engine. A marginal goes with one engine, "
            "since --engine all runs several marginals that check each other: "
            f"--engine smc --marginal {marginal}."
        )
    return cross_check.standard_methods(study.experiment, study.engine)


def _print(screen: Screen, comparison: Report) -> None:
    screen.text(TITLE)
    for table in _tables(screen.console, comparison.table):
        screen.show(table)
    screen.list(comparison.words()[:-1])


def _tables(console: Console, figures: pd.DataFrame) -> Iterator[Table]:
    """Tables of as many methods as fit side by side, so that no figure is broken into lines."""
    first, last = 0, 1
    while first < len(figures):
        wider = _table(figures.iloc[first : last + 1])
        if last < len(figures) and console.measure(wider).maximum < console.width:
            last += 1
        else:
            yield _table(figures.iloc[first:last])
            first, last = last, last + 1


def _table(figures: pd.DataFrame) -> Table:
    """One column for each method; mean and variation stand below the name of their unknown."""
    table = Table(box=SIMPLE_HEAD)
    table.add_column("figure", overflow="fold")
    for method in figures.index:
        table.add_column(str(method), justify="right", no_wrap=True)
    heading = ""
    for figure, row in figures.T.iterrows():
        unknown, _, statistic = str(figure).rpartition(" ")
        grouped = statistic in ("mean", "variation")
        if grouped and unknown != heading:
            table.add_row(unknown)
        table.add_row(f"  {statistic}" if grouped else str(figure), *(str(value) for value in row))
        heading = unknown
    return table


def _write(results: Results, comparison: Report, truth: Mapping[str, float], run: Run) -> None:
    for number, (method, result) in enumerate(results.items()):
        run.tree("result.nc" if number == 0 else f"result_{method.replace(' ', '_')}.nc", result)
    run.table("cross_check.csv", comparison.table.T)
    run.text("cross_check.txt", str(comparison))
    first = next(iter(results.values()))
    figures = {
        "measured_against_band.png": plots.measured_against_band(first),
        "parameters.png": plots.parameters(first, truth=truth),
        "placement.png": plots.placement(first, truth=truth),
        "methods.png": plots.methods(results, truth=truth),
    }
    run.figures(figures)
