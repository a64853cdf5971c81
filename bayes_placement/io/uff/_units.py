"""_units: in, unit labels and dataset 164; out, quantities and factors to SI.

Not known here: files, nodes, channels.
"""

import re
from typing import NamedTuple

import numpy as np

from ._blocks import UNITS, Block, MeasurementFileError

QUANTITY = {8: "receptance", 11: "mobility", 12: "accelerance"}
FORCE_TYPE, FREQUENCY_TYPE = 13, 18
_UNSTATED = {"", "NONE"}

_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254, "ft": 0.3048}
_FORCE = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": 9.80665, "lbf": 4.4482216152605}
_RATE = {"receptance": "", "mobility": "/s", "accelerance": "/s^2"}
_STANDARD_GRAVITY = {"g": 9.80665, "gn": 9.80665}  # a gram is no acceleration


class FileUnits(NamedTuple):
    """Metres and newtons in one unit of the file, as dataset 164 states them."""

    length: float = 1.0
    force: float = 1.0
    stated: bool = False


def file_units(blocks: list[Block]) -> FileUnits:
    """Read dataset 164; without one the file is taken to be in SI.

    Raises
    ------
    MeasurementFileError
        If a factor is not positive, or two of these datasets contradict each other.
    """
    found = {_factors(block): block for block in blocks if block.dataset == UNITS}
    if len(found) > 1:
        *_, place = (block.place for block in found.values())
        raise MeasurementFileError(
            f"{place} states other units than an earlier dataset 164; one system of units is "
            "needed, since nodes and functions share it. Export them in one system."
        )
    return next(iter(found), FileUnits())


def _factors(block: Block) -> FileUnits:
    length, force = block.fields["length"], block.fields["force"]
    if not (0 < length < np.inf and 0 < force < np.inf):
        raise MeasurementFileError(
            f"{block.place} has the factors {length:g} for length and {force:g} for force; "
            "positive ones are needed, since values are divided by them. Export the file in SI, "
            "where both are 1."
        )
    return FileUnits(1 / length, 1 / force, stated=True)


def quantity_of(block: Block) -> str:
    """Name the FRF by its ordinate data types.

    Raises
    ------
    MeasurementFileError
        If it is not motion per force over frequency.
    """
    fields = block.fields
    motion, force = fields["ordinate_spec_data_type"], fields["orddenom_spec_data_type"]
    if motion not in QUANTITY or force != FORCE_TYPE:
        raise MeasurementFileError(
            f"{block.place} is an FRF of data type {motion} per data type {force}; displacement "
            "(8), velocity (11) or acceleration (12) per excitation force (13) is needed, since "
            "its unit and meaning follow from these. Set both types when exporting."
        )
    _check_exponents(block, "ordinate", (1, 0, 0))
    _check_exponents(block, "orddenom", (0, 1, 0))
    return QUANTITY[motion]


def _check_exponents(block: Block, side: str, natural: tuple[int, int, int]) -> None:
    """Refuse exponents that contradict the data type; the format lets them be left at zero."""
    kinds = ("len", "force", "temp")
    given = tuple(block.fields[f"{side}_{kind}_unit_exp"] for kind in kinds)
    if given not in ((0, 0, 0), natural):
        record = 9 if side == "ordinate" else 10
        raise MeasurementFileError(
            f"{block.place} has the unit exponents {given} (length, force, temperature) in record "
            f"{record}; {natural} or zeros are needed, since its data type already says so much. "
            "Correct the exponents, or give the values in SI to Measurement.from_arrays."
        )


def check_abscissa(block: Block) -> None:
    """Refuse an abscissa that is not frequency [Hz].

    Raises
    ------
    MeasurementFileError
        If its type or its unit is another one.
    """
    kind = block.fields["abscissa_spec_data_type"]
    label = _label(block, "abscissa")
    if kind != FREQUENCY_TYPE or label not in {*_UNSTATED, "Hz", "HZ", "hz"}:
        raise MeasurementFileError(
            f"{block.place} has an abscissa of data type {kind} with unit {label!r}; frequency "
            "(18) in Hz is needed, since an FRF is compared line by line. Export it over Hz."
        )


def scale(block: Block, units: FileUnits) -> float:
    """Factor that turns the values of an FRF into SI.

    Raises
    ------
    MeasurementFileError
        If a unit label is unknown or contradicts another label or dataset 164.
    """
    quantity = quantity_of(block)
    motions = {f"{unit}{_RATE[quantity]}": factor for unit, factor in _LENGTH.items()}
    if quantity == "accelerance":
        motions |= _STANDARD_GRAVITY
    motion, shared_force = _split(_label(block, "ordinate"))
    force = _label(block, "orddenom")
    numerator = _factor(block, motion, motions, units.length if units.stated else None)
    stated_force = units.force if units.stated else None
    if shared_force and force not in _UNSTATED:
        stated_force = _factor(block, shared_force, _FORCE, stated_force)
    denominator = _factor(
        block, shared_force if force in _UNSTATED else force, _FORCE, stated_force
    )
    return numerator / denominator


def _label(block: Block, side: str) -> str:
    return block.fields.get(f"{side}_axis_units_lab", "").strip()


def _split(label: str) -> tuple[str, str]:
    """Split a label such as (m/s2)/N, which some writers put into the numerator, at the force."""
    plain = re.sub(r"[ ()]", "", label).replace("**", "^").replace("²", "^2").replace("sec", "s")
    plain = re.sub(r"/s2(?=/|$)", "/s^2", plain)
    motion, _, force = plain.rpartition("/")
    return (motion, force) if motion and force in _FORCE else (plain, "")


def _factor(block: Block, label: str, known: dict[str, float], stated: float | None) -> float:
    """Factor of one label, which must agree with what the file states elsewhere."""
    if label in _UNSTATED:
        return 1.0 if stated is None else stated
    if label not in known:
        raise MeasurementFileError(
            f"{block.place} has the unit label {label!r}, which is not known for its data type; "
            f"one of {', '.join(known)} is needed, since a guessed unit would be a silent factor. "
            "Export in SI, or give the values in SI to Measurement.from_arrays."
        )
    if stated is not None and not np.isclose(known[label], stated, rtol=1e-5, atol=0.0):
        raise MeasurementFileError(
            f"{block.place} has the unit label {label!r}, a factor of {known[label]:g} to SI, but "
            f"the file states a factor of {stated:g} elsewhere (dataset 164 or another label); "
            "they must agree, since either could be meant. Correct the one that is wrong."
        )
    return known[label]


def stated_for(quantity: str) -> tuple[int, str]:
    """Ordinate data type and unit label of an FRF in SI, for writing."""
    kind = next(number for number, name in QUANTITY.items() if name == quantity)
    return kind, f"m{_RATE[quantity]}"
