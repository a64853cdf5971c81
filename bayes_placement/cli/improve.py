"""`bayes-placement improve`: add what a model lacks, effect by effect."""

from pathlib import Path

from ..criticism.fitted import fitted_steps
from ..criticism.missing.improve import improve
from ..criticism.missing.ledger import Ledger
from ..plots import ledger as plots
from ._inputs import Inputs
from ._missing_effects import Request
from ._result_files import write_figures, write_table, write_text
from ._terminal import print_list, print_text, terminal_table

FITS = "before_and_after.png"


def run(request: Request) -> None:
    """Add effects until only the noise is left, and write ledger, tables and figures."""
    inputs, ledger = request.search("improve", improve)
    inputs.console.print(terminal_table(ledger.table(), "added"))
    print_list(inputs.console, ledger.words())
    _write(ledger, inputs, request.out)
    print_text(inputs.console, f"Suspicion along the structure: {request.out / 'suspicion.png'}")
    print_text(inputs.console, f"Response and error before and after: {request.out / FITS}")
    print_text(inputs.console, f"Everything is in {request.out}/")


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
