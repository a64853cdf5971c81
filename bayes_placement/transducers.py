"""transducers: in, modes and the place of a sensor or actuator; out, the mode shapes it reads.

Not known here: frequencies, damping, data.
"""

from typing import Any, ClassVar, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._sites import is_unknown, unit
from ._types import Parameter, Shapes
from .measurement import Channel
from .modes import Modes
from .orientation import rotation, unit_vector
from .points import Points
from .supports import Segment

Self = TypeVar("Self", bound="Transducer")


class Transducer(eqx.Module):
    """What sensors and actuators share: a name, a place, directions and an orientation.

    Parameters
    ----------
    name
        Its name in the measurement and in the names of the unknowns.
    at
        Where it sits [m]: a number, `supports.Segment`, or any scalar distribution.
    directions
        Recorded directions of its channels, +-1, +-2, +-3 for +-x, +-y, +-z. Empty: the one
        direction in which the structure moves.
    angles
        Euler angles [rad] by which it is rolled against its record, three numbers or
        distributions (`orientation.rotation`); None where the orientation is exact.
    recorded
        Recorded position [m]; by default the centre of the segment or the mean of the law.
    """

    kind: eqx.AbstractClassVar[str]
    name: str = eqx.field(static=True)
    position: Parameter | Segment = eqx.field(metadata=unit("m"))
    angles: tuple[Parameter, ...] | None = eqx.field(metadata=unit("rad"))
    directions: tuple[int, ...] = eqx.field(static=True)
    recorded: float = eqx.field(static=True)

    def __init__(
        self,
        name: str,
        at: Parameter | Segment,
        *,
        directions: tuple[int, ...] = (),
        angles: tuple[Parameter, ...] | None = None,
        recorded: float | int | None = None,
    ):
        self.name = name
        self.position = at
        self.angles = None if angles is None else tuple(angles)
        self.directions = tuple(directions)
        self.recorded = _centre(at) if recorded is None else float(recorded)
        self._check_directions()

    def _check_directions(self) -> None:
        if not set(self.directions) <= {-3, -2, -1, 1, 2, 3}:
            raise ValueError(
                f'{self.kind} "{self.name}": directions={self.directions} was given; each must be '
                "one of +-1, +-2, +-3 for +-x, +-y, +-z: directions=(3,)."
            )
        if self.angles is not None and len(self.angles) != 3:
            raise ValueError(
                f'{self.kind} "{self.name}": {len(self.angles)} angles were given; three Euler '
                "angles [rad] about x, y and z are needed: angles=(0.0, 0.1, 0.0)."
            )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels that it contributes, in order."""
        return tuple(Channel(self.name, direction) for direction in self.directions)

    def on(self: Self, modes: Modes) -> Self:
        """Return it placed on a structure: its directions stated, its segment a uniform law.

        Raises
        ------
        ValueError
            If it lies outside the structure.
        """
        return type(self)(
            self.name,
            self._law(modes.bounds()),
            directions=self.directions or modes.axes,
            angles=self.angles,
            recorded=self.recorded,
        )

    def _law(self, bounds: tuple[float, float]) -> Parameter:
        if isinstance(self.position, Segment):
            try:
                return self.position.law(bounds)
            except ValueError as error:
                raise ValueError(f'{self.kind} "{self.name}": {error}') from error
        if isinstance(self.position, int | float):
            self._check_inside(self.position, *bounds)
        return self.position

    def _check_inside(self, position: float, low: float, high: float) -> None:
        if not low <= position <= high:
            raise ValueError(
                f'{self.kind} "{self.name}": position {position:g} m lies outside the structure '
                f"({low:g} to {high:g} m). Mode shapes are only known on the structure; "
                "use supports.Segment within it."
            )

    def points(self, axes: tuple[int, ...]) -> Points:
        """Where and along what its channels read or drive a structure that moves along axes."""
        vectors = self._directions(axes)
        position = jnp.asarray(self.position, dtype=float)
        return Points(jnp.broadcast_to(position, (len(vectors), *position.shape)), vectors)

    def shapes(self, modes: Modes) -> Shapes:
        """Mode shapes read by its channels, the rows of [O][Phi] of Eq. (14)."""
        return self.points(modes.axes).shapes(modes)

    def _directions(self, axes: tuple[int, ...]) -> Float[Array | np.ndarray, "channel axis"]:
        vectors: Any = np.stack([unit_vector(direction) for direction in self.directions])
        if self.angles is not None:
            vectors = vectors @ rotation(jnp.stack([jnp.asarray(a) for a in self.angles])).T
        return vectors[:, np.array(axes) - 1]


def _centre(at: Parameter | Segment) -> float:
    if isinstance(at, Segment):
        return at.centre
    if is_unknown(at):
        return float(at.mean)
    return float("nan") if isinstance(at, jax.core.Tracer) else float(at)


class Sensor(Transducer):
    """A sensor: it reads the motion where it sits. See `Transducer` for the arguments."""

    kind: ClassVar[str] = "Sensor"


class Actuator(Transducer):
    """An actuator or a hammer hit: it drives where it sits. See `Transducer`."""

    kind: ClassVar[str] = "Actuator"
