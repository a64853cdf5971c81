"""criticism: in, file names and options; out, what a model lacks, in words and files.

Not known here: how words on the command line are read, how anything is computed.
"""

from pathlib import Path
from typing import NamedTuple

import xarray as xr
from rich.console import Console

from .._progress import stages, terminal
from .._types import Progress
from ..criticism.check import check as checking
from ..criticism.check.misfit import Misfit
from ..criticism.fitted import fitted
from ..criticism.missing import explain as explaining
from ..criticism.missing import improve as improving
from ..criticism.missing._whereabouts import places
from ..criticism.missing.explain import Explanation
from ..criticism.missing.ledger import Ledger, Step
from ..effects import library
from ..experiment.experiment import Experiment, Measurements
from ..io.model import Study
from ..plots import ledger as ledger_plots
from ..plots import misfit as misfit_plots
from ..positions.vectors import Recorded
from . import _studies
from ._outputs import make_folder, write_figures, write_table, write_text
from .terminal import frame, say, say_each

POSTERIOR = "posterior"


class _Task(NamedTuple):
    study: Study
    measurement: Measurements


def check(path: Path, data: Path | None, engine: str, out: Path, seed: int) -> None:
    """Run `bayes-placement check`: does the model explain the data, and where not."""
    console = terminal()
    task = _begun(console, path, data, "check", out)
    with stages(console, [POSTERIOR, "check"]) as begin:
        posterior = _posterior(task, engine, seed, begin(POSTERIOR))
        begin("check")
        misfit = checking(posterior)
    words = [*misfit.words(), *_complaints(posterior)]
    console.print(frame(misfit.table(), "group"))
    say_each(console, words)
    _write_misfit(misfit, words, out)
    say(console, f"Tables and figures are in {out}/")


def explain(
    path: Path, data: Path | None, engine: str, kinds: list[str] | None, out: Path, seed: int
) -> None:
    """Run `bayes-placement explain`: which effect is missing, if any."""
    console = terminal()
    task = _begun(console, path, data, "explain", out)
    candidates = library(task.study.experiment, kinds)
    with stages(console, [POSTERIOR, "explain"]) as begin:
        posterior = _posterior(task, engine, seed, begin(POSTERIOR))
        found = explaining(posterior, candidates, progress=begin("explain"))
    words = [*found.words(), *_complaints(posterior)]
    console.print(frame(found.table(), "effect"))
    say_each(console, words)
    _write_explanation(found, words, task.study.experiment, out)
    say(console, f"Tables and figures are in {out}/")


def improve(path: Path, data: Path | None, kinds: list[str] | None, out: Path) -> None:
    """Run `bayes-placement improve`: add what is missing until the noise floor."""
    console = terminal()
    task = _begun(console, path, data, "improve", out)
    candidates = library(task.study.experiment, kinds)
    with stages(console, ["improve"]) as begin:
        ledger = improving(
            task.study.experiment,
            task.measurement,
            candidates=candidates,
            progress=begin("improve"),
        )
    console.print(frame(ledger.table(), "added"))
    say_each(console, ledger.words())
    _write_ledger(ledger, task, out)
    say(console, f"Suspicion along the structure: {out / 'suspicion.png'}")
    say(console, f"Response and error before and after: {out / 'before_and_after.png'}")
    say(console, f"Everything is in {out}/")


def _begun(console: Console, path: Path, data: Path | None, command: str, out: Path) -> _Task:
    study = _studies.read(path)
    measurement = _studies.measured(study, data, path, command)
    make_folder(out)
    say(console, f"{study.experiment}\n")
    return _Task(study, measurement)


def _posterior(task: _Task, engine: str, seed: int, progress: Progress) -> xr.DataTree:
    method = _studies.method(task.study, engine, "latent")
    return _studies.inferred(task.study.experiment, task.measurement, method, seed, progress)


def _complaints(posterior: xr.DataTree) -> list[str]:
    return str(posterior.attrs["complaints"]).splitlines()


def _write_misfit(misfit: Misfit, words: list[str], out: Path) -> None:
    table = misfit.table()
    write_table(out / "misfit.csv", table)
    write_text(out / "misfit.txt", _report(table.to_string(), words))
    figures = {
        "measured_against_band.png": misfit_plots.measured_against_band(misfit),
        "residual_map.png": misfit_plots.residual_map(misfit),
        "discrepancy.png": misfit_plots.discrepancy(misfit),
    }
    write_figures(figures, out)


def _write_explanation(
    found: Explanation, words: list[str], experiment: Experiment, out: Path
) -> None:
    table = found.table()
    write_table(out / "explanation.csv", table)
    write_text(out / "explanation.txt", _report(table.to_string(), words))
    write_table(out / "suspicion.csv", found.suspicion, index=False)
    figures = {
        "suspicion.png": ledger_plots.suspicion(found.suspicion, experiment=experiment),
        "probabilities.png": ledger_plots.probabilities(found),
    }
    write_figures(figures, out)


def _write_ledger(ledger: Ledger, task: _Task, out: Path) -> None:
    ledger.write(out / "ledger.json")
    write_text(out / "ledger.txt", str(ledger))
    write_table(out / "compared.csv", ledger.compared, index=False)
    write_table(out / "suspicion.csv", ledger.suspicion, index=False)
    figures = {
        "error_falls.png": ledger_plots.error_falls(ledger),
        "suspicion.png": ledger_plots.suspicion(
            ledger.suspicion, _places(ledger), task.study.experiment
        ),
        "probabilities.png": ledger_plots.probabilities(ledger),
        "before_and_after.png": ledger_plots.before_and_after(_fits(ledger, task)),
    }
    write_figures(figures, out)


def _fits(ledger: Ledger, task: _Task) -> dict[str, xr.Dataset]:
    """The model as given, and with all that was added, at the mean of the posterior."""
    first, last = ledger.steps[0], ledger.steps[-1]
    fits = {"as given": _fit(task.study.experiment, first, task.measurement)}
    if last.effects:
        named = " and ".join(last.effects)
        fits[f"with {named}"] = _fit(ledger.experiment, last, task.measurement)
    return fits


def _fit(experiment: Experiment, step: Step, measurement: Measurements) -> xr.Dataset:
    return fitted(experiment, measurement, {n: one.mean for n, one in step.parameters.items()})


def _places(ledger: Ledger) -> dict[str, Recorded]:
    """Where the effects that were found sit [m], by kind."""
    means = {name: one.mean for name, one in ledger.steps[-1].parameters.items()}
    return places(ledger.experiment, means)


def _report(table: str, words: list[str]) -> str:
    return "\n".join([table, "", *(f"- {line}" for line in words)])
