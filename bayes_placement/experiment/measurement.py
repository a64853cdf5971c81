"""Measured FRFs of labelled channels: their conversion, and the choice of lines and channels."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..positions.channel import Channel, Channels, check_distinct, checked, match, parsed
from . import _measurement_checks as checks
from . import _measurement_words, line_choice
from ._measurement_checks import measured_lines
from ._measurement_words import as_pairs, frozen, sentence
from ._noise_level import pooled_by_coherence, scatter_of
from .quantities import converted, frf_name

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Channel", "Channels", "Measurement"]

Position = tuple[float, float, float]


@dataclass(frozen=True, eq=False, repr=False)
class Measurement:
    """Measured FRFs, labelled by sensor channel, actuator channel and frequency.

    Arrays are copied and read-only. `Measurement.from_arrays` is the usual way to make one.

    Parameters
    ----------
    frf
        Complex FRFs [m/N, (m/s)/N or (m/s²)/N] of shape (sensor, actuator, frequency), under
        exp(+i w t); NaN at all lines where a pair was not measured.
    frequency
        Lines [Hz], not negative and strictly increasing.
    sensors, actuators
        Channels of the rows and of the columns.
    quantity
        `receptance`, `mobility` or `accelerance`; or the motion, `displacement`, `velocity` or
        `acceleration`.
    coherence
        Ordinary coherence [1] in the shape of the FRFs, NaN for pairs where unknown; or None.
    averages
        Number of averages of the H1 estimate, or None.
    positions
        Recorded coordinates [m] by the name of the transducer, as far as they are known.
    force_level
        Amplitude of the force [N], or None.
    variance
        Variance E|error|^2 of each FRF value [unit of the FRF squared] in the shape of the FRFs, as
        repeats show it, NaN for pairs where unknown; or None.
    coherent_variance
        What `noise_variance` returns, kept where lines are chosen, so that it rests on all lines of
        the record; None where it is not computed yet.
    line_scatter
        What `scatter_variance` returns, kept likewise.

    Raises
    ------
    ValueError
        If shapes do not agree, a measured pair has gaps, or a value is out of its range.

    Examples
    --------
    >>> kept = {"sensors": ["s1"], "actuators": ["a1"], "quantity": "mobility"}
    >>> bp.Measurement.from_arrays([1e-3 + 2e-3j, 3e-3j], [100.0, 150.0], **kept)
    Measurement: mobility [(m/s)/N] of 1 sensor channel for 1 actuator channel, 1 pair measured, 2
    lines from 100 to 150 Hz, no coherence.
    """

    frf: np.ndarray
    frequency: np.ndarray
    sensors: tuple[Channel, ...]
    actuators: tuple[Channel, ...]
    quantity: str
    coherence: np.ndarray | None = None
    averages: float | int | None = None
    positions: dict[str, Position] = field(default_factory=dict)
    force_level: float | int | None = None
    variance: np.ndarray | None = None
    coherent_variance: np.ndarray | None = None
    line_scatter: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and check the values."""
        for name in ("frf", "frequency", *_OF_LINES):
            if getattr(self, name) is not None:
                dtype = complex if name == "frf" else float
                object.__setattr__(self, name, frozen(getattr(self, name), dtype))
        object.__setattr__(self, "positions", checks.positions(self.positions))
        for channel in self.sensors + self.actuators:
            checked(channel)
        object.__setattr__(self, "quantity", frf_name(self.quantity))
        checks.frequency(self.frequency)
        checks.shape("frf", self.frf, self._shape)
        checks.frf(self.frf, self.frequency, self._label)
        for name in _OF_LINES:
            if getattr(self, name) is not None:
                checks.shape(name, getattr(self, name), self._shape)
        if self.coherence is not None:
            checks.coherence(self.coherence, self.frequency, self._label)
        if self.variance is not None:
            checks.not_negative(self.variance, self.frequency, self._label)
        checks.averages(self.averages)
        checks.force_level(self.force_level)

    @classmethod
    def from_arrays(
        cls,
        frf: object,
        frequency: object,
        *,
        sensors: Channels,
        actuators: Channels,
        quantity: str,
        coherence: object = None,
        averages: float | int | None = None,
        positions: Mapping[str, Sequence[float | int]] | None = None,
        force_level: float | int | None = None,
        variance: object = None,
    ) -> "Measurement":
        """Make a measurement of plain arrays and channel labels.

        Parameters
        ----------
        frf, coherence, variance
            Array-likes of shape (sensor, actuator, frequency), or (frequency,) where there is one
            sensor channel and one actuator channel.
        frequency
            Lines [Hz].
        sensors, actuators
            Labels such as `s1` or `s1+x`, or channels; each may appear once.
        quantity, averages, positions, force_level
            As in `Measurement`.

        Raises
        ------
        ValueError
            As in `Measurement`, and if a channel is given twice.
        """
        checks.numeric("frf", frf, "iufc")
        checks.numeric("frequency", frequency, "iuf")
        for name, values in (("coherence", coherence), ("variance", variance)):
            if values is not None:
                checks.numeric(name, values, "iuf")
        rows, columns = parsed(sensors), parsed(actuators)
        check_distinct("sensor", rows)
        check_distinct("actuator", columns)
        single = len(rows) == len(columns) == 1
        return cls(
            frf=as_pairs(frf, single),
            frequency=np.asarray(frequency),
            sensors=rows,
            actuators=columns,
            quantity=quantity,
            coherence=None if coherence is None else as_pairs(coherence, single),
            averages=averages,
            positions=checks.positions(positions or {}),
            force_level=force_level,
            variance=None if variance is None else as_pairs(variance, single),
        )

    @property
    def _shape(self) -> tuple[int, int, int]:
        return len(self.sensors), len(self.actuators), self.frequency.size

    @property
    def measured(self) -> np.ndarray:
        """Which pairs were measured, of shape (sensor, actuator)."""
        return ~np.isnan(self.frf).all(axis=-1)

    def converted(self, quantity: str) -> "Measurement":
        """Return the FRFs as receptance, mobility or accelerance, by powers of i w.

        Raises
        ------
        ValueError
            If the quantity is none of these, or 0 Hz would have to be divided by.
        """
        frf = converted(self.frf, self.frequency, self.quantity, quantity)
        factor = converted(np.ones(self.frequency.size), self.frequency, self.quantity, quantity)
        variances = self._of_lines(lambda values: values * np.abs(factor) ** 2)
        variances.pop("coherence", None)
        return replace(self, frf=frf, quantity=quantity, **variances)

    def band(self, low: float | int, high: float | int) -> "Measurement":
        """Return the lines from low to high [Hz], both included.

        Raises
        ------
        ValueError
            If no line lies there.
        """
        checks.band(low, high)
        inside = (self.frequency >= low) & (self.frequency <= high)
        return self._with_lines(inside, f"band({low:g}, {high:g})")

    def without(self, low: float | int, high: float | int) -> "Measurement":
        """Return the measurement without the lines from low to high [Hz], both included.

        Raises
        ------
        ValueError
            If no line is left.
        """
        checks.band(low, high)
        outside = (self.frequency < low) | (self.frequency > high)
        return self._with_lines(outside, f"without({low:g}, {high:g})")

    def lines(self, frequency: object) -> "Measurement":
        """Return the lines at these frequencies [Hz], found to a relative 1e-5, as measured.

        Raises
        ------
        ValueError
            If a line was not measured, or the frequencies do not increase from line to line.
        """
        checks.numeric("frequency", frequency, "iuf")
        requested = np.atleast_1d(np.asarray(frequency, dtype=float))
        return self._at(measured_lines(self.frequency, requested))

    def channels(self, sensors: Channels, actuators: Channels) -> "Measurement":
        """Pick and order the rows and columns of these channels; they may repeat.

        A channel recorded in the opposite direction is the requested one with its sign flipped. A
        direction not stated, in request or record, matches the only channel of that name.

        Raises
        ------
        ValueError
            If a channel is missing, or several match.
        """
        rows = [match(channel, self.sensors, "sensor") for channel in parsed(sensors)]
        columns = [match(channel, self.actuators, "actuator") for channel in parsed(actuators)]
        pick = np.ix_([row.number for row in rows], [column.number for column in columns])
        signs = np.outer([row.sign for row in rows], [column.sign for column in columns])
        return replace(
            self,
            frf=self.frf[pick] * signs[:, :, None],
            **self._of_lines(lambda values: values[pick]),
            sensors=tuple(row.channel for row in rows),
            actuators=tuple(column.channel for column in columns),
        )

    def around_resonances(
        self,
        *,
        lines_per_bandwidth: float | int = 4,
        bandwidths: float | int = 5,
        together: Sequence["Measurement"] = (),
    ) -> "Measurement":
        """Return the lines around the resonances, where FRFs tell most of modes and damping.

        Resonances are the peaks of the sum of the squared mobilities of all pairs, each over its
        mean, that stand 3 dB above the valley beside them and out of the noise, known from
        coherence and averages or from the scatter of the lines. `thinned` also keeps lines between
        them: antiresonances tell of a structure as well.

        Parameters
        ----------
        lines_per_bandwidth
            Lines in each half-power bandwidth, as far as measured.
        bandwidths
            Half-power bandwidths to either side of a resonance.
        together
            Runs at other force levels on the same lines, whose resonances count as well.

        Raises
        ------
        ValueError
            If a number is not positive, the lines of the runs differ, or there is no resonance.
        """
        runs = line_choice.runs(self, together)
        widths = {"lines_per_bandwidth": lines_per_bandwidth, "bandwidths": bandwidths}
        return self._at(line_choice.around_resonances(runs, **widths))

    def thinned(self, most: int, *, together: Sequence["Measurement"] = ()) -> "Measurement":
        """Return at most `most` of the lines, dense where the FRFs change most against their noise.

        Lines are spread evenly along the curve that all FRFs draw, in deviations of their noise
        (from coherence and averages, or else from the scatter of the lines), and three of ten
        evenly over the lines, so that no stretch is left without any.

        Parameters
        ----------
        most
            Greatest number of lines.
        together
            Runs at other force levels on the same lines, which count as well.

        Raises
        ------
        ValueError
            If `most` is less than 1, or the lines of the runs differ.
        """
        return self._at(line_choice.thinned(line_choice.runs(self, together), most))

    def noise_variance(self) -> np.ndarray:
        """Variance E|error|^2 of each FRF value, known from coherence and averages.

        For an H1 estimate of n averages with coherence g2 it is |H|^2 (1 - g2) / (n g2), circular
        complex Gaussian: half of it lies in the real part, half in the imaginary part. A coherence
        that scatters as an estimate by n averages does makes chi2 of a right model n / (n - 2): it
        is pooled over neighbouring lines of the record, with n - 1 for n.

        Returns
        -------
        ndarray
            Of shape (sensor, actuator, frequency) [unit of the FRF squared]; NaN if not measured.

        Raises
        ------
        ValueError
            If coherence or averages are missing, or say that an error is zero or unbounded.
        """
        if self.coherence is None or self.averages is None:
            raise checks.no_coherence(has_coherence=self.coherence is not None)
        variance = self._variance_by_coherence
        assert variance is not None
        checks.variance(variance, self.measured, self.frequency, self._label)
        return variance

    def stated_variance(self) -> np.ndarray:
        """Variance E|error|^2 of each FRF value, as the measurement states it.

        Raises
        ------
        ValueError
            If it states none, or none that is positive where something was measured.
        """
        if self.variance is None:
            raise checks.no_variance()
        checks.stated_variance(self.variance, self.measured, self.frequency, self._label)
        return self.variance

    def scatter_variance(self) -> np.ndarray:
        """Variance E|error|^2 of each FRF value, by the scatter of neighbouring lines.

        As of `noise_variance`. It rests on all lines of the record: those chosen later keep it.

        Raises
        ------
        ValueError
            If lines are too few or uneven, or do not scatter at all.
        """
        if self._scatter is None:
            raise checks.no_scatter(self.frequency)
        checks.stated_variance(self._scatter, self.measured, self.frequency, self._label)
        return self._scatter

    def to_dataset(self) -> "xr.Dataset":
        """Return the measurement as a labelled dataset, complex numbers as an axis `part`."""
        return _measurement_words.dataset(self)

    def __repr__(self) -> str:
        """Say what was measured in one paragraph."""
        return sentence(self)

    _repr_html_ = _measurement_words.html

    @cached_property
    def _variance_by_coherence(self) -> np.ndarray | None:
        """Variance by coherence and averages, pooled over neighbouring lines; None without them."""
        known = self.coherent_variance is not None
        is_stated = self.coherence is not None and self.averages is not None
        return pooled_by_coherence(self) if is_stated and not known else self.coherent_variance

    @cached_property
    def _scatter(self) -> np.ndarray | None:
        """Variance by the scatter of lines; None where too few or uneven lines tell it."""
        return scatter_of(self) if self.line_scatter is None else self.line_scatter

    def _label(self, row: int, column: int) -> str:
        return f"{self.sensors[row].label} / {self.actuators[column].label}"

    def _with_lines(self, keep: np.ndarray, request: str) -> "Measurement":
        if not keep.any():
            raise checks.no_line(request, self.frequency)
        return self._at(np.flatnonzero(keep))

    def _at(self, index: np.ndarray) -> "Measurement":
        of_lines = self._of_lines(lambda values: values[..., index])
        return replace(self, frf=self.frf[..., index], frequency=self.frequency[index], **of_lines)

    def _of_lines(self, pick: Callable[[np.ndarray], np.ndarray]) -> dict[str, Any]:
        """Pick what is known of each line besides its FRF."""
        known = (self.coherence, self.variance, self._variance_by_coherence, self._scatter)
        values = zip(_OF_LINES, known, strict=True)
        return {name: pick(array) for name, array in values if array is not None}


_OF_LINES = ("coherence", "variance", "coherent_variance", "line_scatter")
