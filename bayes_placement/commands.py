"""commands: in, file names and options; out, results in a folder and a table in the terminal.

Not known here: how words on the command line are read, how anything is computed.
"""

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from . import methods, plots
from ._files import write_whole
from .experiment import Experiment
from .infer import InferenceWarning, infer
from .io import model as models
from .io import netcdf, uff
from .measurement import Measurement
from .report import Report, report

Results = dict[str, xr.DataTree]


def update(
    model: Path, data: Path | None, engine: str, marginal: str, out: Path, seed: int
) -> None:
    """Run `bayes-placement update`: infer, cross-check, and write everything to a folder."""
    console = _console()
    study = models.read(model)
    measurement = _measurement(study, data, model)
    console.print(f"{study.experiment}\n", highlight=False, soft_wrap=True)
    chosen = (
        methods.standard(study.experiment, study.engine)
        if engine == "all"
        else [methods.method(engine, marginal)]
    )
    results = _infer_all(console, study.experiment, measurement, chosen, seed)
    found = report(results)
    _show(console, found)
    _write(results, found, study.truth, out)
    console.print(f"Results and figures are in {out}/", highlight=False)


def _console() -> Console:
    console = Console()
    # A pipe has no width: a table in a file keeps one line for each figure.
    return console if console.is_terminal else Console(width=140)


def _measurement(study: models.Study, data: Path | None, model: Path) -> Measurement:
    if data is not None:
        return uff.read(data, require_positions=False)
    if study.measurement is None:
        raise ValueError(
            f"{model} declares no `measurement` and no --data file is given. Measured FRFs are "
            f"needed: bayes-placement update {model} --data measured.uff"
        )
    return study.measurement


def _infer_all(
    console: Console,
    experiment: Experiment,
    measurement: Measurement,
    chosen: list[methods.Method],
    seed: int,
) -> Results:
    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("time left"),
        TimeRemainingColumn(elapsed_when_finished=True),
    ]
    results: Results = {}
    with Progress(*columns, console=console) as progress:
        for method in chosen:
            task = progress.add_task(method.name, total=1.0)
            results[method.name] = _infer_one(
                experiment,
                measurement,
                method,
                seed,
                lambda share, task=task: progress.update(task, completed=share),  # type: ignore[misc]
            )
    return results


def _infer_one(
    experiment: Experiment,
    measurement: Measurement,
    method: methods.Method,
    seed: int,
    progress: Callable[[float], None],
) -> xr.DataTree:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InferenceWarning)  # the report says the same
        return infer(
            experiment,
            measurement,
            engine=method.engine,
            marginal=method.marginal,
            key=seed,
            progress=progress,
        )


def _show(console: Console, found: Report) -> None:
    table = Table(title="Cross-check: figures ± standard errors", box=SIMPLE_HEAD)
    table.add_column("figure", no_wrap=True)
    for method in found.table.index:
        table.add_column(str(method), justify="right")
    for figure, row in found.table.T.iterrows():
        table.add_row(str(figure), *(str(value) for value in row))
    console.print(table)
    for line in found.words():
        console.print(f"- {line}", highlight=False, soft_wrap=True)


def _write(results: Results, found: Report, truth: Mapping[str, float], out: Path) -> None:
    for number, (method, result) in enumerate(results.items()):
        name = "result.nc" if number == 0 else f"result_{method.replace(' ', '_')}.nc"
        netcdf.write(result, out / name)
    write_whole(out / "cross_check.csv", lambda beside: found.table.T.to_csv(beside))
    write_whole(out / "cross_check.txt", lambda beside: beside.write_text(f"{found}\n"))
    first = next(iter(results.values()))
    figures: dict[str, Figure] = {
        "measured_against_band.png": plots.measured_against_band(first),
        "parameters.png": plots.parameters(first, truth),
        "placement.png": plots.placement(first, truth),
        "methods.png": plots.methods(results),
    }
    for name, figure in figures.items():
        write_whole(out / name, partial(figure.savefig, dpi=120))
