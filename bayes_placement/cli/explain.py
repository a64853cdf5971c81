"""`bayes-placement explain`: which physical effect a model lacks."""

from pathlib import Path

from ..criticism.missing.explain import explain
from ..criticism.missing.ranking import Ranking
from ..experiment.experiment import Experiment
from ..plots import ledger as plots
from ._missing_effects import Request
from ._result_files import write_figures, write_report, write_table
from ._terminal import print_list, print_text, terminal_table


def run(request: Request) -> None:
    """Rank the effects that a model may lack, and write tables and figures."""
    inputs = request.read("explain")
    ranking = request.search("explain", explain, inputs)
    inputs.console.print(terminal_table(ranking.table(), "effect"))
    print_list(inputs.console, ranking.words())
    _write(ranking, inputs.experiment, request.out)
    print_text(inputs.console, f"Tables and figures are in {request.out}/")


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
