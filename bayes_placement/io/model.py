"""model: in, a Python file that declares an experiment; out, the experiment and its measurement.

Not known here: what is in the experiment.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from .._types import InputError
from ..experiment.experiment import Experiment, Measurements
from ..experiment.measurement import Measurement
from ..inference.engines._engine import Engine


class Study(NamedTuple):
    """What a model file declares.

    Parameters
    ----------
    experiment
        The experiment.
    measurement
        What was measured, or one measurement for each force level; None where the file names none.
    engine
        Engine that suits the experiment; None where the file names none.
    truth
        True values of unknowns, by name, where data were made by a simulation.
    """

    experiment: Experiment
    measurement: Measurements | None
    engine: Engine | None
    truth: dict[str, float]


def read(path: str | Path) -> Study:
    """Run a model file and take `experiment` and, if given, the rest.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file declares no experiment, or something else under one of the names.
    """
    module = _run(Path(path))
    experiment = _named(module, "experiment", Experiment)
    if experiment is None:
        raise InputError(
            f"{path} has no `experiment`. A model file declares one: experiment = "
            "bp.Experiment(...); see models/bar.py for an example."
        )
    measurement = _measurement(module)
    engine = _named(module, "engine", Engine)
    return Study(experiment, measurement, engine, _named(module, "truth", dict) or {})


def _run(path: Path) -> ModuleType:
    if not path.is_file():
        raise FileNotFoundError(
            f"There is no model file {path}. Give a Python file that defines `experiment`, "
            "for example models/bar.py."
        )
    spec = importlib.util.spec_from_file_location(f"_model_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InputError(
            f"{path} is no Python file. Give one that defines `experiment`: models/bar.py."
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _measurement(module: ModuleType) -> Measurements | None:
    given: Any = getattr(module, "measurement", None)
    several = isinstance(given, list | tuple) and given
    if several and all(isinstance(one, Measurement) for one in given):
        return given
    return _named(module, "measurement", Measurement)


def _named(module: ModuleType, name: str, kind: type) -> Any:
    value = getattr(module, name, None)
    if value is not None and not isinstance(value, kind):
        raise InputError(
            f"`{name}` in {module.__file__} is a {type(value).__name__}; a {kind.__name__} is "
            "needed. See models/bar.py for an example."
        )
    return value
