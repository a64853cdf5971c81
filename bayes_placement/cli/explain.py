"""`bayes-placement explain`: which physical effect a model lacks."""

from pathlib import Path

from .._progress import progress_bars
from ..criticism.missing.explain import explain
from ..criticism.missing.ranking import Ranking
from ..effects import library
from ..experiment.experiment import Experiment
from ..plots import ledger as plots
from ._inputs import read_inputs
from ._result_files import write_figures, write_report, write_table
from ._terminal import print_list, print_text, terminal_table


def run(path: Path, data: Path | None, kinds: list[str] | None, out: Path) -> None:
    """Rank the effects that a model may lack, and write tables and figures.

    Parameters
    ----------
    path
        Model file or case folder.
    data
        Universal file of the measurement; None for that of the study.
    kinds
        Kinds of effects to try; None for all that apply.
    out
        Folder of the results.
    """
    inputs = read_inputs(path, data, "explain", out)
    candidates = library(inputs.experiment, kinds)
    with progress_bars(inputs.console, ["explain"]) as begin:
        ranking = explain(
            inputs.experiment,
            inputs.measurement,
            candidates=candidates,
            progress=begin("explain"),
        )
    inputs.console.print(terminal_table(ranking.table(), "effect"))
    print_list(inputs.console, ranking.words())
    _write(ranking, inputs.experiment, out)
    print_text(inputs.console, f"Tables and figures are in {out}/")


def _write(ranking: Ranking, experiment: Experiment, out: Path) -> None:
    table = ranking.table()
    write_table(out / "explanation.csv", table)
    write_report(out / "explanation.txt", table, ranking.words())
    write_table(out / "suspicion.csv", ranking.suspicion, index=False)
    figures = {
        "suspicion.png": plots.suspicion(ranking, experiment=experiment),
        "probabilities.png": plots.probabilities(ranking),
    }
    write_figures(figures, out)
