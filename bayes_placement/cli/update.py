"""`bayes-placement update`: what the data say about a model, by methods that check each other."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from .._shared.errors import InfeasibleError, UsageError
from .._shared.executors import workers
from .._shared.parts import done_by
from ..criticism.check.check import verdict as verdict_on
from ..experiment.experiment import Measurements
from ..inference import cross_check
from ..inference import summary as summaries
from ..inference.report import CrossCheck, numbers, report
from ..inference.results import warnings_of
from ..io._gate import files_read
from ..io.model import Study
from ..plots import _marginal_panels as pages
from ..plots import modes as mode_plots
from ..plots import posterior as plots
from ._findings import FINDINGS, of_models, of_posterior
from ._inputs import infer_posterior, named_method, print_data_faults, read_both
from ._run import Drawing, Output, Run, numbered
from ._terminal import Screen, command_on

Results = dict[str, xr.DataTree]
OfUnknowns = Mapping[str, tuple[str, str]]

TITLE = """\
Cross-check. variation: posterior standard deviation over mean, the uncertainty that is left.
±: standard error of the computation, by which methods that agree may differ."""


class Sources(NamedTuple):
    """What a model is inferred from: files, and what they hold."""

    path: Path
    data: Path | None
    study: Study
    measurement: Measurements

    def command(self, name: str) -> str:
        """A command on the same model and data."""
        return command_on(name, self.path, self.data)


def run(
    path: Path,
    data: Path | None,
    engine: str | None,
    marginal: str | None,
    output: Output,
    seed: int,
    processes: int | None,
    dask: str | None,
) -> int:
    """Infer by a method or several, and write results, tables and figures.

    Each result is written and shown as it comes. The engine `all` means several methods that check
    each other, None the one that suits the study.
    """
    screen = output.screen
    with files_read() as files:
        study, measurement = read_both(path, data, "update")
    chosen = _chosen_methods(study, engine, marginal)
    possible = _possible(chosen, study, measurement)
    run = output.begin("update", path, files=files, seed=seed, engine=engine, marginal=marginal)
    screen.text(f"{study.experiment}\n")
    print_data_faults(screen, study, measurement, run.fits, stops=True)
    screen.list(possible.left_out)
    results: Results = {}
    with workers(processes, dask=dask) as executor, done_by(executor):
        for number, method in enumerate(possible.methods):
            with screen.progress([method.name]) as begin:
                result = infer_posterior(
                    study.experiment, measurement, method, seed, begin(method.name)
                )
            results[method.name] = result
            _keep(run, method.name, result, is_first=number == 0)
            left = [other.name for other in possible.methods[number + 1 :]]
            if left or number:  # one result alone is shown below what it says
                _show(screen, method.name, result)
                screen.text(f"Left to do: {', '.join(left)}." if left else "")
    sources = Sources(path, data, study, measurement)
    return _conclude(screen, run, results, sources, possible.left_out)


def _chosen_methods(
    study: Study, engine: str | None, marginal: str | None
) -> list[cross_check.Method]:
    if engine == "all" and marginal is not None:
        raise UsageError(
            f"--marginal {marginal} was given beside --engine all. A marginal goes with one "
            "engine, since --engine all runs several marginals that check each other: "
            f"--engine smc --marginal {marginal}."
        )
    if engine == "all":
        return cross_check.standard_methods(study.experiment, study.engine)
    if engine is None and marginal is None:
        return cross_check.standard_methods(study.experiment, study.engine)[:1]
    return [named_method(study, engine or "smc", marginal or "latent")]


def _possible(
    chosen: list[cross_check.Method], study: Study, measurement: Measurements
) -> cross_check.Feasible:
    """The methods that can be done; refuses where there is none."""
    possible = cross_check.feasible(chosen, study.experiment, measurement)
    if not possible.methods:
        raise InfeasibleError(" ".join(possible.left_out))
    return possible


def _keep(run: Run, name: str, result: xr.DataTree, *, is_first: bool) -> None:
    """Write a result as its method ends."""
    run.tree("result.nc" if is_first else f"result_{name.replace(' ', '_')}.nc", result)
    rows = summaries.summary(result)
    suffix = "" if is_first else f"_{name.replace(' ', '_')}"
    run.table(f"parameters{suffix}.csv", summaries.numbers(rows))


def _show(screen: Screen, name: str, result: xr.DataTree) -> None:
    screen.text(f"\n{name}, {result.attrs['seconds']:.0f} s:")
    screen.table(summaries.words(summaries.summary(result)), "unknown")


def _conclude(
    screen: Screen, run: Run, results: Results, sources: Sources, left_out: list[str]
) -> int:
    """Say what all results say together, and write what is left to be written."""
    first = next(iter(results.values()))
    rows = summaries.summary(first)
    peaks = [f"{row.in_words()}." for row in rows if row.peaks]
    comparison = report(results)._replace(misfits=())  # the verdict says it, with commands
    agreement = comparison.words()[-1]
    verdict = agreement if len(results) > 1 else _verdict(rows, next(iter(results)))
    verdict = " ".join([*_failure(first, sources), verdict])
    screen.verdict(verdict)
    if len(results) > 1:
        _print(screen, comparison)
    else:
        _show(screen, next(iter(results)), first)
        screen.list(comparison.warnings)
    screen.list(peaks)
    table = summaries.numbers(rows).reset_index().to_dict("records")
    told = {"parameters": table, "sentences": [*comparison.words(), *peaks], "left_out": left_out}
    sentences = [verdict, *comparison.words()[:-1], *peaks, *left_out]
    warned = [[name, line] for name, result in results.items() for line in warnings_of(result)]
    experiment, measurement = sources.study.experiment, sources.measurement
    _write(results, comparison, run)
    run.verdict(verdict)
    kept = of_posterior(first, experiment, measurement, sentences, warned, "update")
    run.tree(FINDINGS, kept)
    run.figures(*_drawings(results, sources.study.truth, kept))
    return run.finish(screen, verdict, told)


def _failure(result: xr.DataTree, sources: Sources) -> list[str]:
    """Say that the model does not explain the data; nothing where it does."""
    verdict = verdict_on(result)
    if not verdict.failed:
        return []
    return [
        f"{verdict.sentence()} Intervals of a model that fails cannot be trusted: "
        f"`{sources.command('check')}` says where it fails, `{sources.command('improve')}` adds "
        "what it lacks."
    ]


def _verdict(rows: list[summaries.UnknownSummary], method: str) -> str:
    """Say what one method found, in a sentence."""
    parted = sum(bool(row.peaks) for row in rows)
    places = f"; {parted} of them have more than one likely value" if parted else ""
    unknowns = "1 unknown is" if len(rows) == 1 else f"{len(rows)} unknowns are"
    return f"{unknowns} inferred by {method}{places}. --engine all checks it by other methods."


def _print(screen: Screen, comparison: CrossCheck) -> None:
    screen.text(TITLE)
    for table in _tables(screen.console, comparison.table, comparison.of_unknowns):
        screen.show(table)
    screen.list(comparison.words()[:-1])


def _tables(console: Console, figures: pd.DataFrame, of_unknowns: OfUnknowns) -> Iterator[Table]:
    """Tables of as many methods as fit side by side, so that no figure is broken into lines."""
    first, last = 0, 1
    while first < len(figures):
        wider = _table(figures.iloc[first : last + 1], of_unknowns)
        if last < len(figures) and console.measure(wider).maximum < console.width:
            last += 1
        else:
            yield _table(figures.iloc[first:last], of_unknowns)
            first, last = last, last + 1


def _table(figures: pd.DataFrame, of_unknowns: OfUnknowns) -> Table:
    """One column for each method; mean and variation stand below the name of their unknown."""
    table = Table(box=SIMPLE_HEAD)
    table.add_column("figure", overflow="fold")
    for method in figures.index:
        table.add_column(str(method), justify="right", no_wrap=True)
    heading = ""
    for figure, row in figures.T.iterrows():
        unknown, statistic = of_unknowns.get(str(figure), ("", str(figure)))
        if unknown and unknown != heading:
            table.add_row(unknown)
        table.add_row(f"  {statistic}" if unknown else statistic, *(str(value) for value in row))
        heading = unknown
    return table


def _write(results: Results, comparison: CrossCheck, run: Run) -> None:
    if len(results) > 1:
        run.table("cross_check.csv", numbers(results), index=False)
        run.text("cross_check.txt", str(comparison))


def _drawings(results: Results, truth: Mapping[str, float], kept: xr.DataTree) -> list[Drawing]:
    """Figures by the names of their files."""
    first, modes = next(iter(results.values())), of_models(kept, "modes")
    drawn: dict[str, Callable[[], Sequence[Figure]]] = {
        "modes.png" if modes else "measured_against_band.png": lambda: (
            [mode_plots.compared(modes)] if modes else plots.measured_against_band_pages(first)
        ),
        "intervals.png": lambda: pages.intervals(first, truth),
        "parameters.png": lambda: pages.parameters(first, truth),
        "placement.png": lambda: pages.placement(first, truth),
    }
    if len(results) > 1:
        drawn["methods.png"] = lambda: pages.methods(results, truth)
    return [partial(_numbered, name, draw) for name, draw in drawn.items()]


def _numbered(name: str, draw: Callable[[], Sequence[Figure]]) -> dict[str, Figure]:
    return numbered(name, draw())
