"""`bayes-placement improve`: add what a model lacks, effect by effect."""

from pathlib import Path

from .._progress import progress_bars
from ..criticism.fitted import fitted_steps
from ..criticism.missing.improve import improve
from ..criticism.missing.ledger import Ledger
from ..effects import library
from ..plots import ledger as plots
from ._inputs import Inputs, read_inputs
from ._result_files import write_figures, write_table, write_text
from ._terminal import print_list, print_text, terminal_table

FITS = "before_and_after.png"


def run(path: Path, data: Path | None, kinds: list[str] | None, out: Path) -> None:
    """Add effects until only the noise is left, and write ledger, tables and figures.

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
    inputs = read_inputs(path, data, "improve", out)
    candidates = library(inputs.experiment, kinds)
    with progress_bars(inputs.console, ["improve"]) as begin:
        ledger = improve(
            inputs.experiment,
            inputs.measurement,
            candidates=candidates,
            progress=begin("improve"),
        )
    inputs.console.print(terminal_table(ledger.table(), "added"))
    print_list(inputs.console, ledger.words())
    _write(ledger, inputs, out)
    print_text(inputs.console, f"Suspicion along the structure: {out / 'suspicion.png'}")
    print_text(inputs.console, f"Response and error before and after: {out / FITS}")
    print_text(inputs.console, f"Everything is in {out}/")


def _write(ledger: Ledger, inputs: Inputs, out: Path) -> None:
    ledger.write(out / "ledger.json")
    write_text(out / "ledger.txt", str(ledger))
    write_table(out / "compared.csv", ledger.compared, index=False)
    write_table(out / "suspicion.csv", ledger.suspicion, index=False)
    fits = fitted_steps(ledger, inputs.experiment, inputs.measurement)
    figures = {
        "error_falls.png": plots.error_falls(ledger),
        "suspicion.png": plots.suspicion(ledger, experiment=inputs.experiment),
        "probabilities.png": plots.probabilities(ledger),
        FITS: plots.before_and_after(fits),
    }
    write_figures(figures, out)
