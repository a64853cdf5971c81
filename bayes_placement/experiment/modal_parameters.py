"""Measured modal parameters: natural frequencies, damping ratios and shapes, with deviations."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .._shared.arguments import check_annotated
from .._shared.reprs import notebook_html
from ..positions.channel import Channel, Channels, check_distinct, match, parsed
from . import _modal_checks as checks

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["ModalParameters"]

FREQUENCY, DAMPING, SHAPE = 0, 1, 2
"""Rows of a mode: its natural frequency, its damping ratio, and from the third on its shape."""


@dataclass(frozen=True, eq=False, repr=False, init=False)
class ModalParameters:
    """Measured natural frequencies, damping ratios and mode shapes, with what is known of errors.

    Arrays are copied and read-only. No force needs to be known: an output-only test gives them as
    well. The scale and the sign of each shape mean nothing.

    Parameters
    ----------
    natural_frequency
        Natural frequencies [Hz] of damped modes, |s| / (2 pi) of their poles s, increasing.
    natural_frequency_deviation
        Their standard deviations [Hz].
    damping_ratio
        Damping ratios [1] of the modes, NaN where unknown; None for none.
    damping_ratio_deviation
        Their standard deviations [1].
    shape
        Displacement of each channel in each mode, of shape (channel, mode), in any unit and scale;
        NaN where unknown. None for none.
    shape_deviation
        Its standard deviations, in the unit of the shape.
    sensors
        Channels of the rows of the shape.
    covariance
        For each mode the covariance of its natural frequency, its damping ratio and its shape, of
        shape (mode, 2 + channels, 2 + channels), in the place of deviations; rows and columns of
        what is unknown are not read.
    correlation
        Correlation of the errors of natural frequencies between modes [1], of shape (mode, mode);
        None where they are independent, as all other errors of two modes are.
    number
        Number of each mode among the elastic modes of the model, from 1; None where it is found by
        comparing shapes and frequencies.

    Raises
    ------
    InputError
        If shapes of arrays do not agree, a value is out of its range, something measured has no
        positive deviation, natural frequencies are correlated with other modes and with damping or
        shapes as well, or shapes are complex: `ModalParameters.of_complex_shapes` takes these.

    Examples
    --------
    >>> modes = bp.ModalParameters(
    ...     [160.0, 330.0],
    ...     [0.1, 0.2],
    ...     shape=[[1.0, 2.0], [3.0, -1.0]],
    ...     shape_deviation=[[0.1, 0.1], [0.1, 0.1]],
    ...     sensors=["s1", "s2"],
    ... )
    >>> modes.channels("s2").shape.tolist()
    [[3.0, -1.0]]
    """

    values: np.ndarray
    covariance: np.ndarray
    correlation: np.ndarray
    sensors: tuple[Channel, ...]
    number: tuple[int, ...] | None

    def __init__(
        self,
        natural_frequency: object,
        natural_frequency_deviation: object = None,
        *,
        damping_ratio: object = None,
        damping_ratio_deviation: object = None,
        shape: object = None,
        shape_deviation: object = None,
        sensors: Channels = (),
        covariance: object = None,
        correlation: object = None,
        number: object = None,
    ):
        channels = parsed(sensors)
        check_distinct("sensor", channels)
        frequency = checks.frequency(natural_frequency)
        count = frequency.size
        layout = {
            "natural_frequency": (count,),
            "damping_ratio": (count,),
            "shape": (len(channels), count),
        }
        stated = {"natural_frequency": frequency, "damping_ratio": damping_ratio, "shape": shape}
        deviations = {
            "natural_frequency": natural_frequency_deviation,
            "damping_ratio": damping_ratio_deviation,
            "shape": shape_deviation,
        }
        checks.has_sensors(shape, channels)
        rows = [checks.array(name, stated[name], size) for name, size in layout.items()]
        values = _in_rows(rows)
        errors = _in_rows(
            [
                checks.array(f"{name}_deviation", deviations[name], size)
                for name, size in layout.items()
            ]
        )
        if covariance is None:
            covariance = errors.T[:, :, None] ** 2 * np.eye(len(errors))  # independent errors
        checks.agree(covariance, errors)
        known = checks.covariance(covariance, values, [channel.label for channel in channels])
        checks.damping(values[DAMPING])
        between = checks.correlation(correlation, known)
        arrays = {"values": values, "covariance": known, "correlation": between}
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "sensors", channels)
        object.__setattr__(self, "number", checks.number(number, count))

    @property
    def natural_frequency(self) -> np.ndarray:
        """Natural frequencies [Hz]."""
        return self.values[FREQUENCY]

    @property
    def damping_ratio(self) -> np.ndarray:
        """Damping ratios [1]; NaN where unknown."""
        return self.values[DAMPING]

    @property
    def shape(self) -> np.ndarray:
        """Shapes, of shape (channel, mode); NaN where unknown."""
        return self.values[SHAPE:]

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations of natural frequency, damping ratio and shape, a column for a mode.

        NaN where nothing is known.
        """
        deviation = np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2)).T
        return np.where(np.isfinite(self.values), deviation, np.nan)

    def channels(self, sensors: Channels) -> "ModalParameters":
        """Pick and order the rows of the shapes by their channels.

        A channel recorded in the opposite direction is the requested one with its sign flipped.

        Raises
        ------
        InputError
            If a channel is missing, or several match.
        """
        rows = [match(channel, self.sensors, "sensor") for channel in parsed(sensors)]
        pick = np.array([FREQUENCY, DAMPING, *(SHAPE + row.number for row in rows)])
        sign = np.array([1.0, 1.0, *(row.sign for row in rows)])
        values = self.values[pick] * sign[:, None]
        covariance = self.covariance[:, pick[:, None], pick] * np.outer(sign, sign)
        return self._with(values, covariance, tuple(row.channel for row in rows))

    def modes(self, chosen: Sequence[int]) -> "ModalParameters":
        """Return some of the modes, by their places from 0.

        Raises
        ------
        InputError
            If there is no such mode.
        """
        places = checks.places(chosen, self.natural_frequency.size)
        number = None if self.number is None else tuple(self.number[place] for place in places)
        return self._with(
            self.values[:, places],
            self.covariance[places],
            self.sensors,
            number=number,
            correlation=self.correlation[np.ix_(places, places)],
        )

    def without_shapes(self) -> "ModalParameters":
        """Return the natural frequencies and damping ratios alone."""
        return self._with(self.values[:SHAPE], self.covariance[:, :SHAPE, :SHAPE], ())

    def _with(
        self, values: np.ndarray, covariance: object, sensors: tuple[Channel, ...], **known: object
    ) -> "ModalParameters":
        kept = {"number": self.number, "correlation": self.correlation} | known
        return ModalParameters(
            values[FREQUENCY],
            damping_ratio=values[DAMPING],
            shape=values[SHAPE:] if sensors else None,
            sensors=sensors,
            covariance=covariance,
            **kept,
        )

    @classmethod
    def from_repeats(
        cls,
        natural_frequency: object,
        damping_ratio: object = None,
        *,
        of_one: bool = False,
        number: object = None,
    ) -> "ModalParameters":
        """Make modal parameters of repeats, whose scatter shows the errors and their correlation.

        Values are the means of the repeats. Errors are those of the means: the covariance of the
        repeats over their number, if each repeat has errors of its own. Natural frequencies that
        rise and fall together, as with the temperature, are correlated between modes; damping
        ratios are taken for independent.

        Parameters
        ----------
        natural_frequency
            Natural frequencies [Hz] of shape (repeat, mode); two repeats more than modes at least.
        damping_ratio
            Damping ratios [1] of the same shape; None for none.
        of_one
            Whether errors are those of one repeat, as where all repeats of a state share what
            differs between states: the weather of that week.
        number
            As of `ModalParameters`.

        Raises
        ------
        InputError
            As `ModalParameters`, and if there are too few repeats.

        Examples
        --------
        >>> warmth = np.random.default_rng(0).normal(size=(9, 1))
        >>> repeats = np.array([160.0, 330.0]) * (1 + 1e-3 * warmth + 1e-4 * warmth[::-1] * [1, -1])
        >>> bp.ModalParameters.from_repeats(repeats, number=[1, 2]).correlation[0, 1].round(2)
        np.float64(0.98)
        """
        check_annotated("of_one", of_one, bool)
        frequency = checks.repeats("natural_frequency", natural_frequency, None)
        covariance = np.atleast_2d(np.cov(frequency, rowvar=False))
        scatter = np.sqrt(np.diag(covariance))
        count = 1 if of_one else len(frequency)
        damping = {}
        if damping_ratio is not None:
            ratio = checks.repeats("damping_ratio", damping_ratio, frequency.shape)
            deviation = ratio.std(axis=0, ddof=1) / np.sqrt(count)
            damping = {"damping_ratio": ratio.mean(axis=0), "damping_ratio_deviation": deviation}
        return cls(
            frequency.mean(axis=0),
            scatter / np.sqrt(count),
            correlation=covariance / np.where(scatter > 0, np.outer(scatter, scatter), 1.0),
            number=number,
            **damping,
        )

    @classmethod
    def of_complex_shapes(
        cls, shape: object, natural_frequency: object, **known: Any
    ) -> "ModalParameters":
        """Make modal parameters of complex shapes, whose real part is taken.

        Each shape is turned by the angle that makes its imaginary part least; the model's shapes
        are compared after the same turn.

        Parameters
        ----------
        shape
            Complex shapes (channel, mode).
        natural_frequency
            Natural frequencies [Hz].
        **known
            All else, as of `ModalParameters`.

        Returns
        -------
        ModalParameters
            The modes with real shapes.

        Raises
        ------
        InputError
            As `ModalParameters`, and if what remains imaginary exceeds a fifth of a shape.
        """
        return cls(natural_frequency, shape=checks.real_part(shape), **known)

    def table(self) -> "pd.DataFrame":
        """Natural frequencies and damping ratios with standard deviations, a row for each mode."""
        import pandas as pd

        columns = {
            "natural frequency [Hz]": self.natural_frequency,
            "its standard deviation [Hz]": self.deviation[FREQUENCY],
            "damping ratio [1]": self.damping_ratio,
            "its standard deviation [1]": self.deviation[DAMPING],
        }
        count = self.natural_frequency.size
        return pd.DataFrame(columns, index=pd.RangeIndex(1, count + 1, name="mode"))

    def _repr_html_(self) -> str:
        return notebook_html(repr(self), self.table())

    def __repr__(self) -> str:
        """Say what was measured in one sentence."""
        frequency = self.natural_frequency
        damped, shaped = (np.isfinite(rows).any(axis=0) for rows in (self.values[1:2], self.shape))
        return (
            f"ModalParameters: {frequency.size} modes from {frequency[0]:g} to {frequency[-1]:g} "
            f"Hz, {int(damped.sum())} with damping ratio, {int(shaped.sum())} with shape at "
            f"{len(self.sensors)} sensor channels."
        )


def _in_rows(rows: Sequence[np.ndarray]) -> np.ndarray:
    frequency, damping, shape = rows
    return np.concatenate([frequency[None], damping[None], shape])
