"""`bayes-placement explain`: which physical effect a model lacks."""

from pathlib import Path

from .._progress import progress_bars
from ..criticism.missing.explain import Explanation, explain
from ..effects import library
from ..experiment.experiment import Experiment
from ..inference.results import warnings_of
from ..plots import ledger as plots
from ._inputs import infer_posterior, named_method, read_inputs
from ._result_files import write_figures, write_report, write_table
from ._terminal import print_list, print_text, terminal_table


def run(
    path: Path, data: Path | None, engine: str, kinds: list[str] | None, out: Path, seed: int
) -> None:
    """Rank the effects that a model may lack, and write tables and figures.

    Parameters
    ----------
    path
        Model file or case folder.
    data
        Universal file of the measurement; None for that of the study.
    engine
        Name of the engine that fits the model.
    kinds
        Kinds of effects to try; None for all that apply.
    out
        Folder of the results.
    seed
        Seed of the engine.
    """
    inputs = read_inputs(path, data, "explain", out)
    candidates = library(inputs.experiment, kinds)
    method = named_method(inputs.study, engine, "latent")
    with progress_bars(inputs.console, ["posterior", "explain"]) as begin:
        posterior = infer_posterior(
            inputs.experiment, inputs.measurement, method, seed, begin("posterior")
        )
        explanation = explain(posterior, candidates, progress=begin("explain"))
    sentences = [*explanation.words(), *warnings_of(posterior)]
    inputs.console.print(terminal_table(explanation.table(), "effect"))
    print_list(inputs.console, sentences)
    _write(explanation, sentences, inputs.experiment, out)
    print_text(inputs.console, f"Tables and figures are in {out}/")


def _write(
    explanation: Explanation, sentences: list[str], experiment: Experiment, out: Path
) -> None:
    table = explanation.table()
    write_table(out / "explanation.csv", table)
    write_report(out / "explanation.txt", table, sentences)
    write_table(out / "suspicion.csv", explanation.suspicion, index=False)
    figures = {
        "suspicion.png": plots.suspicion(explanation, experiment=experiment),
        "probabilities.png": plots.probabilities(explanation),
    }
    write_figures(figures, out)
