"""Sensors and actuators: positions, directions and orientations, and their tolerances."""

import math
from typing import Any, ClassVar, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact
from numpy.typing import ArrayLike

from .._shared.arguments import check_annotated, check_kind
from .._shared.dimensions import Parameter, Shapes
from .._shared.errors import InputError
from .._shared.ranges import ANGLE, DELAY, described
from .._shared.reprs import noun_html
from .._shared.sites import Role, check_scalar, is_open, is_unknown, unit, unknowns
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import is_beam, on_arms
from ..positions.at import At, RecordedPosition, as_place, position_on
from ..positions.bounds import in_space, position_text
from ..positions.channel import checked, checked_name
from ..positions.places import Place, Position, coordinates, mean
from ..positions.tolerances import Tolerance
from ..positions.vectors import Recorded, Vector, rotation, triple, unit_vector
from .measurement import Channel

Self = TypeVar("Self", bound="Transducer")


class Transducer(eqx.Module):
    """What sensors and actuators share: a name, a place, directions and an orientation.

    Parameters
    ----------
    name
        Its name in the measurement and in the names of the unknowns.
    at
        Where it sits [m]. On a line: a number, `positions.Segment`, or any scalar distribution. In
        space: three numbers or distributions, a place (`positions.Cartesian`, ...) or a
        tolerance (`positions.Box`, ...).
    directions
        Recorded directions of its channels, +-1, +-2, +-3 for +-x, +-y, +-z. Empty: the one
        direction in which the structure moves.
    angles
        Euler angles [rad] by which it is rolled against its record, three numbers or
        distributions (`positions.rotation`); None where the orientation is exact.
    recorded
        Recorded position [m], a number or three; by default the centre of the tolerance or the
        mean of the distribution.
    tolerance
        Tolerance of its position, which it keeps when it is moved; by default `at`, if that is a
        tolerance.
    gain
        Factor on every recorded FRF of its channels [1], a number or a distribution. Exactly 1, it
        is kept as None and costs nothing.
    delay
        Time [s] by which every recorded FRF of its channels is delayed, a factor
        exp(-i omega delay); a number or a distribution. Exactly 0, it is kept as None.
    arm
        Distance along a beam [m] from its place to the line of its force, on a rigid arm, a number
        or a distribution: a force F brings the moment F arm with it, and a sensor reads the
        displacement beside its foot, w + arm w'. Exactly 0, it is kept as None.

    Raises
    ------
    InputError
        For a direction that is no axis, other than three angles, or a gain of zero.

    Examples
    --------
    >>> sensor = bp.Sensor("s1", at=bp.positions.Segment(0.2, within=0.02))
    >>> sensor.name, sensor.recorded
    ('s1', 0.2)
    """

    kind: eqx.AbstractClassVar[str]
    name: str = eqx.field(static=True)
    position: Position | Tolerance = eqx.field(metadata=unit("m"))
    angles: tuple[Parameter, ...] | None = eqx.field(metadata=unit("rad", within=ANGLE))
    directions: tuple[int, ...] = eqx.field(static=True)
    recorded: Recorded = eqx.field(static=True)
    tolerance: Tolerance | None
    gain: Parameter | None = eqx.field(metadata=unit("1", Role.RECORDING))
    delay: Parameter | None = eqx.field(metadata=unit("s", Role.RECORDING, within=DELAY))
    arm: Parameter | None = eqx.field(metadata=unit("m"))

    def __init__(
        self,
        name: str,
        at: At,
        *,
        directions: tuple[int, ...] = (),
        angles: tuple[Parameter, ...] | None = None,
        recorded: float | int | Vector | None = None,
        tolerance: Tolerance | None = None,
        gain: Parameter | None = 1.0,
        delay: Parameter | None = 0.0,
        arm: Parameter | None = 0.0,
    ):
        needed = "a tuple is needed, with a number for each channel"
        instead = "directions=(3,)"
        check_kind(f"directions of the {self.kind}", directions, (tuple, list), needed, instead)
        if angles is not None:
            check_kind(
                f"angles of the {self.kind}",
                angles,
                (tuple, list, np.ndarray),
                "three Euler angles [rad] are needed, about x, y and z",
                "angles=(0.0, 0.1, 0.0)",
            )
        check_annotated("tolerance", tolerance, Tolerance | None)
        check_annotated("recorded", recorded, ArrayLike | None)
        self.name = checked(Channel(checked_name(f"{self.kind} of the name", name))).name
        self.position = as_place(at)
        self.tolerance = self.position if isinstance(self.position, Tolerance) else tolerance
        self.angles = None if angles is None else tuple(angles)
        self.directions = tuple(directions)
        self.recorded = _middle(self.position) if recorded is None else _recorded(recorded)
        for word, value in (("gain", gain), ("delay", delay), ("arm", arm)):
            check_scalar(word, value)
        self.gain, self.delay, self.arm = _unless(1.0, gain), _unless(0.0, delay), _unless(0.0, arm)
        self._check_directions()
        self._check_recording()

    def __repr__(self) -> str:
        """Say where it is recorded to be, and what is unknown of it."""
        priors = [f"{unknown.name} {described(unknown.distribution)}" for unknown in unknowns(self)]
        at = position_text(self.recorded)
        return ", ".join([f'{type(self).__name__} "{self.name}" at {at} m', *priors])

    _repr_html_ = noun_html

    def _check_directions(self) -> None:
        if len(set(self.directions)) < len(self.directions):
            raise InputError(
                f'{self.kind} "{self.name}": directions={self.directions} was given; each is '
                "needed once, since its data would count twice: directions=(1, 2, 3)."
            )
        of_numbers = not any(isinstance(number, bool) for number in self.directions)
        if not (of_numbers and set(self.directions) <= {-3, -2, -1, 1, 2, 3}):
            raise InputError(
                f'{self.kind} "{self.name}": directions={self.directions} was given; each must be '
                "one of +-1, +-2, +-3 for +-x, +-y, +-z: directions=(3,)."
            )
        if self.angles is not None and len(self.angles) != 3:
            raise InputError(
                f'{self.kind} "{self.name}": {len(self.angles)} angles were given; three Euler '
                "angles [rad] about x, y and z are needed: angles=(0.0, 0.1, 0.0)."
            )

    def _check_recording(self) -> None:
        gain, delay = _number(self.gain), _number(self.delay)
        if not np.isfinite(gain) or gain == 0:
            raise InputError(
                f'{self.kind} "{self.name}": gain={gain:g} was given; a finite number other than 0 '
                "is needed, or a distribution, since its FRFs are multiplied by it: "
                "gain=dist.Normal(1, 0.01)."
            )
        if not np.isfinite(delay):
            raise InputError(
                f'{self.kind} "{self.name}": delay={delay:g} was given; a finite time [s] is '
                "needed, or a distribution, since its FRFs are delayed by it: "
                "delay=dist.Normal(0, 1e-6)."
            )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels that it contributes, in order."""
        return tuple(Channel(self.name, direction) for direction in self.directions)

    def on(self: Self, modes: Modes) -> Self:
        """Return it placed on a structure: its directions stated, its tolerance a distribution.

        Raises
        ------
        ValueError
            If it lies outside the structure, or on a line where the structure is in space.
        """
        self._check_axes(modes.axes)
        self._check_arm(modes)
        position = self._position_on(self.position, modes)
        self._check_recorded(modes)
        settings = self._settings() | {"directions": self.directions or modes.axes}
        settings |= {"recorded": self.recorded, "tolerance": self.tolerance}
        return type(self)(self.name, position, **settings)

    def _settings(self) -> dict[str, Any]:
        """What it is, wherever it sits."""
        words = ("directions", "angles", "gain", "delay", "arm")
        return {word: getattr(self, word) for word in words}

    def _position_on(self, at: At, modes: Modes) -> Position:
        return position_on(at, modes.bounds(), f'{self.kind} "{self.name}"')

    def _check_axes(self, axes: tuple[int, ...]) -> None:
        """Refuse a channel along an axis in which nothing moves, unless it may be tilted."""
        moving = [number for number in self.directions if abs(number) in axes]
        if self.directions and not moving and self.angles is None:
            raise InputError(
                f'{self.kind} "{self.name}": directions={self.directions} was given, but the '
                f"structure moves along {', '.join(map(str, axes))} only; a direction in which it "
                f"moves is needed, since the others read nothing: directions=({axes[0]},)."
            )

    def _check_arm(self, modes: Modes) -> None:
        """Refuse an arm on what has no slope that is known at a place."""
        if self.arm is not None and not is_beam(modes):
            raise InputError(
                f'{self.kind} "{self.name}": an arm was given on {type(modes).__name__}; a uniform '
                "beam is needed, since a force beside a place brings a moment, which acts on the "
                "slope there, and under a moment at a point a plate or solid rotates without "
                "bounds. Use beams.beam, or give the place where the force acts, without arm."
            )

    def _check_recorded(self, modes: Modes) -> None:
        """Refuse a recorded position off the line, as one in mm is; in space it may stand off."""
        bounds, recorded = modes.bounds(), self.recorded
        if any(isinstance(bound, jax.core.Tracer) for bound in bounds) or in_space(bounds):
            return
        known = np.ndim(recorded) == 0 and bool(np.isfinite(recorded))
        if known and not isinstance(self.position, Tolerance):
            owner = f'{self.kind} "{self.name}"'
            position_on(recorded, bounds, owner, "recorded position")

    def placement_at(self, place: Recorded | Tolerance, modes: Modes) -> RecordedPosition:
        """Return where it sits if it is recorded elsewhere, with its present tolerance.

        Parameters
        ----------
        place
            Recorded position [m], or a tolerance.
        modes
            Modes of the structure.

        Raises
        ------
        ValueError
            If its position is a distribution without a tolerance, or would lie outside the
            structure.
        """
        at: At = place
        if not isinstance(place, Tolerance):
            at = place if self.tolerance is None else self.tolerance.around(place)
        if not isinstance(at, Tolerance) and unknowns(self.position):
            raise InputError(
                f'{self.kind} "{self.name}" was to be moved to {place} m, but its position is '
                "a distribution that holds at its present place only; a tolerance is needed, since "
                "that can be moved. Declare "
                "at=positions.Segment(0.25, within=0.04), or give tolerances as candidates."
            )
        return RecordedPosition(self._position_on(at, modes), _middle(as_place(at)))

    def mounted(self: Self, factor: float, modes: Modes) -> Self:
        """Return it mounted at the same place with `factor` times its tolerance.

        Raises
        ------
        ValueError
            If it has no tolerance.
        """
        if self.tolerance is None:
            raise InputError(
                f'{self.kind} "{self.name}" was to have {factor:g} times its tolerance, but it has '
                "none; one is needed, since a distribution cannot be scaled. Declare "
                "at=positions.Segment(0.25, within=0.04)."
            )
        return self.like(self.name, self.tolerance.scaled(factor), self.recorded).on(modes)

    def like(self: Self, name: str, at: At, recorded: Recorded | None = None) -> Self:
        """Return a transducer like this one of another name, at another place [m].

        Parameters
        ----------
        name
            Its name.
        at
            Where it sits.
        recorded
            Recorded position [m]; by default the middle of `at`.
        """
        return type(self)(name, at, **self._settings(), recorded=recorded)

    def at_record(self, component: str) -> object:
        """Value of an unknown component of its position where it was recorded."""
        return RecordedPosition(self.position, self.recorded).at_record(component)

    def points(self, axes: tuple[int, ...], *, with_slopes: bool = False) -> Points:
        """Where and along what its channels read or drive a structure that moves along axes.

        Parameters
        ----------
        axes
            Axes along which the structure moves, 1 to 3 for x to z.
        with_slopes
            Whether to read slopes too where it has no arm, as another transducer has one.
        """
        vectors = self._directions(axes)
        position = coordinates(self.position)
        at = jnp.broadcast_to(position, (len(vectors), *position.shape))
        if self.arm is None and not with_slopes:
            return Points(at, vectors)
        return on_arms(at, vectors, jnp.asarray(0.0 if self.arm is None else self.arm, float))

    def shapes(self, modes: Modes) -> Shapes:
        """Mode shapes read by its channels, the rows of [O][Phi] of Eq. (14)."""
        return self.points(modes.axes).shapes(modes)

    def factor(self, omega: Inexact[Array, "frequency"]) -> Inexact[Array, "frequency"] | None:
        """Factor of its gain and its delay on its FRFs [1]; None where both are exact."""
        if self.gain is None and self.delay is None:
            return None
        gain = jnp.asarray(1.0 if self.gain is None else self.gain)
        if self.delay is None:
            return jnp.broadcast_to(gain, omega.shape)
        return gain * jnp.exp(-1j * omega * self.delay)

    def _directions(self, axes: tuple[int, ...]) -> Float[Array | np.ndarray, "channel axis"]:
        vectors: Array | np.ndarray = np.stack([unit_vector(each) for each in self.directions])
        if self.angles is not None:
            vectors = vectors @ rotation(jnp.stack([jnp.asarray(a) for a in self.angles])).T
        return vectors[:, np.array(axes) - 1]


def _middle(at: Position | Tolerance) -> Recorded:
    if isinstance(at, Tolerance):
        return at.recorded
    if isinstance(at, Place):
        return at.middle()
    return triple(at.mean) if is_unknown(at) and at.shape() == (3,) else mean(at)


def _unless(exact: float, value: Parameter | None) -> Parameter | None:
    """Return a number or distribution; None where it is exactly what changes nothing."""
    if value is None or is_open(value):
        return value
    return None if np.ndim(value) == 0 and value == exact else value


def _number(value: Any) -> float:
    """Return a gain or a delay as a number, NaN for several; 1 where it is not known yet."""
    known = isinstance(value, int | float | np.ndarray | np.generic | jax.Array)
    if not known or isinstance(value, jax.core.Tracer):
        return 1.0
    return float(value) if np.ndim(value) == 0 else math.nan


def _recorded(position: Any) -> Recorded:
    return float(position) if np.ndim(position) == 0 else triple(position)


class Sensor(Transducer):
    """A sensor: it reads the motion where it sits. See `Transducer` for the arguments.

    Examples
    --------
    >>> bp.Sensor("s1", at=bp.positions.Segment(0.2, within=0.02))
    Sensor "s1" at 0.2 m
    >>> tilted = (dist.Uniform(-0.1, 0.1), 0.0, 0.0)  # rad about the axes of the structure
    >>> bp.Sensor("s2", at=(0.5, 0.4, 0.0), directions=(3,), angles=tilted)
    Sensor "s2" at (0.5, 0.4, 0) m, angles.1 Uniform(-0.1, 0.1)
    """

    kind: ClassVar[str] = "Sensor"


class Actuator(Transducer):
    """An actuator or a hammer hit: it drives where it sits. See `Transducer`.

    Examples
    --------
    >>> force_cell = dist.Normal(1.0, 0.01)
    >>> bp.Actuator("a1", at=bp.positions.Segment(0.3, within=0.01), gain=force_cell)
    Actuator "a1" at 0.3 m, gain Normal(1, 0.01)
    """

    kind: ClassVar[str] = "Actuator"
