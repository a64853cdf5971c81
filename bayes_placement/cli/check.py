"""`bayes-placement check`: whether a model explains the data, and where it fails."""

from pathlib import Path

import pandas as pd
import xarray as xr

from ..criticism.check.check import check
from ..criticism.check.misfit import Misfit
from ..criticism.fitted_modes import identified_beside_model
from ..inference.results import warnings_of
from ..plots import misfit as plots
from ..plots import modes as mode_plots
from ..plots import posterior as posterior_plots
from ._findings import FINDINGS, best_draw, of_check, of_models
from ._inputs import infer_posterior, method_from_fit, read_inputs
from ._run import Drawing, Output, Run, numbered
from ._terminal import command_on


def run(
    path: Path,
    data: Path | None,
    engine: str,
    output: Output,
    seed: int,
    most_lines: int | None,
    model_error: bool,
) -> int:
    """Check a model against the data, and write tables and figures; 1 where the model fails."""
    inputs = read_inputs(
        path, data, "check", output, most_lines, model_error, seed=seed, engine=engine
    )
    screen, run = inputs.screen, inputs.run
    method, cautions = method_from_fit(inputs, engine)
    with screen.progress(["posterior", "check"]) as begin:
        posterior = infer_posterior(
            inputs.experiment, inputs.measurement, method, seed, begin("posterior")
        )
        begin("check")
        misfit = check(posterior)
    screen.verdict(misfit.verdict())
    screen.table(misfit.table(), "group")
    beside = []
    if output.report:  # modes of the FRFs alone, which take some seconds
        values = best_draw(inputs.experiment, posterior)
        beside = identified_beside_model(inputs.experiment, inputs.measurement, values)
    sentences = [*misfit.words(), *cautions, *warnings_of(posterior), *beside]
    told = {misfit.verdict(), *inputs.data_faults}
    screen.list(sentence for sentence in sentences if sentence not in told)
    flags = ["--model-error"] * model_error
    flags += [] if most_lines is None else ["--lines", str(most_lines)]
    if misfit.passed:
        screen.text(f"What the data say of the parameters: {command_on('update', path, data)}")
    else:
        screen.text(f"What is missing: {command_on('explain', path, data, *flags)}")
    write(misfit, sentences, run)
    run.verdict(misfit.verdict())
    kept = of_check(posterior, misfit, inputs.experiment, inputs.measurement, beside)
    run.tree(FINDINGS, kept)
    run.figures(*_drawings(posterior, misfit, kept))
    return run.finish(screen, misfit.verdict(), {"sentences": sentences}, passed=misfit.passed)


def write(misfit: Misfit, sentences: list[str], run: Run) -> None:
    """Write what a check says as a table and as text."""
    table = misfit.table()
    run.table("misfit.csv", table.apply(pd.to_numeric, errors="coerce"))
    run.report("misfit.txt", table, sentences)


def _drawings(posterior: xr.DataTree, misfit: Misfit, kept: xr.DataTree) -> list[Drawing]:
    """Figures by the names of their files; modes have no neighbours that a curve could join."""
    modes = of_models(kept, "modes")
    if modes:
        fit: list[Drawing] = [lambda: {"modes.png": mode_plots.compared(modes)}]
    else:
        band, pages = posterior_plots.measured_against_band_pages, plots.discrepancy_pages
        fit = [
            lambda: numbered("measured_against_band.png", band(posterior)),
            lambda: numbered("discrepancy.png", pages(misfit)),
        ]
    return [*fit, lambda: {"residual_map.png": plots.residual_map(misfit)}]
