"""`bayes-placement show`: a model or a file of measured FRFs before anything is computed."""

from pathlib import Path

import pandas as pd

from ..experiment.experiment import Experiment, Measurements
from ..experiment.measurement import Measurement
from ..experiment.modal_parameters import ModalParameters
from ..experiment.transducers import Transducer
from ..io import formats
from ..io._gate import files_read
from ..plots import measurement as measurement_plots
from ..plots import structure as structure_plots
from ..positions.bounds import position_text
from ._inputs import print_data_faults, read_study
from ._run import Output, Run


def run(path: Path, output: Output) -> int:
    """Show what a model file, a case folder or a file of FRFs declares, and draw it.

    Parameters
    ----------
    path
        Model file, case folder, or file of measured FRFs.
    output
        Where tables and figures go.

    Returns
    -------
    int
        The exit code.
    """
    is_model = path.is_dir() or path.suffix == ".py" or not path.exists()
    return _show_model(path, output) if is_model else _show_file(path, output)


def _show_model(path: Path, output: Output) -> int:
    screen = output.screen
    with files_read() as files:
        study = read_study(path)
    run = output.begin("show", path, files=files)
    experiment = study.experiment
    screen.text(f"{experiment}\n")
    table = channel_table(experiment)
    screen.table(table, "name")
    run.table("channels.csv", table)
    run.figures({"geometry.png": structure_plots.experiment(experiment)})
    measured = study.measurement
    if measured is None:
        verdict = f"{experiment!r}; no measurement yet."
    else:
        print_data_faults(screen, study, measured)
        _draw(run, measured)
        verdict = f"{experiment!r}; {len(_runs(measured))} measurement(s)."
    screen.verdict(verdict)
    return run.finish(screen, verdict, {"channels": table.reset_index().to_dict("records")})


def _show_file(path: Path, output: Output) -> int:
    screen = output.screen
    measurement = formats.read_measurement(path)
    run = output.begin("show", path, files=[path])
    _draw(run, measurement)
    screen.verdict(repr(measurement))
    places = [
        f"{name} at {position_text(at)} m" for name, at in sorted(measurement.positions.items())
    ]
    screen.list(places or ["No positions are recorded in the file."])
    return run.finish(screen, repr(measurement), {"positions": places})


def _draw(run: Run, measured: Measurements) -> None:
    figures = [page for run in _runs(measured) for page in measurement_plots.pages(run)]
    run.figures({f"frf_{number}.png": page for number, page in enumerate(figures, 1)})


def _runs(measured: Measurements) -> list[Measurement]:
    if isinstance(measured, ModalParameters):  # it has no FRF to be drawn
        return []
    return [measured] if isinstance(measured, Measurement) else list(measured)


def channel_table(experiment: Experiment) -> pd.DataFrame:
    """One row for each transducer: its kind, channels, recorded place and what is unknown."""
    both = {**experiment.sensor, **experiment.actuator}
    table = pd.DataFrame([_row(experiment, transducer) for transducer in both.values()])
    return table.set_index("name")


def _row(experiment: Experiment, transducer: Transducer) -> dict[str, str]:
    unknown = [
        unknown.name.split(".", 2)[2]
        for unknown in experiment.unknowns
        if unknown.is_of_transducer and unknown.owner.name == transducer.name
    ]
    return {
        "name": transducer.name,
        "kind": transducer.kind,
        "channels": " ".join(channel.label for channel in transducer.channels),
        "recorded [m]": position_text(transducer.recorded),
        "tolerance": "exact" if transducer.tolerance is None else str(transducer.tolerance),
        "unknown": ", ".join(unknown),
    }
