"""Cross-axis sensitivity of a sensor with several directions."""

import jax.numpy as jnp

from .._shared.dimensions import Parameter, Receptance
from .._shared.errors import InputError
from .._shared.sites import unit
from .prelude import Instruments, Number, OfSide, Omega, Scales, field, log_uniform_of_either_sign


class CrossAxis(OfSide):
    """A sensor each channel of which reads a share of its other channels too.

    Transverse sensitivity, ISO 16063-31: up to some percent of that along the axis. It is tried
    where it is named.

    Parameters
    ----------
    sensor
        Name of the sensor, which has at least two channels.
    share
        Share of each other channel that a channel reads in addition to its own [1].

    Examples
    --------
    >>> both = setup | {"sensors": [bp.Sensor("s1", at=0.2, directions=(1, -1))]}
    >>> mixed = bp.Experiment(structure, **both) + bp.effects.cross_axis("s1", share=0.03)
    >>> [effect.name for effect in mixed.effects]
    ['cross_axis']
    """

    tried_by_default = False
    absent = ("share", 0.0)
    side = "sensor"
    sensor: Number
    share: Parameter = field(metadata=unit("1"))
    name: str = field(static=True, default="cross_axis", kw_only=True)

    def numbered(self, instruments: Instruments) -> "CrossAxis":
        """Return the effect with its sensor by number."""
        number = instruments.number(self.sensor)
        if len(instruments.rows(number)) < 2:
            raise InputError(
                f'Effect "{self.name}": sensor "{instruments.name(number)}" was given, but it has '
                "one channel; at least two are needed, since each reads a share of the others. "
                "Name a sensor with more directions, or declare them: Sensor(..., "
                "directions=(1, 2, 3))."
            )
        return OfSide.numbered(self, instruments)

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF whose channels of the sensor are mixed."""
        rows = instruments.of(self.sensor)
        unchanged = jnp.eye(rows.size)
        mixed = unchanged + self.share * (1 - unchanged) * jnp.outer(rows, rows)
        return jnp.einsum("rs,saf->raf", mixed.astype(frf.dtype), frf)

    @classmethod
    def suggest(cls, scales: Scales) -> list["CrossAxis"]:
        """Up to 10 % of either sign, log-uniform from 1e-4 on, for each sensor of several."""
        share = log_uniform_of_either_sign(1e-4, -0.1, 0.1)
        sensors = scales.instruments.sensors.items()
        return [cls(name, share) for name, sensor in sensors if len(sensor.directions) > 1]
