"""`bayes-placement check`: whether a model explains the data, and where it fails."""

from pathlib import Path

import xarray as xr

from .._progress import progress_bars
from ..criticism.check.check import check
from ..criticism.check.misfit import Misfit
from ..inference.results import warnings_of
from ..plots import misfit as plots
from ..plots import posterior as posterior_plots
from ._inputs import infer_posterior, named_method, read_inputs
from ._result_files import write_figures, write_report, write_table
from ._terminal import print_list, print_text, terminal_table


def run(
    path: Path,
    data: Path | None,
    engine: str,
    out: Path,
    seed: int,
    most_lines: int | None,
    model_error: bool,
) -> None:
    """Check a model against the data, and write tables and figures.

    Parameters
    ----------
    path
        Model file or case folder.
    data
        Universal file of the measurement; None for that of the study.
    engine
        Name of the engine that fits the model.
    out
        Folder of the results.
    seed
        Seed of the engine.
    most_lines
        Most lines that are taken; None for all, unless there are too many values.
    model_error
        Whether a model error is declared.
    """
    inputs = read_inputs(path, data, "check", most_lines, model_error)
    method = named_method(inputs.study, engine, "latent")
    with progress_bars(inputs.console, ["posterior", "check"]) as begin:
        posterior = infer_posterior(
            inputs.experiment, inputs.measurement, method, seed, begin("posterior")
        )
        begin("check")
        misfit = check(posterior)
    sentences = [*misfit.words(), *warnings_of(posterior)]
    inputs.console.print(terminal_table(misfit.table(), "group"))
    print_list(inputs.console, [line for line in sentences if line not in inputs.data_faults])
    _write(posterior, misfit, sentences, out)
    print_text(inputs.console, f"Tables and figures are in {out}/")


def _write(posterior: xr.DataTree, misfit: Misfit, sentences: list[str], out: Path) -> None:
    table = misfit.table()
    write_table(out / "misfit.csv", table)
    write_report(out / "misfit.txt", table, sentences)
    figures = {
        "measured_against_band.png": posterior_plots.measured_against_band(posterior),
        "residual_map.png": plots.residual_map(misfit),
        "discrepancy.png": plots.discrepancy(misfit),
    }
    write_figures(figures, out)
