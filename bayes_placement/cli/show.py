"""`bayes-placement show`: a model or a file of measurements before anything is computed."""

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from .._shared.errors import InputError, UsageError
from ..experiment._measurement_words import counted
from ..experiment.experiment import Experiment, Measurements
from ..experiment.measurement import Measurement
from ..experiment.modal_parameters import ModalParameters
from ..experiment.transducers import Transducer
from ..io import formats, modal_parameters
from ..io._gate import files_read
from ..io._modal_arrays import holds_modal_parameters
from ..io.model import Study
from ..plots import measurement as measurement_plots
from ..plots import structure as structure_plots
from ..positions.bounds import position_text
from ._inputs import observing, print_data_faults, read_measurement, read_study
from ._run import Drawing, Output, Run
from ._terminal import Screen


def run(path: Path, data: Path | None, output: Output) -> int:
    """Show what a model file, a case folder or a file of FRFs declares, and draw it."""
    is_model = path.is_dir() or path.suffix == ".py" or not path.exists()
    if data is not None and not is_model:
        raise UsageError(
            f"--data {data} was given beside {path}, a file of measurements; a model file or case "
            f"folder is needed, since it is drawn with the data: bayes-placement show model.py "
            f"--data {data}"
        )
    return _show_model(path, data, output) if is_model else _show_file(path, output)


def _show_model(path: Path, data: Path | None, output: Output) -> int:
    screen, refused = output.screen, ""
    with files_read() as files:
        study = read_study(path)
        if data is not None:
            study, refused = _observing(study, read_measurement(data))
    run = output.begin("show", path, files=files)
    experiment = study.experiment
    screen.text(f"{experiment}\n")
    table = channel_table(experiment)
    screen.table(table, "name")
    run.table("channels.csv", table)
    drawings: list[Drawing] = [lambda: {"geometry.png": structure_plots.experiment(experiment)}]
    measured = study.measurement
    if measured is None:
        verdict = f"{experiment!r}; no measurement yet."
    elif isinstance(measured, ModalParameters):
        _list_modes(measured, run, screen)
        screen.list([refused] if refused else [])
        verdict = f"{experiment!r}; {measured!r}"
    else:
        print_data_faults(screen, study, measured, run.fits)
        model = [None] if data is None else _runs(experiment.nominal_measurement())
        drawings.append(partial(_pages, measured, model))
        verdict = f"{experiment!r}; {counted(len(_runs(measured)), 'measurement')}."
    screen.verdict(verdict)
    run.verdict(verdict)
    run.figures(*drawings)
    return run.finish(screen, verdict, {"channels": table.reset_index().to_dict("records")})


def _observing(study: Study, measurement: Measurements) -> tuple[Study, str]:
    """Let a study observe what was measured; where it cannot, both are shown, and why."""
    measured = study._replace(measurement=measurement)
    try:
        return observing(measured, measurement), ""
    except InputError as refusal:
        return measured, str(refusal)


def _show_file(path: Path, output: Output) -> int:
    screen = output.screen
    is_modal = holds_modal_parameters(path)
    run = output.begin("show", path, files=[path])
    if is_modal:
        return _show_modes(modal_parameters.read(path), run, screen)
    measurement = formats.read_measurement(path)
    screen.verdict(repr(measurement))
    run.verdict(repr(measurement))
    table = _measured_channels(measurement)
    screen.table(table, "channel")
    run.table("channels.csv", table)
    places = [
        f"{name} at {position_text(at)} m" for name, at in sorted(measurement.positions.items())
    ]
    if not places:
        screen.list(["No positions are recorded in the file."])
    run.figures(partial(_pages, measurement))
    channels = table.reset_index().to_dict("records")
    return run.finish(screen, repr(measurement), {"positions": places, "channels": channels})


def _measured_channels(measurement: Measurement) -> pd.DataFrame:
    """One row for each measured channel: its kind, and where it is recorded."""
    sides = (("Sensor", measurement.sensors), ("Actuator", measurement.actuators))
    places = {name: position_text(at) for name, at in measurement.positions.items()}
    rows = [
        {
            "channel": channel.label,
            "kind": kind,
            "recorded [m]": places.get(channel.name, "not recorded"),
        }
        for kind, channels in sides
        for channel in channels
    ]
    return pd.DataFrame(rows).set_index("channel")


def _show_modes(modes: ModalParameters, run: Run, screen: Screen) -> int:
    """Show measured modal parameters, of which there is nothing to draw without a model."""
    screen.verdict(repr(modes))
    _list_modes(modes, run, screen)
    return run.finish(screen, repr(modes), {"modes": json.loads(modes.table().to_json())})


def _list_modes(modes: ModalParameters, run: Run, screen: Screen) -> None:
    screen.table(modes.table().map("{:.5g}".format), "mode")
    run.table("modes.csv", modes.table())


def _pages(
    measured: Measurement | Sequence[Measurement], model: Sequence[Measurement | None] = (None,)
) -> dict[str, Figure]:
    """Figures of each force level; a model of one level is drawn with all of them."""
    runs = _runs(measured)
    levels = model if len(model) == len(runs) else [model[0]] * len(runs)
    figures = [
        page
        for run, level in zip(runs, levels, strict=True)
        for page in measurement_plots.pages(run, model=level)
    ]
    return {f"frf_{number}.png": page for number, page in enumerate(figures, 1)}


def _runs(measured: Measurement | Sequence[Measurement]) -> list[Measurement]:
    return [measured] if isinstance(measured, Measurement) else list(measured)


def channel_table(experiment: Experiment) -> pd.DataFrame:
    """One row for each transducer: its kind, channels, recorded place and what is unknown."""
    both = [*experiment.sensor.values(), *experiment.actuator.values()]
    return pd.DataFrame([_row(experiment, transducer) for transducer in both]).set_index("name")


def _row(experiment: Experiment, transducer: Transducer) -> dict[str, str]:
    unknown = [
        ".".join(filter(None, (unknown.field, unknown.component)))
        for unknown in experiment.unknowns
        if tuple(unknown.owner) == (transducer.kind.lower(), transducer.name)
    ]
    return {
        "name": transducer.name,
        "kind": transducer.kind,
        "channels": " ".join(channel.label for channel in transducer.channels),
        "recorded [m]": position_text(transducer.recorded),
        "tolerance": "exact" if transducer.tolerance is None else str(transducer.tolerance),
        "unknown": ", ".join(unknown),
    }
