"""Laws line by line in files: CSV, and dataset 58 of universal files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.files import write_atomically
from ..laws.tabulated import COMPLIANCES, Tabulated
from ._contents import UNIVERSAL, content_of
from ._frf_units import FORCE, FREQUENCY, LENGTH, plain
from ._gate import existing, path_of, reading
from .arrays.text import plain_name
from .uff._datasets import FUNCTION, Dataset, MeasurementFileError, load
from .uff._units import FileUnits, check_abscissa, file_units
from .uff._write import _function, _FunctionType, _record, _units

if TYPE_CHECKING:
    import pandas as pd

FRF = 4
"""Type of function of a frequency response."""

FORCES, MOTION = (13, 9), 8
"""Data types of an excitation or reaction force, and of a displacement."""

UNITS = ("N/m", "N m/rad", *COMPLIANCES)
"""Units of laws."""

Known = TypeVar("Known", float, str)

UNSTATED = ("", "NONE")


class _Side(NamedTuple):
    """Numerator or denominator of a law: data type, name of the axis and unit."""

    data_type: int
    axis: str
    unit: str


FORCE_SIDE, MOMENT_SIDE = _Side(FORCES[0], "Force", "N"), _Side(FORCES[0], "Moment", "N m")
LENGTH_SIDE, ANGLE_SIDE = _Side(MOTION, "Displacement", "m"), _Side(MOTION, "Rotation", "rad")

SIDES = {
    "N/m": (FORCE_SIDE, LENGTH_SIDE),
    "N m/rad": (MOMENT_SIDE, ANGLE_SIDE),
    "m/N": (LENGTH_SIDE, FORCE_SIDE),
    "rad/(N m)": (ANGLE_SIDE, MOMENT_SIDE),
}
"""Numerator and denominator by the unit of a table."""

FACTORS = {MOTION: LENGTH | {"rad": 1.0}} | dict.fromkeys(FORCES, FORCE | {"Nm": 1.0, "N*m": 1.0})
"""Factors of units to SI by the data type."""


@arguments_checked
def write_law(path: str | Path, table: "pd.DataFrame") -> None:
    """Write a law as measured as a universal file, one frequency response (dataset 58b).

    Its header states force per displacement, moment per rotation, or the inverse of a compliance.

    Parameters
    ----------
    path
        The file; an existing one is replaced.
    table
        What `Reach.law_as_measured` gives; its deviations are left out.

    Raises
    ------
    InputError
        If the table has no known unit.

    Examples
    --------
    >>> import pandas as pd
    >>> table = pd.DataFrame({"frequency": [5.0, 9.0], "real": [1e4, 2e4], "imaginary": 50.0})
    >>> bp.io.laws.write_law("law.unv", table.assign(unit="N/m"))
    >>> bp.io.laws.read_law("law.unv").stiffness
    ((10000+50j), (20000+50j))
    """
    unit = str(table["unit"].iloc[0]) if "unit" in table else ""
    if unit not in SIDES:
        raise InputError(
            f"A table with the unit {unit!r} was given; one of {', '.join(SIDES)} is needed, since "
            "the header of the file states it: table.assign(unit='N/m')."
        )
    content = _units() + _dataset(table, *SIDES[unit])
    write_atomically(path, lambda temporary: temporary.write_bytes(content))


def _dataset(table: "pd.DataFrame", above: _Side, below: _Side) -> bytes:
    values = table["real"].to_numpy(float) + 1j * table["imaginary"].to_numpy(float)
    records = [_record(side.data_type, side.axis, side.unit) for side in (above, below)]
    lines = ("Law as measured at a port", "NONE", "NONE", "NONE", "NONE")
    port = f"{'NONE':>10}{1:10d}{0:4d}"
    pair = f"{FRF:5d}{1:10d}{0:5d}{0:10d} {port} {port}"
    header = [*(f"{line:<80}" for line in lines), pair]
    kind = _FunctionType("Law", FRF, *records)
    return _function(header, kind, table["frequency"].to_numpy(float), values, binary=True)


@arguments_checked
def read_law(path: str | Path) -> Tabulated:
    """Read a law that is known line by line: as measured, or of a catalogue.

    Parameters
    ----------
    path
        A CSV file with the columns `frequency` [Hz], `real` and `imaginary` [N/m] (of a rotation
        [N m/rad]), and `unit` where they are another quantity, which headings may state as well
        (`Frequency [Hz]`); or a universal file with one
        frequency response of force over displacement, or of displacement over force (dataset 58).

    Returns
    -------
    Tabulated
        The dynamic stiffness, of a compliance its inverse.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If it holds no law.

    Examples
    --------
    >>> import pandas as pd
    >>> table = pd.DataFrame({"frequency": [5.0, 9.0], "real": [1e4, 2e4], "imaginary": 50.0})
    >>> table.to_csv("law.csv", index=False)
    >>> pad = bp.io.laws.read_law("law.csv")
    >>> bp.effects.attached(0.4, dist.LogUniform(0.5, 2.0) * pad).kind
    'attached: table'
    """
    file = existing(path_of(path), "a law in a CSV or universal file")
    with reading(file, "a law", "Export frequency [Hz], real and imaginary part again."):
        is_universal = content_of(file) == UNIVERSAL
        return Tabulated.from_table(_of_universal(file) if is_universal else _of_text(file))


def _of_text(path: Path) -> "pd.DataFrame":
    """Table of a CSV file, the units in its headings taken out of them."""
    import pandas as pd

    table = pd.read_csv(path, skipinitialspace=True)
    headings = [plain_name(str(name)) for name in table]
    table.columns = pd.Index([name for name, _ in headings])
    units = {name: plain(unit) for name, unit in headings if unit}
    if "frequency" in units:
        table["frequency"] *= _known("frequency", units["frequency"], FREQUENCY)
    parts = {units[part] for part in ("real", "imaginary") if part in units}
    if parts:
        stated = " and in ".join(sorted(parts))
        table["unit"] = _known("law", stated, {plain(unit): unit for unit in UNITS})
    return table


def _known(what: str, unit: str, known: Mapping[str, Known]) -> Known:
    """What a unit in a heading stands for; refuses one that is not known."""
    if unit not in known:
        raise InputError(
            f"its headings say that the {what} is in {unit}; one of {', '.join(known)} is needed, "
            "since a guessed unit would be a silent factor. Convert it."
        )
    return known[unit]


def _of_universal(path: Path) -> "pd.DataFrame":
    import pandas as pd

    datasets = load(path)
    functions = [each for each in datasets if each.number == FUNCTION]
    laws = [each for each in functions if each.fields["func_type"] == FRF]
    if len(laws) != 1 or not np.iscomplexobj(laws[0].fields["data"]):
        raise MeasurementFileError(
            f"{path} holds {len(laws)} frequency responses; one of complex numbers is needed "
            "(dataset 58, function type 4), since a law is one: bp.io.read_measurement(path) "
            "reads those of a structure."
        )
    (law,) = laws
    check_abscissa(law)
    values = law.fields["data"] * _factor(law, file_units(datasets))
    parts = {"real": values.real, "imaginary": values.imag}
    unit = "m/N" if law.fields["ordinate_spec_data_type"] == MOTION else "N/m"
    return pd.DataFrame({"frequency": np.asarray(law.fields["x"], float)} | parts | {"unit": unit})


def _factor(law: Dataset, units: FileUnits) -> float:
    """Factor of the values to SI."""
    types = law.fields["ordinate_spec_data_type"], law.fields["orddenom_spec_data_type"]
    if {*types} not in [{force, MOTION} for force in FORCES]:
        raise MeasurementFileError(
            f"{law.place} is data type {types[0]} over data type {types[1]}; a force (13 or 9) "
            "over a displacement (8) is needed, or the inverse, since a law is a dynamic stiffness "
            "or a compliance. Integrate motions, and set both types when exporting."
        )
    above, below = (
        _factor_of_side(law, side, kind, units)
        for side, kind in zip(("ordinate", "orddenom"), types, strict=True)
    )
    return above / below


def _factor_of_side(law: Dataset, side: str, data_type: int, units: FileUnits) -> float:
    label = law.fields.get(f"{side}_axis_units_lab", "").strip()
    if label in UNSTATED:
        return units.length if data_type == MOTION else units.force
    known = FACTORS[data_type]
    if plain(label) not in known:
        raise MeasurementFileError(
            f"{law.place} has the unit label {label!r}; one of {', '.join(known)} is needed, since "
            "a guessed unit would be a silent factor. Export in SI."
        )
    return known[plain(label)]
