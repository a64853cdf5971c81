"""update: in, file names and options; out, results in a folder and a table in the terminal.

Not known here: how words on the command line are read, how anything is computed.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from .._progress import stages, terminal
from .._types import InputError
from ..experiment.experiment import Experiment, Measurements
from ..inference import methods
from ..inference.report import Report, report
from ..io import netcdf
from ..io.model import Study
from ..plots import posterior as plots
from . import _studies
from ._outputs import make_folder, write_figures, write_table, write_text
from .terminal import say, say_each

Results = dict[str, xr.DataTree]

TITLE = """\
Cross-check. variation: posterior standard deviation over mean, the uncertainty that is left.
±: standard error of the computation, by which methods that agree may differ."""


def update(
    model: Path, data: Path | None, engine: str, marginal: str | None, out: Path, seed: int
) -> None:
    """Run `bayes-placement update`: infer, cross-check, and write everything to a folder."""
    console = terminal()
    study = _studies.read(model)
    chosen = _chosen(study, engine, marginal)
    measurement = _studies.measured(study, data, model, "update")
    make_folder(out)
    say(console, f"{study.experiment}\n")
    results = _infer_all(console, study.experiment, measurement, chosen, seed)
    found = report(results)
    _show(console, found)
    _write(results, found, study.truth, out)
    say(console, f"Results and figures are in {out}/")


def _chosen(study: Study, engine: str, marginal: str | None) -> list[methods.Method]:
    if engine != "all":
        return [_studies.method(study, engine, marginal or "latent")]
    if marginal is not None:
        raise InputError(
            f"--marginal {marginal} was given without --engine. A marginal goes with one engine, "
            "since --engine all runs several marginals that check each other: "
            f"--engine smc --marginal {marginal}."
        )
    return methods.standard(study.experiment, study.engine)


def _infer_all(
    console: Console,
    experiment: Experiment,
    measurement: Measurements,
    chosen: list[methods.Method],
    seed: int,
) -> Results:
    with stages(console, [one.name for one in chosen]) as begin:
        return {
            one.name: _studies.inferred(experiment, measurement, one, seed, begin(one.name))
            for one in chosen
        }


def _show(console: Console, found: Report) -> None:
    console.print(TITLE, soft_wrap=True)
    for table in _tables(console, found.table):
        console.print(table)
    say_each(console, found.words())


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
    table = Table(box=SIMPLE_HEAD)
    table.add_column("figure", overflow="fold")
    for method in figures.index:
        table.add_column(str(method), justify="right", no_wrap=True)
    above = ""
    for figure, row in figures.T.iterrows():
        unknown, _, what = str(figure).rpartition(" ")
        grouped = what in ("mean", "variation")
        if grouped and unknown != above:
            table.add_row(unknown)
        table.add_row(f"  {what}" if grouped else str(figure), *(str(value) for value in row))
        above = unknown
    return table


def _write(results: Results, found: Report, truth: Mapping[str, float], out: Path) -> None:
    for number, (method, result) in enumerate(results.items()):
        name = "result.nc" if number == 0 else f"result_{method.replace(' ', '_')}.nc"
        netcdf.write(result, out / name)
    write_table(out / "cross_check.csv", found.table.T)
    write_text(out / "cross_check.txt", str(found))
    first = next(iter(results.values()))
    figures = {
        "measured_against_band.png": plots.measured_against_band(first),
        "parameters.png": plots.parameters(first, truth),
        "placement.png": plots.placement(first, truth),
        "methods.png": plots.methods(results, truth),
    }
    write_figures(figures, out)
