"""Model files: Python files that declare an experiment and what belongs to it."""

import importlib.util
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, NamedTuple, NoReturn

import cloudpickle
import jax
import numpy as np

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from ..experiment.experiment import Experiment, Measurements
from ..experiment.measurement import Measurement
from ..experiment.modal_parameters import ModalParameters
from ..inference.engines.engine import Engine
from ..positions.channel import printable_name
from ._contents import WIDE, is_wide


@with_short_repr
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
    baseline
        What was measured in an earlier state of the structure; None where the file names none.
    states
        What was measured in each of several states of the structure, by label, the baseline first;
        empty where the file names none.

    Examples
    --------
    >>> study = bp.io.model.read("my_model.py")  # doctest: +SKIP
    >>> study.experiment  # doctest: +SKIP
    """

    experiment: Experiment
    measurement: Measurements | None
    engine: Engine | None
    truth: dict[str, float]
    baseline: Measurements | None = None
    states: Mapping[str, Measurements] = MappingProxyType({})


@arguments_checked
def read(path: str | Path) -> Study:
    """Run a model file and take `experiment` and, if given, the rest.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file declares no experiment, or something else under one of the names.

    Examples
    --------
    >>> study = bp.io.model.read("my_model.py")  # doctest: +SKIP
    """
    module = _run(Path(path))
    experiment = _declared(module, "experiment", Experiment)
    if experiment is None:
        raise InputError(
            f"{path} has no `experiment`. A model file declares one: experiment = "
            "bp.Experiment(...); see models/bar.py for an example."
        )
    measurement, baseline = (_measured(module, name) for name in ("measurement", "baseline"))
    engine = _declared(module, "engine", Engine)
    truth = _declared(module, "truth", dict) or {}
    states = _declared(module, "states", dict) or {}
    for label in states:
        printable_name(f"{path}: a state of the label", label)
    return Study(experiment, measurement, engine, truth, baseline, states)


def _run(path: Path) -> ModuleType:
    if not path.is_file():
        raise FileNotFoundError(
            f"There is no model file {path}. Give a Python file that defines `experiment`, "
            "for example models/bar.py."
        )
    spec = importlib.util.spec_from_file_location(f"_model_{path.stem}", path.resolve())
    content = path.read_bytes()
    if spec is None or spec.loader is None or b"\0" in content:  # none of text
        what = WIDE if is_wide(content) else "no Python file"
        raise InputError(f"{path} is {what}. Give one that defines `experiment`: models/bar.py.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with _folder_on_import_path(path.resolve().parent), _guarded(path.resolve()):
        # Not from bytecode, which is taken for that of another text of one size and second.
        exec(compile(content, str(path.resolve()), "exec"), vars(module))
    # Other processes cannot import it by its name: they get its classes and functions as they are.
    _READ[:] = [module]
    for defined in (module, *_imported()):
        cloudpickle.register_pickle_by_value(defined)
    return module


def _imported() -> list[ModuleType]:
    """Modules of its folder that the last model file imported."""
    names = (name for names in _IMPORTED.values() for name in names)
    return [sys.modules[name] for name in names if name in sys.modules]


@contextmanager
def _folder_on_import_path(folder: Path) -> Iterator[None]:
    """Let a model file import modules of its folder, as a script may.

    The folder stays on the import path, for imports inside functions, until another model is read.
    Then the modules of the former folder are forgotten, since others may have the same names.
    """
    for former, names in _IMPORTED.items():
        sys.path[:] = [entry for entry in sys.path if entry != former]
        for name in names:
            sys.modules.pop(name, None)
    _IMPORTED.clear()
    sys.path.insert(0, str(folder))
    known = set(sys.modules)
    try:
        yield
    finally:
        _IMPORTED[str(folder)] = [
            name
            for name in set(sys.modules) - known
            if folder in Path(getattr(sys.modules[name], "__file__", None) or "/").parents
        ]


def _sources() -> list[bytes]:
    """Text of the last model file, and of the modules of its folder that it imported."""
    files = (getattr(module, "__file__", None) for module in (*_READ, *_imported()))
    return [Path(file).read_bytes() for file in files if file is not None]


_READ: list[ModuleType] = []
"""The last model file."""

_IMPORTED: dict[str, list[str]] = {}
"""Folder of the last model file, and the modules in it that the model imported."""


def _measured(module: ModuleType, name: str) -> Measurements | None:
    measurement: Any = getattr(module, name, None)
    is_list = isinstance(measurement, list | tuple) and measurement
    if is_list and all(isinstance(item, Measurement) for item in measurement):
        return measurement
    if isinstance(measurement, ModalParameters):
        return measurement
    return _declared(module, name, Measurement)


def _declared(module: ModuleType, name: str, kind: type) -> Any:
    value = getattr(module, name, None)
    if value is not None and not isinstance(value, kind):
        raise InputError(
            f"`{name}` in {module.__file__} is a {type(value).__name__}; a {kind.__name__} is "
            "needed. See models/bar.py for an example."
        )
    return value


SETTINGS = (
    "jax_enable_x64",
    "jax_default_matmul_precision",
    "jax_default_prng_impl",
    "jax_default_dtype_bits",
    "jax_numpy_dtype_promotion",
    "jax_numpy_rank_promotion",
    "jax_random_seed_offset",
    "jax_threefry_partitionable",
    "jax_disable_jit",
    "jax_debug_nans",
    "jax_debug_infs",
)
"""Settings of JAX that change numbers, or what is computed at all."""

ENDS = ("_exit", "abort", "execv", "execve")
"""Functions of `os` that end a program at once; all of its `exec` functions call the last two."""


@contextmanager
def _guarded(path: Path) -> Iterator[None]:
    """Run a model file so that it leaves the program as it was.

    The folder, standard output and error, filters of warnings and errors of NumPy are as before. A
    model that ends the program, or changes a setting of JAX that changes numbers, is refused.
    """
    before = _settings()
    streams = redirect_stdout(sys.stdout), redirect_stderr(sys.stderr)
    with (
        chdir(Path.cwd()),
        streams[0],
        streams[1],
        warnings.catch_warnings(),
        np.errstate(),
        _ends_told(),
    ):
        try:
            yield
        except (Exception, KeyboardInterrupt):
            raise
        except BaseException as error:  # SystemExit, and others that no program catches
            raise _ended(path, error) from error
    _check_settings(path, before)


@contextmanager
def _ends_told() -> Iterator[None]:
    """Let functions raise that end a program without a word; in a fork they end that."""
    home, ends = os.getpid(), {name: getattr(os, name) for name in ENDS}

    def told(name: str) -> Callable[..., NoReturn]:
        def end(*arguments: object) -> NoReturn:
            if os.getpid() != home:
                ends[name](*arguments)
            raise SystemExit(f"os.{name}")

        return end

    for name in ends:
        setattr(os, name, told(name))
    try:
        yield
    finally:
        for name, function in ends.items():
            setattr(os, name, function)


def _ended(path: Path, error: BaseException) -> InputError:
    frames = traceback.extract_tb(error.__traceback__)
    # A GeneratorExit comes here without the frames in which it was raised.
    lines = [f", line {frame.lineno}" for frame in frames if frame.filename == str(path)]
    return InputError(
        f"{path}{lines[0] if lines else ''}: the model file ended the program ({error!r}); it must "
        "run to its end, since `experiment` is read from it then. Leave that line out, or put what "
        'is no part of the model below if __name__ == "__main__":'
    )


def _settings() -> dict[str, object]:
    return {name: jax.config.values[name] for name in SETTINGS if name in jax.config.values}


def _check_settings(path: Path, before: dict[str, object]) -> None:
    """Refuse a changed setting, once it is as it was."""
    changed = {name: value for name, value in _settings().items() if value != before[name]}
    for name in changed:
        jax.config.update(name, before[name])
    for name, value in changed.items():
        raise InputError(
            f"{path} set {name} to {value!r}; {before[name]!r} is needed, since it changes "
            f'numbers of all that is computed. Leave out jax.config.update("{name}", ...).'
        )
