"""commands: in, file names and options; out, results in a folder and a table in the terminal.

Not known here: how words on the command line are read, how anything is computed.
"""

import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
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

TITLE = """\
Cross-check. variation: posterior standard deviation over mean, the uncertainty that is left.
±: standard error of the computation, by which methods that agree may differ."""


def update(
    model: Path, data: Path | None, engine: str, marginal: str | None, out: Path, seed: int
) -> None:
    """Run `bayes-placement update`: infer, cross-check, and write everything to a folder."""
    console = _console()
    study = models.read(model)
    chosen = _chosen(study, engine, marginal)
    measurement = _measurement(study, data, model)
    _make_folder(out)  # now, since a folder that cannot be made would cost the whole run
    console.print(f"{study.experiment}\n", highlight=False, soft_wrap=True)
    results = _infer_all(console, study.experiment, measurement, chosen, seed)
    found = report(results)
    _show(console, found)
    _write(results, found, study.truth, out)
    console.print(f"Results and figures are in {out}/", highlight=False, soft_wrap=True)


def _chosen(study: models.Study, engine: str, marginal: str | None) -> list[methods.Method]:
    if engine != "all":
        return [_with_own_engine(methods.method(engine, marginal or "latent"), study)]
    if marginal is not None:
        raise ValueError(
            f"--marginal {marginal} was given without --engine. A marginal goes with one engine, "
            "since --engine all runs several marginals that check each other: "
            f"--engine smc --marginal {marginal}."
        )
    return methods.standard(study.experiment, study.engine)


def _with_own_engine(method: methods.Method, study: models.Study) -> methods.Method:
    """Take the sizes that the model file declares, where it declares this engine."""
    own = study.engine
    return method._replace(engine=own) if own and type(own) is type(method.engine) else method


def _make_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise ValueError(
            f"--out {out} is a file. A folder is needed, which is made if it is not there: "
            "--out results."
        )
    out.mkdir(parents=True, exist_ok=True)


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
    results: Results = {}
    with _progress(console) as progress:
        waiting = [progress.add_task(one.name, total=1.0, start=False, word="") for one in chosen]
        for method, task in zip(chosen, waiting, strict=True):
            progress.start_task(task)
            progress.update(task, word="time left")
            done = partial(_advance, progress, task)
            results[method.name] = _infer_one(experiment, measurement, method, seed, done)
            progress.update(task, completed=1.0, word="took")
    return results


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TextColumn("{task.fields[word]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=console,
        speed_estimate_period=600,  # compilation is one long step
    )


def _advance(progress: Progress, task: TaskID, share: float) -> None:
    # Results are still to be laid out when an engine says that it is done.
    progress.update(task, completed=min(share, 0.99))


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
    console.print(TITLE, soft_wrap=True)
    for table in _tables(console, found.table):
        console.print(table)
    for line in found.words():
        console.print(f"- {line}", highlight=False, soft_wrap=True)


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
    write_whole(out / "cross_check.csv", lambda beside: found.table.T.to_csv(beside))
    write_whole(out / "cross_check.txt", lambda beside: beside.write_text(f"{found}\n"))
    first = next(iter(results.values()))
    figures: dict[str, Figure] = {
        "measured_against_band.png": plots.measured_against_band(first),
        "parameters.png": plots.parameters(first, truth),
        "placement.png": plots.placement(first, truth),
        "methods.png": plots.methods(results, truth),
    }
    for name, figure in figures.items():
        write_whole(out / name, partial(figure.savefig, dpi=120))
