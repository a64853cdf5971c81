"""`bayes-placement improve`: add what a model lacks, effect by effect."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..criticism.fitted import fitted_steps
from ..criticism.missing.improve import improve
from ..criticism.missing.ledger import Ledger
from ..criticism.missing.states import LedgerOfStates
from ..experiment.experiment import Experiment, Measurements
from ..plots import ledger as plots
from ._inputs import Inputs
from ._missing_effects import Request
from ._result_files import write_figures, write_table, write_text
from ._terminal import print_list, print_text, terminal_table

FITS = "before_and_after.png"


def run(request: Request) -> None:
    """Add effects until only the noise is left, and write ledger, tables and figures."""
    inputs = request.read("improve")
    states = request.of_states(inputs.study)
    if states:
        _run_states(request, inputs, states)
    else:
        _run_one(request, inputs)
    print_text(inputs.console, f"Everything is in {request.out}/")


def _run_one(request: Request, inputs: Inputs) -> None:
    """Treat one measurement, with a baseline or without."""
    ledger = request.search("improve", improve, inputs)
    inputs.console.print(terminal_table(ledger.table(), "added"))
    print_list(inputs.console, ledger.words())
    _write(ledger, inputs, request.out)
    print_text(inputs.console, f"Suspicion along the structure: {request.out / 'suspicion.png'}")
    print_text(inputs.console, f"Response and error before and after: {request.out / FITS}")


def _run_states(request: Request, inputs: Inputs, states: Mapping[str, Measurements]) -> None:
    """Treat several states; the ledger of each goes into a folder of its own."""
    for label, measurement in [*states.items()][:-1]:  # those of the last were printed
        faults = inputs.experiment.check_data(measurement).sentences()
        print_list(inputs.console, [f'"{label}": {fault}' for fault in faults])
    ledger = request.searched("improve", _improve_states, inputs, states)
    inputs.console.print(terminal_table(ledger.table(), "effect"))
    print_list(inputs.console, ledger.words())
    ledger.write(request.out / "states.json")
    write_text(request.out / "states.txt", str(ledger))
    write_table(request.out / "states.csv", ledger.table())
    for number, (label, of_state) in enumerate(ledger.ledgers.items(), 1):
        folder = request.out / f"state_{number}"
        _write(of_state, inputs._replace(measurement=states[label]), folder)
        print_text(inputs.console, f'Ledger and figures of "{label}": {folder}/')


def _improve_states(
    experiment: Experiment, states: Mapping[str, Measurements], **settings: Any
) -> LedgerOfStates:
    return improve(experiment, states, **settings)


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
