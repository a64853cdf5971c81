"""Recordings of several channels in SI with their labels; which of them were overloaded."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..._shared.arguments import check_annotated, check_kind
from ..._shared.errors import InputError
from ..._shared.reprs import with_short_repr
from ...experiment.quantities import motion_name
from .._frf_units import FORCE, VOLTAGE, Scale, frf_unit, plain, sensitivity_unit
from .records import Records, Samples, positive, same_rate

FORCE_QUANTITY = "force"

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_AMOUNT = re.compile(rf"\s*(?P<number>{_NUMBER})?\s*(?P<unit>\S.*?)\s*")


@with_short_repr
@dataclass(frozen=True)
class Signal:
    """What a channel of a file is: its name there, and its unit.

    Parameters
    ----------
    source
        Name in the file; with the number of the column, from 1, where that holds several:
        `("acc", 2)`.
    unit
        What 1 in the file is, such as `N`, `m/s^2`, `g` or `V`; with a number where it is not one
        unit: `10 V` for a WAV file of a range of 10 V, since such a file holds shares of it.
    sensitivity
        Of the transducer, where the file holds volts: `2.25 mV/N`, `100 mV/g`.

    Raises
    ------
    InputError
        If the source is no name, a unit is not known, volts have no sensitivity, or another unit
        has one.

    Examples
    --------
    >>> bp.time_records.Signal("Channel 2", "V", sensitivity="10 mV/(m/s^2)").scale()
    Scale(quantity='acceleration', factor=100.0)
    """

    source: str | tuple[str, int]
    unit: str
    sensitivity: str | None = None

    def __post_init__(self) -> None:
        """Check the name and the units."""
        check_annotated("source", self.source, str | tuple[str, int])
        self.scale()

    def scale(self) -> Scale:
        """Return what is sensed, and the factor of the file's numbers to SI."""
        number, unit = _amount("unit", self.unit)
        if plain(unit) in VOLTAGE:
            sensed = self._sensed()
            return Scale(sensed.quantity, number * VOLTAGE[plain(unit)] * sensed.factor)
        if self.sensitivity is not None:
            raise InputError(
                f"Signal({self.source!r}, unit={self.unit!r}, sensitivity={self.sensitivity!r}) "
                "was given; a sensitivity is needed where the file holds volts only, since it "
                "would count twice: unit='V', or no sensitivity."
            )
        if plain(unit) in FORCE:
            return Scale(FORCE_QUANTITY, number * FORCE[plain(unit)])
        motion = frf_unit(f"{plain(unit)}/N")
        if motion is None:
            raise _unknown("unit", self.unit, "N, m/s^2, g, m/s, mm or V")
        return Scale(motion_name(motion.quantity), number * motion.factor)

    def _sensed(self) -> Scale:
        if self.sensitivity is None:
            raise InputError(
                f"Signal({self.source!r}, unit={self.unit!r}) was given without sensitivity; one "
                "is needed for volts, since nothing else says what a volt is: sensitivity="
                "'100 mV/g'."
            )
        number, unit = _amount("sensitivity", self.sensitivity)
        sensed = sensitivity_unit(unit)
        if sensed is None:
            raise _unknown("sensitivity", self.sensitivity, "2.25 mV/N, 100 mV/g, 10 mV/(m/s^2)")
        is_force = sensed.quantity == FORCE_QUANTITY
        quantity = FORCE_QUANTITY if is_force else motion_name(sensed.quantity)
        return Scale(quantity, 1 / (number * sensed.factor))


@with_short_repr
@dataclass(frozen=True, eq=False)
class Recording:
    """Channels that were sampled together.

    Parameters
    ----------
    rate
        Sampling rate [Hz].
    samples
        Samples in SI by the label of the sensor or actuator.
    quantity
        `force`, `displacement`, `velocity` or `acceleration` of each channel.

    Raises
    ------
    InputError
        If the rate is not positive, or samples and quantities are not of the same channels.

    Examples
    --------
    >>> force = np.random.default_rng(0).standard_normal(4096)
    >>> quantity = {"a1": "force", "s1": "acceleration"}
    >>> recording = bp.time_records.Recording(512.0, {"a1": force, "s1": 2 * force}, quantity)
    >>> recording.rate, recording.samples["s1"].size
    (512.0, 4096)
    """

    rate: float
    samples: Mapping[str, Samples]
    quantity: Mapping[str, str]

    def __post_init__(self) -> None:
        """Check rate and labels; the samples are checked where FRFs are estimated."""
        positive("rate", self.rate, "rate=4096.0")
        needed = "the samples of each channel by its label are needed, since an FRF is of two"
        check_kind("samples", self.samples, Mapping, needed, "samples={'a1': force, 's1': motion}")
        check_annotated("quantity", self.quantity, Mapping[str, str])
        if not self.samples or {*self.samples} != {*self.quantity}:
            sampled, stated = (", ".join(map(str, by)) for by in (self.samples, self.quantity))
            raise InputError(
                f"Recording has samples of {sampled or 'no channel'} and quantities of "
                f"{stated or 'none'}; a quantity for each channel with samples is needed, since an "
                "FRF is motion per force: quantity={'a1': 'force', 's1': 'acceleration'}."
            )

    def __getitem__(self, label: str) -> Samples:
        """Samples of a channel in SI."""
        if label not in self.samples:
            raise InputError(
                f"The channel {label!r} was requested; the recording has "
                f"{', '.join(self.samples)}: name one of them."
            )
        return self.samples[label]

    def __str__(self) -> str:
        """Say what was recorded."""
        length = next(iter(self.samples.values())).size
        channels = ", ".join(f"{label} ({self.quantity[label]})" for label in self.samples)
        return f"Recording of {length / self.rate:.4g} s at {self.rate:g} Hz: {channels}."


class Joined(NamedTuple):
    """Records of several recordings by channel."""

    rate: float
    force: list[Samples]
    response: dict[str, list[Samples]]
    quantity: str


def is_known(unit: str) -> bool:
    """Whether a unit that a file states is one that a signal may have."""
    spelt = plain(unit)
    return spelt in {**VOLTAGE, **FORCE} or frf_unit(f"{spelt}/N") is not None


def joined(recordings: Recording | Sequence[Recording], actuator: str) -> Joined:
    """Lay out recordings as records of a force and of responses."""
    needed = "one recording or several are needed, since each holds repeats"
    instead = "bp.time_records.read(path, channels)"
    check_kind("recordings", recordings, (Recording, Iterable), needed, instead)
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    for recording in runs:
        check_kind("recordings", recording, Recording, needed, instead)
    if not runs:
        raise InputError(f"No recording was given; {needed}: {instead}.")
    first = runs[0]
    for recording in runs[1:]:
        _check_alike(first, recording)
    force = first.quantity.get(actuator)
    if force != FORCE_QUANTITY:
        raise InputError(
            f"{actuator!r} was named as the force, and it "
            f"{'is no channel' if force is None else f'records {force}'}; a channel in newtons is "
            f"needed, since an FRF is motion per force. The channels are: {first}"
        )
    sensors = [label for label in first.samples if label != actuator]
    quantities = {first.quantity[label] for label in sensors}
    if len(quantities) != 1 or FORCE_QUANTITY in quantities:
        raise InputError(
            f"The responses record {' and '.join(sorted(quantities)) or 'nothing'}; one quantity "
            "of motion is needed, since a measurement has one. Estimate each by itself, and join "
            "them: time_records.merged([first.converted('accelerance'), ...])."
        )
    return Joined(
        first.rate,
        [recording[actuator] for recording in runs],
        {label: [recording[label] for recording in runs] for label in sensors},
        quantities.pop(),
    )


def _check_alike(first: Recording, other: Recording) -> None:
    if dict(first.quantity) != dict(other.quantity) or not same_rate(first.rate, other.rate):
        raise InputError(
            "The recordings differ in channels or sampling rate; repeats of one test are needed, "
            f"since they are averaged. First: {first} Another: {other}"
        )


def _amount(what: str, text: Any) -> tuple[float, str]:
    """Number and unit of a text such as `2.25 mV/N`; 1 without a number."""
    check_kind(what, text, str, "a unit as text is needed, since none is guessed", f"{what}='N'")
    match = _AMOUNT.fullmatch(text)
    number = float(match["number"] or 1) if match else np.nan
    if match is None or not (np.isfinite(number) and number != 0):
        raise _unknown(what, text, "10 V" if what == "unit" else "100 mV/g")
    return number, match["unit"]


def _unknown(what: str, text: str, examples: str) -> InputError:
    return InputError(
        f"{what}={text!r} was given; a known one is needed, since a guessed unit would be a silent "
        f"factor, such as {examples}."
    )


PLATEAU = 3
"""Equal samples in a row at a greatest value from which on a record is clipped."""

STEPS = 2.5
"""Least step onto a plateau, in the smallest step of the record: a coarse record of a smooth peak
has plateaus too, with steps of one digit next to them."""

PILE, PILED = 5, 4.0
"""Samples at the greatest value, and their ratio to those at the next one, from which on it is a
limit: at the peaks of a sine there are 2.4 times as many in the highest digit as in the next one,
and a record that repeats itself has each of its values as often as the greatest."""

ROUNDING = 1e-9
"""Distance of samples that are one value, as a share of the greatest: a period that was computed
without noise comes back rounded in another way."""

FULL = 0.995
"""Share of its range from which on a channel is overloaded."""


def overload(records: Records, record: int, part: slice = slice(None)) -> str | None:
    """Say which channel of a record is overloaded or dead, and when; None where none is."""
    start = part.start or 0
    for label, samples in records.channels(record).items():
        words = _overload(samples[part], records.ranges.get(label), records.rate, start)
        if words is not None:
            return f"{label} {words}"
    return None


def _overload(samples: Samples, limit: float | None, rate: float, start: int) -> str | None:
    size = np.abs(samples)
    greatest = float(size.max())
    if np.ptp(samples) == 0:
        return f"stays at {samples[0]:.4g} throughout, as a channel that is not connected"
    if limit is not None and greatest >= FULL * limit:
        when = (start + int(np.argmax(size >= FULL * limit))) / rate
        return f"reaches its range of {limit:.4g} at {when:.4g} s: it is overloaded"
    digit = float(np.min(np.diff(np.unique(samples))))
    plateaus = [_plateau(samples, sign * samples >= greatest, digit) for sign in (1, -1)]
    first = min((plateau for plateau in plateaus if plateau is not None), default=None)
    if first is not None:
        return f"is clipped: it stays at its greatest value from {(start + first) / rate:.4g} s on"
    touched = _piled(size, max(digit / 2, ROUNDING * greatest))
    if touched:
        return f"is clipped: it reaches its greatest value, {greatest:.4g}, {touched} times"
    return None


def _piled(size: Samples, resolution: float) -> int:
    """Number of samples at the greatest value where they are too many; 0 where they are not."""
    touched = size > size.max() - resolution
    if touched.sum() < PILE or touched.all():
        return 0
    below = size[~touched]
    following = np.sum(below > below.max() - resolution)
    return int(touched.sum()) if touched.sum() > PILED * following else 0


def _plateau(samples: Samples, greatest: np.ndarray, digit: float) -> int | None:
    """First sample of a plateau at the greatest value that is entered and left by a large step."""
    edges = np.diff(np.concatenate([[False], greatest, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if end - start >= PLATEAU and _steep(samples, start, end, STEPS * digit):
            return start
    return None


def _steep(samples: Samples, start: int, end: int, least: float) -> bool:
    before = abs(samples[start] - samples[start - 1]) if start > 0 else np.inf
    after = abs(samples[end - 1] - samples[end]) if end < samples.size else np.inf
    return bool(before > least and after > least)
