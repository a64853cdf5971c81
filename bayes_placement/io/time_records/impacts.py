"""Impact tests: hits of a hammer, each a repeat, with windows on force and response."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.signal import find_peaks

from ..._shared.arguments import check_positive
from ..._shared.errors import InputError
from ..._shared.reprs import with_short_repr
from ..._shared.sites import unit
from .estimate import Excitation, Spectra, lines
from .recording import overload
from .records import FEWEST_SAMPLES, Records, Samples, positive

AUTOMATIC = 0.1
"""Share of the greatest force of a record at which a hit begins, where no force is stated."""

DEVIATIONS = 6.0
"""Deviations of the noise before a hit that a second peak of the force exceeds."""


class Hit(NamedTuple):
    """A hit in a record: the sample at which it begins, and those that belong to it."""

    record: int
    onset: int
    part: slice

    def quiet(self, before: int | None) -> int:
        """Samples at its beginning that hold noise only: half of those before the force."""
        lead = self.onset - self.part.start
        return (lead if before is None else min(lead, before)) // 2


def hit_per_record(records: Records) -> list[Hit]:
    """Return a hit for each record, with all samples of it."""
    return [
        Hit(number, onset(force), slice(0, force.size))
        for number, force in enumerate(records.force)
    ]


def onset(force: Samples) -> int:
    """Sample at which the force passes a tenth of its greatest value."""
    size = np.abs(force - np.median(force))
    return int(np.argmax(size >= AUTOMATIC * size.max()))


DECAYED = 0.01
"""Share of its greatest size to which a response has to decay until the end of its record."""

NOISE = 3.0
"""Ratio to the noise before the hit that the end of a record may have."""

END = 0.05
"""Share of a record that is its end, and whose size is compared."""


@with_short_repr
@dataclass(frozen=True)
class Impacts(Excitation):
    """Hits of a hammer.

    The offset of each channel is its mean in the first half of what was recorded before the force
    passes the trigger; it is subtracted. Hits with two peaks of the force, with an overloaded
    channel, or that are cut off by the end of the record are left out.

    Parameters
    ----------
    duration
        Length [s] of each hit, which are then found in the records; None where each record is one
        hit, as it was triggered.
    before
        Time [s] that each hit has before its trigger; needed with `duration`. Else None for all
        that a record has.
    trigger
        Force [N] at which a hit begins, with `duration`; None for a tenth of the greatest force of
        the record.
    force_window
        Time [s] after the trigger for which the force is kept, and a quarter of it before; it falls
        as half a cosine within another quarter, and all else is noise. None for all. What noise of
        the force is left is alike in lines within 1 / force_window [Hz].
    time_constant
        Time constant tau [s] of a window exp(-t / tau) on force and response, or None. It adds
        1 / (tau omega_n) to each damping ratio, which `Estimate.effects` says.
    double_hit
        Share of the greatest force that a second peak exceeds where the hammer hit twice.

    Raises
    ------
    InputError
        If a time is not positive, `before` is missing or not shorter than `duration`, `trigger` has
        no `duration`, or `double_hit` is no share.

    Examples
    --------
    >>> bp.time_records.Impacts(duration=1.0, before=0.02, time_constant=0.3).double_hit
    0.1
    """

    duration: float | int | None = field(default=None, metadata=unit("s"))
    before: float | int | None = field(default=None, metadata=unit("s"))
    trigger: float | int | None = field(default=None, metadata=unit("N"))
    force_window: float | int | None = field(default=None, metadata=unit("s"))
    time_constant: float | int | None = field(default=None, metadata=unit("s"))
    double_hit: float | int = 0.1

    def __post_init__(self) -> None:
        """Check the times."""
        for name in ("duration", "before", "trigger", "force_window", "time_constant"):
            value = getattr(self, name)
            if value is not None:
                positive(name, value, f"time_records.Impacts({name}=0.5)")
        check_positive("double_hit", self.double_hit, "time_records.Impacts(double_hit=0.1)", 1.0)
        if self.duration is None:
            self._check_triggered()
        elif self.before is None or self.before >= self.duration:
            raise InputError(
                f"Impacts(duration={self.duration:g}, before={self.before}) was given; a time "
                "before the trigger that is shorter than the duration is needed, since a force "
                "begins before it passes the trigger: Impacts(duration=1.0, before=0.02)."
            )

    def _check_triggered(self) -> None:
        """Refuse a trigger where each record is one hit."""
        if self.trigger is not None:
            raise InputError(
                f"Impacts(trigger={self.trigger:g}) was given without duration; both are needed to "
                "find hits in a record, since without them each record is one hit, as it was "
                "triggered: Impacts(duration=1.0, before=0.02, trigger=50.0)."
            )

    def spectra(self, records: Records) -> Spectra:
        """Spectra of the hits that are left."""
        hits = self._hits(records)
        reasons = [self._fault(records, hit) for hit in hits]
        usable_hits = [hit for hit, reason in zip(hits, reasons, strict=True) if reason is None]
        left_out = tuple(
            f"Hit {number} of {len(hits)} is left out: {reason}."
            for number, reason in enumerate(reasons, 1)
            if reason is not None
        )
        _check_count(len(usable_hits), left_out)
        _check_lengths(usable_hits)
        return replace(self._of_hits(records, usable_hits), left_out=left_out)

    def _hits(self, records: Records) -> list[Hit]:
        if self.duration is None:
            return hit_per_record(records)
        length = round(self.duration * records.rate)
        if length < FEWEST_SAMPLES:
            raise InputError(
                f"Impacts(duration={self.duration:g}) has {length} samples at {records.rate:g} Hz; "
                f"at least {FEWEST_SAMPLES} are needed, to be transformed to lines: duration=1.0."
            )
        return over_trigger(records, self.trigger, self._before(records.rate) or 0, length)

    def _fault(self, records: Records, hit: Hit) -> str | None:
        """Why a hit cannot be used; None where it can."""
        force = records.force[hit.record]
        if hit.part.start < 0 or hit.part.stop > force.size:
            return "the record begins too late or ends too early for it"
        reason = overload(records, hit.record, hit.part)
        if reason is not None:
            return reason
        quiet = hit.quiet(self._before(records.rate))
        second = second_hit(_without_offset(force[hit.part], quiet), quiet, self.double_hit)
        if second is None:
            return None
        when = (hit.part.start + second) / records.rate
        return f"the hammer hit twice, again at {when:.4g} s of its record"

    def _before(self, rate: float) -> int | None:
        """Samples before the trigger; None where that is not stated."""
        return None if self.before is None else round(self.before * rate)

    def _of_hits(self, records: Records, hits: list[Hit]) -> Spectra:
        quiet = [hit.quiet(self._before(records.rate)) for hit in hits]

        def stacked(rows: tuple[Samples, ...]) -> Float[np.ndarray, "repeat sample"]:
            parts = (rows[hit.record][hit.part] for hit in hits)
            return np.array(list(map(_without_offset, parts, quiet)))

        force = stacked(records.force)
        response = np.array([stacked(rows) for rows in records.response])
        window = self._decay(force.shape[-1], records.rate)
        pulse = np.array([self._pulse(hit, force.shape[-1], records.rate) for hit in hits])
        frequency = lines(force.shape[-1], records.rate)
        used = slice(1, 1 + frequency.size)
        return Spectra(
            frequency=frequency,
            force=np.fft.rfft(force * pulse * window)[..., used],
            response=np.fft.rfft(response * window)[..., used],
            averages=float(len(hits)),
            correlated_lines=float(window.size * np.sum(window**4) / np.sum(window**2) ** 2),
            done=tuple(self._done(window)),
            warnings=tuple(_undecayed(records, response, window, min(quiet))),
            time_constant=self.time_constant,
        )

    def _decay(self, count: int, rate: float) -> Samples:
        if self.time_constant is None:
            return np.ones(count)
        return np.exp(-np.arange(count) / (rate * self.time_constant))

    def _pulse(self, hit: Hit, count: int, rate: float) -> Samples:
        """Window on the force: 1 around the pulse, then half a cosine, then 0."""
        if self.force_window is None:
            return np.ones(count)
        after = (np.arange(count) - (hit.onset - hit.part.start)) / rate
        quarter = self.force_window / 4
        outside = np.maximum(after - self.force_window, -after - quarter)
        fall = np.clip(outside / quarter, 0.0, 1.0)
        return (1 + np.cos(np.pi * fall)) / 2

    def _done(self, window: Samples) -> Iterator[str]:
        if self.force_window is not None:
            yield f"force window of {self.force_window:g} s"
        if self.time_constant is not None:
            yield (
                f"exponential window of time constant {self.time_constant:g} s on force and "
                f"response, {window[-1]:.2g} at its end"
            )


def _without_offset(samples: Samples, quiet: int) -> Samples:
    return samples - samples[:quiet].mean() if quiet > 0 else samples


def _check_count(count: int, left_out: tuple[str, ...]) -> None:
    if count < 2:
        reasons = " ".join(left_out)
        raise InputError(
            f"{count} hit{'' if count == 1 else 's'} can be used; at least two are needed, since "
            "the coherence of a single one is 1 whatever the noise is, and its error unknown. Hit "
            "again, or give duration= and before= where one record holds all hits: "
            f"Impacts(duration=1.0, before=0.02). {reasons}".rstrip()
        )


def _check_lengths(hits: list[Hit]) -> None:
    lengths = {hit.part.stop - hit.part.start for hit in hits}
    if len(lengths) > 1:
        raise InputError(
            f"The hits have {min(lengths)} to {max(lengths)} samples; one length is needed, since "
            "all have the same lines. Cut them: Impacts(duration=1.0, before=0.02)."
        )


def _undecayed(
    records: Records,
    response: Float[np.ndarray, "sensor repeat sample"],
    window: Samples,
    quiet: int,
) -> Iterator[str]:
    """Name the sensor whose response goes on most at the end of the record."""
    windowed = response * window
    block = max(1, round(END * window.size))
    blocks = window.size // block
    parts = windowed[..., -blocks * block :].reshape(*windowed.shape[:-1], blocks, block)
    size = np.sqrt(np.mean(parts**2, axis=(1, -1)))  # (sensor, block), over all hits
    noise = np.sqrt(np.mean(response[..., :quiet] ** 2, axis=(1, 2))) if quiet > 1 else 0.0
    share = size[:, -1] / size.max(axis=-1)
    goes_on = (share > DECAYED) & (size[:, -1] > NOISE * noise * window[-1])
    if goes_on.any():
        worst = int(np.argmax(np.where(goes_on, share, 0.0)))
        yield (
            f"The response of {records.sensors[worst].label} has not decayed at the end of its "
            f"record, where it is {100 * share[worst]:.2g} % of its greatest size: what is cut off "
            "errs the resonances. Record longer, or take an exponential window: "
            f"Impacts(time_constant={window.size / records.rate / 5:.2g})."
        )


def over_trigger(records: Records, trigger: float | None, before: int, length: int) -> list[Hit]:
    """Hits in records, each where the force passes a trigger [N]: None is a tenth of the greatest.

    A hit has so many samples before the trigger, and in all.
    """
    return [
        Hit(number, begin, slice(begin - before, begin - before + length))
        for number, force in enumerate(records.force)
        for begin in _onsets(force, trigger, length - before)
    ]


def _onsets(force: Samples, trigger: float | None, blind: int) -> list[int]:
    """Samples at which the force passes the trigger, not within a hit that began before."""
    size = np.abs(force - np.median(force))
    level = AUTOMATIC * float(size.max()) if trigger is None else trigger
    above = np.flatnonzero((size[1:] >= level) & (size[:-1] < level)) + 1
    chosen: list[int] = []
    for begin in above.tolist():
        if not chosen or begin >= chosen[-1] + blind:
            chosen.append(begin)
    return chosen


def second_hit(force: Samples, quiet: int, share: float) -> int | None:
    """Sample of a second peak in the force [N] of a hit; None where there is one peak only.

    The force has no offset and begins with quiet samples; a second peak exceeds a share of the
    greatest, and stands out by it.
    """
    peak = int(np.argmax(np.abs(force)))
    noise = float(np.std(force[:quiet])) if quiet > 1 else 0.0
    least = max(share * abs(float(force[peak])), DEVIATIONS * noise)
    peaks, _ = find_peaks(np.sign(force[peak]) * force, height=least, prominence=least)
    further_peaks = [place for place in peaks.tolist() if place != peak]
    return further_peaks[0] if further_peaks else None
