"""Units of FRFs, lengths, forces, frequencies and sensitivities in files, as factors to SI."""

import math
import re
from typing import NamedTuple

from ..experiment.quantities import QUANTITIES, in_ascii

LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254, "ft": 0.3048}
FORCE = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": 9.80665, "lbf": 4.4482216152605}
STANDARD_GRAVITY = {"g": 9.80665, "gn": 9.80665}  # a gram is no acceleration
FREQUENCY = {"Hz": 1.0, "kHz": 1e3, "rad/s": 1 / math.tau, "1/min": 1 / 60, "rpm": 1 / 60}
ANGLE = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
VOLTAGES = "voltage over voltage"
"""Quantity of FRFs that sensitivities turn into another one."""

VOLTAGE = {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6}
_WORDS = {
    "newton": "N",
    "kilonewton": "kN",
    "pound": "lbf",
    "lb": "lbf",
    "volt": "V",
    "millivolt": "mV",
    "microvolt": "uV",
    "meter": "m",
    "metre": "m",
    "centimeter": "cm",
    "centimetre": "cm",
    "millimeter": "mm",
    "millimetre": "mm",
    "micrometer": "um",
    "micrometre": "um",
    "inch": "in",
    "inche": "in",
    "foot": "ft",
    "feet": "ft",
    "second": "s",
    "sec": "s",
    "g'": "g",
    "gs": "g",
    "hertz": "Hz",
    "hz": "Hz",
    "khz": "kHz",
    "radian": "rad",
    "degree": "deg",
    "per": "/",
    "squared": "^2",
}
"""Units as words, without the s of a plural, as LabVIEW and others write them."""

_WORD = re.compile(r"[A-Za-z']+")
_RATES = {in_ascii(quantity.rate): quantity.frf for quantity in QUANTITIES}


class Scale(NamedTuple):
    """Quantity in a unit, that of FRFs for motions, and the factor of that unit to SI."""

    quantity: str
    factor: float


def plain(label: str) -> str:
    """Spell a unit in one way: letters for words, no blanks or parentheses, `s^2`."""
    text = re.sub(r"[ ()]", "", _WORD.sub(_letters, label)).replace("**", "^").replace("²", "^2")
    return re.sub(r"/s2(?=/|$)", "/s^2", text)


def _letters(word: re.Match[str]) -> str:
    """Letters of a unit that is written as a word; any other text as it is."""
    known = word[0].lower()
    return _WORDS.get(known) or _WORDS.get(known.removesuffix("s")) or word[0]


def frf_unit(label: str) -> Scale | None:
    """Return what a unit of FRFs means, such as `(m/s^2)/N`, `g/lbf` or `V/V`; None if unknown."""
    numerator, _, denominator = plain(label).rpartition("/")
    if numerator in VOLTAGE and denominator in VOLTAGE:
        return Scale(VOLTAGES, VOLTAGE[numerator] / VOLTAGE[denominator])
    motion = _motion(numerator)
    if motion is None or denominator not in FORCE:
        return None
    return Scale(motion.quantity, motion.factor / FORCE[denominator])


def sensitivity_unit(label: str) -> Scale | None:
    """Return what is sensed, or `force`, and a unit such as `mV/N` [V per SI]; None if unknown."""
    voltage, _, sensed = plain(label).partition("/")
    if voltage not in VOLTAGE:
        return None
    if sensed in FORCE:
        return Scale("force", VOLTAGE[voltage] / FORCE[sensed])
    motion = _motion(sensed)
    return motion and Scale(motion.quantity, VOLTAGE[voltage] / motion.factor)


def _motion(unit: str) -> Scale | None:
    """Quantity and factor of a unit of motion, such as `m/s^2`."""
    if unit in STANDARD_GRAVITY:
        return Scale("accelerance", STANDARD_GRAVITY[unit])
    length, slash, rate = unit.partition("/")
    if length not in LENGTH or slash + rate not in _RATES:
        return None
    return Scale(_RATES[slash + rate], LENGTH[length])


def is_unit(label: str) -> bool:
    """Whether a text is a unit that is known: of FRFs, lines, levels, angles, records or none."""
    spelt = plain(label)
    known = {*FREQUENCY, *ANGLE, *VOLTAGE, *FORCE, *LENGTH, *STANDARD_GRAVITY, "s", "-", "1", "dB"}
    return spelt in known or frf_unit(spelt) is not None or _motion(spelt) is not None
