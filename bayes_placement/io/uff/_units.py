"""Quantities of FRFs and factors to SI, from unit labels, data types and dataset 164."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..._shared.arguments import check_positive
from ..._shared.errors import InputError, warn
from ...experiment import quantities
from .._frf_units import FORCE, LENGTH, STANDARD_GRAVITY, plain
from .._gate import FileWarning
from ._datasets import UNITS, Dataset, MeasurementFileError

QUANTITY = {quantity.data_type: quantity for quantity in quantities.QUANTITIES}
FORCE_TYPE, FREQUENCY_TYPE = 13, 18
UNSTATED = {"", "NONE"}


class FileUnits(NamedTuple):
    """Units of a file as dataset 164 states them: one unit of length [m] and of force [N]."""

    length: float = 1.0
    force: float = 1.0
    stated: bool = False


def file_units(datasets: list[Dataset]) -> FileUnits:
    """Read dataset 164, of which all must agree; without it the file is in SI."""
    stated = {_factors(dataset): dataset for dataset in datasets if dataset.number == UNITS}
    if len(stated) > 1:
        *_, place = (dataset.place for dataset in stated.values())
        raise MeasurementFileError(
            f"{place} states other units than an earlier dataset 164; one system of units is "
            "needed, since nodes and functions share it. Export them in one system."
        )
    return next(iter(stated), FileUnits())


def of_nodes(
    path: Path,
    units: FileUnits,
    positions: ArrayLike,
    *,
    length_unit: float | int | None = None,
    mass_unit: float | int | None = None,
) -> FileUnits:
    """Units of nodes and modes, by the file or else as stated; a warning where nothing says them.

    Stated is what one unit of the file is in m and in kg.
    """
    stated = {"length_unit": length_unit, "mass_unit": mass_unit}
    given = {name: value for name, value in stated.items() if value is not None}
    for name, value in given.items():
        check_positive(name, value, f"{name}=1e-3")
        if units.stated:
            raise InputError(
                f"{name}={value:g} was given, and {path} states its units (dataset 164: "
                f"{units.length:g} m, {units.force:g} N); one of them is needed, since they could "
                f"contradict each other. Leave {name} out."
            )
    places = np.asarray(positions, float).reshape(-1, 3)
    if not units.stated and length_unit is None and places.any():
        size = np.linalg.norm(np.ptp(places, axis=0)) or np.linalg.norm(places[0])
        warn(
            f"{path} states no units (no dataset 164), so that coordinates are taken for metres: "
            f"its nodes extend over {size:.4g} m. State what they are: length_unit=1.0 for metres, "
            "length_unit=1e-3 for mm.",
            FileWarning,
        )
    if units.stated:
        return units
    length, mass = (float(given.get(name, 1.0)) for name in stated)
    return FileUnits(length, mass * length)


def _factors(dataset: Dataset) -> FileUnits:
    length, force = dataset.fields["length"], dataset.fields["force"]
    if not (0 < length < np.inf and 0 < force < np.inf):
        raise MeasurementFileError(
            f"{dataset.place} has the factors {length:g} for length and {force:g} for force; "
            "positive ones are needed, since values are divided by them. Export the file in SI, "
            "where both are 1."
        )
    return FileUnits(1 / length, 1 / force, stated=True)


def quantity_of(dataset: Dataset) -> str:
    """Name the FRF by its ordinate data types."""
    fields = dataset.fields
    motion, force = fields["ordinate_spec_data_type"], fields["orddenom_spec_data_type"]
    if motion not in QUANTITY or force != FORCE_TYPE:
        raise MeasurementFileError(
            f"{dataset.place} is an FRF of data type {motion} per data type {force}; displacement "
            "(8), velocity (11) or acceleration (12) per excitation force (13) is needed, since "
            "its unit and meaning follow from these. Set both types when exporting."
        )
    _check_exponents(dataset, "ordinate", (1, 0, 0))
    _check_exponents(dataset, "orddenom", (0, 1, 0))
    return QUANTITY[motion].frf


def _check_exponents(dataset: Dataset, side: str, natural: tuple[int, int, int]) -> None:
    """Refuse unit exponents that contradict the data type; the format allows zeros."""
    dimensions = ("len", "force", "temp")
    exponents = tuple(dataset.fields[f"{side}_{dimension}_unit_exp"] for dimension in dimensions)
    if exponents not in ((0, 0, 0), natural):
        record = 9 if side == "ordinate" else 10
        raise MeasurementFileError(
            f"{dataset.place} has the unit exponents {exponents} (length, force, temperature) in "
            f"record {record}; {natural} or zeros are needed, since its data type implies them. "
            "Correct the exponents, or give the values in SI to Measurement.from_arrays."
        )


def check_abscissa(dataset: Dataset) -> None:
    """Refuse an abscissa that is not frequency [Hz]."""
    data_type = dataset.fields["abscissa_spec_data_type"]
    label = _label(dataset, "abscissa")
    if data_type != FREQUENCY_TYPE or label not in {*UNSTATED, "Hz", "HZ", "hz"}:
        raise MeasurementFileError(
            f"{dataset.place} has an abscissa of data type {data_type} with unit {label!r}; "
            "frequency (18) in Hz is needed, since an FRF is compared line by line. Export it over "
            "Hz."
        )


def scale(dataset: Dataset, units: FileUnits) -> float:
    """Factor that turns the values of an FRF into SI."""
    quantity = quantities.quantity_of(quantity_of(dataset))
    rate = quantities.in_ascii(quantity.rate)
    motions = {f"{unit}{rate}": factor for unit, factor in LENGTH.items()}
    if quantity.frf == "accelerance":
        motions |= STANDARD_GRAVITY
    motion, shared_force = _split(_label(dataset, "ordinate"))
    force = _label(dataset, "orddenom")
    numerator = _factor(dataset, motion, motions, units.length if units.stated else None)
    stated_force = units.force if units.stated else None
    if shared_force and force not in UNSTATED:
        stated_force = _factor(dataset, shared_force, FORCE, stated_force)
    denominator = _factor(
        dataset, shared_force if force in UNSTATED else force, FORCE, stated_force
    )
    return numerator / denominator


def _label(dataset: Dataset, side: str) -> str:
    return dataset.fields.get(f"{side}_axis_units_lab", "").strip()


def _split(label: str) -> tuple[str, str]:
    """Split a label such as (m/s2)/N, which some writers put into the numerator, at the force."""
    spelt = plain(label)
    motion, _, force = spelt.rpartition("/")
    return (motion, force) if motion and force in FORCE else (spelt, "")


def _factor(dataset: Dataset, label: str, known: dict[str, float], stated: float | None) -> float:
    """Factor of a unit label to SI, which must agree with what the file states elsewhere."""
    if label in UNSTATED:
        return 1.0 if stated is None else stated
    if label not in known:
        raise MeasurementFileError(
            f"{dataset.place} has the unit label {label!r}, which is not known for its data type; "
            f"one of {', '.join(known)} is needed, since a guessed unit would be a silent factor. "
            "Export in SI, or give the values in SI to Measurement.from_arrays."
        )
    if stated is not None and not np.isclose(known[label], stated, rtol=1e-5, atol=0.0):
        raise MeasurementFileError(
            f"{dataset.place} has the unit label {label!r}, a factor of {known[label]:g} to SI, "
            f"but the file states a factor of {stated:g} elsewhere (dataset 164 or another label); "
            "they must agree, since either could be meant. Correct the one that is wrong."
        )
    return known[label]


def stated_for(quantity: str) -> tuple[int, str]:
    """Ordinate data type and unit label of an FRF in SI, for the writer."""
    stated = quantities.quantity_of(quantity)
    return stated.data_type, f"m{quantities.in_ascii(stated.rate)}"
