"""Measured modal parameters: from universal files, tables of text and pyOMA2, and as tables."""

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._shared.arguments import arguments_checked, check_kind, check_positive
from .._shared.errors import InputError
from ..experiment.modal_parameters import ModalParameters
from ..positions.channel import Channel, Channels
from . import _contents as content
from . import _modal_arrays
from ._frf_units import plain
from ._gate import existing, path_of, reading
from .arrays import text
from .uff import modes as measured_modes
from .uff.modes import Arguments

__all__ = ["of_pyoma2", "read", "write"]

FREQUENCY, DAMPING, NUMBER = "natural_frequency", "damping_ratio", "number"
SHAPE, DEVIATION = "shape ", "_deviation"

EXACT = 1e-6
"""Relative deviation of a channel to which shapes were scaled, which has no error."""


@arguments_checked
def read(
    path: str | Path,
    *,
    frequency_deviation: float | int | None = None,
    damping_deviation: float | int | None = None,
    shape_deviation: float | int | None = None,
    names: Mapping[int, str] | None = None,
    poles: _modal_arrays.PoleUnit | None = None,
) -> ModalParameters:
    """Read modal parameters of a universal file (dataset 55), of arrays, or of a table by `write`.

    A universal file states no errors: relative deviations have to be given. Its real normal modes
    and its complex modes are read (those of complex numbers by their real part after the best turn
    of the phase); a channel is a node and a direction in which it moves in some mode. Damping of
    zero stands for none measured. Units cancel, since scales of shapes mean nothing.

    A table has a row for each mode and the columns `natural_frequency [Hz]`,
    `natural_frequency_deviation [Hz]`, and as far as known `damping_ratio`,
    `damping_ratio_deviation`, `number`, and for each channel `shape s1+x` and
    `shape_deviation s1+x`; `nan` stands where nothing is known.

    Files of arrays (MATLAB, NumPy, HDF5) hold natural frequencies [Hz], damping ratios [1] and
    shapes (channel, mode) under names such as `natural_frequency`, `freqExp` or `fn`;
    `damping_ratio`, `dampExp`, `zeta` or `xi`; `shape`, `psiExp` or `phi`; deviations end in `_std`
    or `_deviation`. A file may hold these as well, under the names of the arguments of
    `ModalParameters`; of an array that is not read it is warned:

    - `covariance` (mode, 2 + channels, 2 + channels), in the place of deviations: rows and columns
      are natural frequency, damping ratio and the channels of the shape;
    - `correlation` (mode, mode) of natural frequencies, and `number` (mode);
    - `sensors` (channel), texts such as `s1+x`; else channels are numbered from 1, or named by
      `names`.

    What a file does not say, a mapping may (TOML), which is then read in its place:

        [modal_parameters]
        file = "modes.uff"
        frequency_deviation = 0.001
        damping_deviation = 0.02
        shape_deviation = 0.02
        names = { 11 = "s1", 12 = "s2" }

    Poles are in rad/s by the format. Modal A of shapes of unit modal mass tells where a program
    wrote Hz, or a positive decay; where it does not, the unit of a positive decay has to be given.

    Parameters
    ----------
    path
        The file, or the mapping of it.
    frequency_deviation, damping_deviation
        Standard deviations of natural frequencies and of damping ratios over these [1], where the
        file states none.
    shape_deviation
        Standard deviation of shapes over the greatest displacement of each mode [1], likewise.
    names
        Names of sensors by the number of the node of a universal file, or of the row of shapes; by
        default the number.
    poles
        Unit of the poles of complex modes, where the file leaves it open or is wrong. These
        arguments have the last word over a mapping.

    Returns
    -------
    ModalParameters
        Natural frequencies [Hz], damping ratios [1] and shapes, with their deviations.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If it holds no modal parameters, or no deviation is known.

    Examples
    --------
    >>> modes = bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2])
    >>> path = bp.io.modal_parameters.write(modes, "modes.csv")
    >>> bp.io.modal_parameters.read(path).number
    (1, 2)
    """
    stated = {
        "frequency_deviation": frequency_deviation,
        "damping_deviation": damping_deviation,
        "shape_deviation": shape_deviation,
    }
    relative = {name: value for name, value in stated.items() if value is not None}
    file = path_of(path)
    if _modal_arrays.is_mapping(file):
        mapping = _modal_arrays.read_mapping(file)
        file, relative = mapping.file, mapping.deviations | relative
        names, poles = mapping.names | dict(names or {}), poles or mapping.poles
    for name, value in relative.items():
        check_positive(name, value, f"{name}=0.01")
    existing(file, "a universal file, arrays by name, or a table of text")
    kind = content.content_of(file)
    form = f"modal parameters ({kind or 'in no known format'})"
    with reading(file, form, "Export it again."):
        if kind == content.UNIVERSAL:
            known = measured_modes.load_measured(file, names or {}, poles)
        elif kind in _modal_arrays.OF_ARRAYS:
            known = _modal_arrays.load_arrays(file, dict(names or {}))
        elif kind in (content.TEXT, content.ABAQUS_MATRIX):
            known = _of_table(file)
        else:
            raise InputError(
                f"{file} {content.described(file)}; a universal file, a table of text or arrays by "
                "name are needed. Export the modes as one of these."
            )
        _add_deviations(known, relative)
        return _modal_parameters(known)


@arguments_checked
def write(modal_parameters: ModalParameters, path: str | Path) -> Path:
    """Write modal parameters as a table of text (CSV) or as arrays (.npz), which `read` takes.

    Parameters
    ----------
    modal_parameters
        What was measured; a table has room for standard deviations alone, arrays for covariances.
    path
        The file; arrays are written where it ends in .npz.

    Raises
    ------
    InputError
        If errors are correlated, and a table is asked for.

    Examples
    --------
    >>> modes = bp.ModalParameters([160.0], [0.1], number=[1])
    >>> bp.io.modal_parameters.write(modes, "modes.csv").read_text().split(",")[:2]
    ['natural_frequency [Hz]', 'natural_frequency_deviation [Hz]']
    """
    file = path_of(path)
    if file.suffix.lower() == ".npz":
        np.savez(file, **_modal_arrays.arrays_of(modal_parameters))
        return file
    matrices = (*modal_parameters.covariance, modal_parameters.correlation)
    if any(np.any(matrix - np.diag(np.diag(matrix))) for matrix in matrices):
        raise InputError(
            "Modal parameters with correlated errors were to be written as a table; independent "
            "ones are needed, since a table has room for standard deviations alone. Write arrays: "
            'bp.io.modal_parameters.write(modes, "modes.npz").'
        )
    columns = _columns(modal_parameters)
    with file.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(columns)
        table.writerows(
            zip(*([repr(x) for x in column] for column in columns.values()), strict=True)
        )
    return file


@arguments_checked
def of_pyoma2(result: object, sensors: Channels, *, number: object = None) -> ModalParameters:
    """Make modal parameters of a result of pyOMA2, of its arrays by name or of the like.

    Read are `Fn`, `Xi` and `Phi` (channel, mode) with `Fn_std`, `Xi_std` and `Phi_std`, which an
    SSI with `calc_unc=True` has. Complex shapes are taken by their real part after the best turn of
    the phase. A channel without deviation is the one to which a shape was scaled: it takes up the
    scale alone.

    Parameters
    ----------
    result
        Result of an algorithm, such as `setup["SSIcov"].result`, or a mapping of its arrays.
    sensors
        Channels of the rows of `Phi`, in their order.
    number
        Number of each mode among the elastic modes of the model, in the order of `Fn`; None where
        it is found by comparing shapes and frequencies.

    Returns
    -------
    ModalParameters
        Natural frequencies, damping ratios and shapes with their covariances.

    Raises
    ------
    InputError
        If an array is missing, or they do not make modal parameters.

    Examples
    --------
    >>> result = {"Fn": [160.0], "Fn_std": [0.1], "Xi": [0.01], "Xi_std": [1e-3]}
    >>> result |= {"Phi": [[1.0], [0.5 + 0.01j]], "Phi_std": [[0.0], [0.02]]}
    >>> bp.io.modal_parameters.of_pyoma2(result, ["s1", "s2"])
    ModalParameters: 1 modes from 160 to 160 Hz, 1 with damping ratio, 1 with shape at 2 sensor
    channels.
    """
    arrays = {name: _of_result(result, name) for name in ("Fn", "Fn_std", "Xi", "Xi_std")}
    arrays |= {name: _of_result(result, name) for name in ("Phi", "Phi_std")}
    missing = [name for name, value in arrays.items() if value is None]
    if missing:
        raise InputError(
            f"{', '.join(missing)} of pyOMA2 was not given; modes with deviations are needed, "
            "since these say how far a model may be from them: SSI(..., calc_unc=True), then "
            "setup.mpe(...), and of_pyoma2(setup[name].result, sensors=[...])."
        )
    order = np.argsort(np.ravel(arrays["Fn"]))
    ordered = {name: _ordered(value, order) for name, value in arrays.items()}
    shape, deviation = ordered["Phi"], np.abs(ordered["Phi_std"])
    if shape.shape == deviation.shape:
        deviation = np.where(deviation == 0, EXACT * np.abs(shape), deviation)
    return ModalParameters.of_complex_shapes(
        shape,
        ordered["Fn"],
        natural_frequency_deviation=ordered["Fn_std"],
        damping_ratio=ordered["Xi"],
        damping_ratio_deviation=ordered["Xi_std"],
        shape_deviation=deviation,
        sensors=sensors,
        number=None if number is None else _ordered(number, order),
    )


def _ordered(values: object, order: np.ndarray) -> np.ndarray:
    """Values by mode in the order of frequency; others as they are, to be refused."""
    array = np.asarray(values)
    return array[..., order] if array.shape[-1:] == order.shape else array


def _of_result(result: object, name: str) -> Any:
    return result.get(name) if isinstance(result, Mapping) else getattr(result, name, None)


def _columns(measured: ModalParameters) -> dict[str, list[object]]:
    values, deviation = measured.values.tolist(), measured.deviation.tolist()
    columns = {
        f"{FREQUENCY} [Hz]": values[0],
        f"{FREQUENCY}{DEVIATION} [Hz]": deviation[0],
        f"{DAMPING} [1]": values[1],
        f"{DAMPING}{DEVIATION} [1]": deviation[1],
    }
    if measured.number is not None:
        columns[NUMBER] = list(measured.number)
    for channel, row, error in zip(measured.sensors, values[2:], deviation[2:], strict=True):
        columns[f"shape {channel.label}"] = row
        columns[f"shape{DEVIATION} {channel.label}"] = error
    return columns


def _of_table(path: Path) -> Arguments:
    table = text.load(path)
    arrays = _by_column(table.arrays)
    if FREQUENCY not in arrays:
        raise InputError(
            f"the table has the columns {', '.join(arrays)} and no {FREQUENCY}; a row for each "
            "mode is needed, since natural frequencies tell the modes. Name the columns "
            "natural_frequency [Hz], natural_frequency_deviation [Hz], damping_ratio, "
            "damping_ratio_deviation, shape s1, shape_deviation s1."
        )
    _check_units(table.arrays, table.units)
    labels = [name.removeprefix(SHAPE) for name in arrays if name.startswith(SHAPE)]
    errors = [arrays.get(f"shape{DEVIATION} {label}") for label in labels]
    nothing = np.full(arrays[FREQUENCY].shape, np.nan)
    stated = any(error is not None for error in errors)
    return {
        FREQUENCY: arrays[FREQUENCY],
        FREQUENCY + DEVIATION: arrays.get(FREQUENCY + DEVIATION),
        DAMPING: arrays.get(DAMPING),
        DAMPING + DEVIATION: arrays.get(DAMPING + DEVIATION),
        "shape": np.stack([arrays[SHAPE + label] for label in labels]) if labels else None,
        "shape_deviation": np.stack([nothing if e is None else e for e in errors])
        if stated
        else None,
        "sensors": tuple(Channel.parse(label) for label in labels),
        NUMBER: arrays.get(NUMBER),
    }


def _by_column(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays by the names of columns, which their headings may write otherwise."""
    columns: dict[str, np.ndarray] = {}
    for heading, values in arrays.items():
        name = _column(heading)
        if name in columns:
            raise InputError(f"two columns are {name!r}, and either could be meant")
        columns[name] = values
    return columns


def _column(heading: str) -> str:
    """Name of a column by its heading: `Natural frequency` is `natural_frequency`."""
    first, _, label = heading.partition(" ")
    if first.lower() in (SHAPE.strip(), f"shape{DEVIATION}") and label:
        return f"{first.lower()} {label}"
    name, _ = text.plain_name(heading)
    quantity = name.removesuffix(DEVIATION)
    return _IN_SHORT.get(quantity, quantity) + name.removeprefix(quantity)


_IN_SHORT = {"frequency": FREQUENCY, "damping": DAMPING}


def _check_units(headings: Iterable[str], units: Mapping[str, str]) -> None:
    for heading in headings:
        name, unit = _column(heading), units.get(heading) or text.plain_name(heading)[1]
        needed = {FREQUENCY: "Hz", DAMPING: "1"}.get(name.removesuffix(DEVIATION))
        if needed is not None and unit is not None and plain(unit) != needed:
            raise InputError(
                f"the column {name} is in [{unit}]; [{needed}] is needed, since nothing is "
                "converted here. Convert it, percentages by a division by 100."
            )


def _add_deviations(known: Arguments, relative: Mapping[str, float | None]) -> None:
    """Add the deviations that a file does not state, from relative ones."""
    shape = known["shape"]
    sizes = {
        "frequency_deviation": (FREQUENCY, known[FREQUENCY]),
        "damping_deviation": (DAMPING, known[DAMPING]),
        "shape_deviation": ("shape", shape),
    }
    for argument, (name, values) in sizes.items():
        if values is None or known[name + DEVIATION] is not None or "covariance" in known:
            continue
        if argument not in relative:
            raise InputError(
                f"it states no standard deviation of {name.replace('_', ' ')}; one is needed, "
                "since it says how far a model may be from what was measured: for 1 %, "
                f"read(path, {argument}=0.01), or a file modes.toml with [modal_parameters], "
                f'file = "..." and {argument} = 0.01 in the place of this one.'
            )
        share = relative[argument]
        size = np.abs(values)
        if name == "shape":
            size = np.broadcast_to(np.nanmax(size, axis=0), size.shape)
        known[name + DEVIATION] = share * size


def _modal_parameters(known: Arguments) -> ModalParameters:
    frequency, shape = known.pop(FREQUENCY), known.pop("shape")
    check_kind("natural_frequency", frequency, np.ndarray, "numbers are needed", "one row a mode")
    if shape is not None and np.iscomplexobj(shape):
        return ModalParameters.of_complex_shapes(shape, frequency, **known)
    return ModalParameters(frequency, shape=shape, **known)
