"""Poles of a structure with all its linear effects, what sensors read, and which is measured."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Complex, Float, Inexact, Int

from ..effects.instrument_effect import InstrumentEffect
from ..effects.instruments import Instruments
from ..modes.modes import Modes
from ..modes.points import Points, along_axes, joined
from ..modes.ports import PortLaw
from ..positions.places import coordinates
from .closure import in_series
from .frf import ModeError, linear_laws
from .model_error import ModalErrors
from .recording import amplified
from .structure import Structure

REAL_STEPS, COMPLEX_STEPS = 5, 3
"""Newton's steps to a natural frequency without damping, and from there to the pole."""

Matrix = Inexact[Array, "mode mode"]
Vector = Inexact[Array, "mode"]
Frequency = Inexact[Array, ""]
Matrices: TypeAlias = Callable[[Frequency], tuple[Matrix, Matrix]]
Guess: TypeAlias = tuple[Frequency, Vector]


class Branches(NamedTuple):
    """Every mode as it is seen from one angular frequency."""

    omega: Float[Array, "branch"]
    """Estimates of natural angular frequencies [rad/s], exact where the stiffness of what is
    attached is one of a spring or mass."""
    vector: Float[Array, "mode branch"]
    """Amplitudes of the modes of the structure proper, a column for each."""


class Oscillator(NamedTuple):
    """A structure with its instruments, in the coordinates of the modes of the structure proper.

    (diag(omega_n^2 m + l) + Phi_p' (1/Z + R/m)^-1 Phi_p - omega^2) q = 0 with the relative modulus
    m, the loss l of the damping law, and attachments of dynamic stiffness Z at ports p, R being the
    static flexibility of the modes left out (MacNeal 1971, DOI 10.1016/0045-7949(71)90031-9).
    """

    structure: Structure
    instruments: Instruments
    effects: Sequence[InstrumentEffect]
    errors: ModalErrors | None
    """What is seen; instruments are where they truly sat."""
    modes: Modes
    """Modes of the structure proper."""
    mode_error: ModeError | None
    """Errors of modes, or None."""
    ports: "Ports | None" = None
    """Ports of all attachments and of instruments that load the structure; None without any."""

    @classmethod
    def of(
        cls,
        structure: Structure,
        instruments: Instruments,
        effects: Sequence[InstrumentEffect],
        errors: ModalErrors | None,
    ) -> "Oscillator":
        """Move the instruments to where they sat, and compute the modes."""
        for effect in effects:
            instruments = effect.moved(instruments, structure.modes)
        modes = structure.proper_modes()
        mode_error = None if errors is None else errors.mode_error()
        if mode_error is not None:
            modes = mode_error.uneven(modes)
        free = cls(structure, instruments, effects, errors, modes, mode_error)
        laws = free._laws(jnp.ones(1))
        if not laws:
            return free
        points = joined([law.points for law in laws])
        left_out = points.flexibility_left_out(modes, points)
        to_sensors = free._points().flexibility_left_out(modes, points)
        return free._replace(ports=Ports(points.shapes(modes), left_out, to_sensors))

    def matrix(self, omega: Float[Array, ""]) -> Matrix:
        """Modal dynamic stiffness without inertia [(rad/s)^2], complex."""
        line = omega[None]
        structure, modulus = self.structure, self.structure.relative_modulus(line)[0]
        natural = self.modes.angular_frequency()
        factor = None if self.mode_error is None else self.mode_error.over(natural.size)
        natural = natural if factor is None else natural * factor.frequency
        loss = structure.damping.loss(natural, line, self.modes.rigid_body_modes)[:, 0]
        loss = loss if factor is None else loss * factor.damping
        diagonal = jnp.diag(natural**2 * modulus + loss * structure.kept_damping() + 0j)
        if self.ports is None:
            return diagonal
        return diagonal + self.ports.shapes.T @ self._attached(line) @ self.ports.shapes

    def branches(self, omega: Float[Array, ""]) -> Branches:
        """Every mode as it is seen from one frequency, without damping; no gradient passes."""
        undamped, slope = jax.jvp(lambda at: jnp.real(self.matrix(at)), (omega,), (1.0,))
        undamped, slope = (jax.lax.stop_gradient(part) for part in (undamped, slope))
        values, vectors = jnp.linalg.eigh((undamped + undamped.T) / 2)
        slopes = jnp.einsum("nb,nm,mb->b", vectors, slope, vectors)
        # lambda + slope (x - omega) = x^2
        square = jnp.maximum(slopes**2 + 4 * (values - slopes * omega), 0.0)
        return Branches(jnp.maximum((slopes + jnp.sqrt(square)) / 2, 1e-300), vectors)

    def pole(
        self, omega: Float[Array, ""], vector: Float[Array, "mode"]
    ) -> tuple[Complex[Array, ""], Complex[Array, "mode"]]:
        """Pole over i [rad/s] and amplitudes of the modes there, from a guess without damping.

        The matrix is expanded about the natural frequency without damping, to the second order,
        which is exact for masses, dashpots and springs.
        """
        start = jax.lax.stop_gradient((omega, vector))

        def undamped(at: object) -> tuple[Matrix, Matrix]:
            value, slope = jax.jvp(lambda x: jnp.real(self.matrix(x)), (at,), (1.0,))
            return jax.lax.stop_gradient((value, slope))

        middle, vector = _repeated(undamped, start, start[1], REAL_STEPS)
        expanded = self._expansion(middle)
        fixed = jax.lax.stop_gradient(expanded)
        damped = middle + 0j, vector + 0j
        approximate = _repeated(_about(middle, fixed), damped, start[1], COMPLEX_STEPS)
        # One more step from a constant carries the derivative of the pole, exactly.
        return _newton(_about(middle, expanded), *jax.lax.stop_gradient(approximate), start[1])

    def read(
        self, vectors: Inexact[Array, "mode branch"], omega: Float[Array, "branch"]
    ) -> Complex[Array, "channel branch"]:
        """Shapes as the sensors recorded them, of amplitudes at real angular frequencies."""
        points = self._points()
        shapes = points.shapes(self.modes) @ vectors + 0j
        if self.ports is not None:
            shapes = shapes + jax.vmap(self._bent, (1, 0), 1)(vectors, omega)
        record = shapes[:, None, :]
        if self.errors is not None:
            gain = self.errors.gain_factors(self.instruments, "sensor")
            record = record * gain[:, None, None]
        record = amplified(record, self.instruments, omega)
        for effect in self.effects:
            record = effect.recorded(record, omega, self.instruments)
        return record[:, 0]

    def _bent(self, vector: Vector, omega: Float[Array, ""]) -> Inexact[Array, "channel"]:
        """What the forces of attachments bend that the kept modes leave out."""
        line, ports = omega[None], self.ports
        assert ports is not None
        force = self._attached(line) @ ports.shapes @ vector
        return -ports.to_sensors @ force / self.structure.relative_modulus(line)[0]

    def _points(self) -> Points:
        points = self.instruments.points("sensor", self.modes.axes)
        error = None if self.errors is None else self.errors.shape_error(self.instruments, "sensor")
        return dataclasses.replace(points, shape_error=error)

    def _laws(self, line: Float[Array, "1"]) -> list[PortLaw]:
        """Laws of all attachments and of instruments that load the structure, on their ports."""
        laws = linear_laws(self.structure, self.modes, line, self.mode_error)
        for number, sensor in enumerate(self.instruments.sensors.values()):
            place = along_axes(coordinates(sensor.position), self.modes)
            laws += [
                PortLaw(place, effect.load("sensor", number, line))
                for effect in self.effects
                if "sensor" in effect.loads
            ]
        return laws

    def _attached(self, line: Float[Array, "1"]) -> Inexact[Array, "port port"]:
        """Dynamic stiffness at the ports, in series with the modes left out."""
        assert self.ports is not None
        modulus = self.structure.relative_modulus(line)[0]
        return in_series(self._laws(line), self.ports.flexibility / modulus)

    def _expansion(self, omega: Float[Array, ""]) -> tuple[Matrix, Matrix, Matrix]:
        """Matrix at an angular frequency, its derivative and its second derivative."""

        def first(at: object) -> tuple[Matrix, Matrix]:
            return jax.jvp(self.matrix, (at,), (1.0,))

        (value, slope), (_, curve) = jax.jvp(first, (omega,), (1.0,))
        return value, slope, curve


class Ports(NamedTuple):
    """What is known of ports whatever the frequency: compiled once, since it takes most of that."""

    shapes: Float[Array, "port mode"]
    """Shapes there."""
    flexibility: Float[Array, "port port"]
    """Flexibility of the modes left out, between them."""
    to_sensors: Float[Array, "channel port"]
    """The same from them to what the sensors read."""


def _about(middle: Frequency, expansion: tuple[Matrix, Matrix, Matrix]) -> Matrices:
    """Matrix and its derivative by an expansion about an angular frequency."""
    value, slope, curve = expansion

    def at(omega: Frequency) -> tuple[Matrix, Matrix]:
        step = omega - middle
        return value + step * (slope + step / 2 * curve), slope + step * curve

    return at


def _repeated(matrix: Matrices, start: Guess, normal: Vector, steps: int) -> Guess:
    """Some of Newton's steps, compiled once."""

    def step(_: object, guess: Guess) -> Guess:
        omega, vector = guess
        return _newton(matrix, omega, vector, normal)

    return jax.lax.fori_loop(0, steps, step, start)


def _newton(matrix: Matrices, omega: Frequency, vector: Vector, normal: Vector) -> Guess:
    """One of Newton's steps for (A(omega) - omega^2) q = 0 with normal . q = 1."""
    value, slope = matrix(omega)
    size = vector.size
    stiffness = value - omega**2 * jnp.eye(size)
    column = slope @ vector - 2 * omega * vector
    bordered = jnp.block(
        [[stiffness, column[:, None]], [normal[None] + 0 * column, jnp.zeros((1, 1))]]
    )
    error = jnp.concatenate([stiffness @ vector, (normal @ vector - 1)[None]])
    step = jnp.linalg.solve(bordered, error)
    return omega - step[-1], vector - step[:-1]


FREQUENCY_TOLERANCE = 0.1
"""Relative difference of natural frequencies that a model may well have."""

SHAPE_TOLERANCE = 0.05
"""Part that a model may well lack of a modal assurance criterion of 1, besides what noise takes."""

SAME = 0.02
"""Relative difference below which two estimates of one branch are the same mode."""


FAR = 1e20
"""Distance of a mode that is another one already."""


class MeasuredShapes(NamedTuple):
    """Natural angular frequencies [rad/s] and shapes, zero where nothing was measured."""

    omega: Float[Array, "mode"]
    shape: Float[Array, "mode channel"]
    deviation: Float[Array, "mode channel"]
    present: Bool[Array, "mode channel"]


def paired(
    measured: MeasuredShapes,
    omega: Float[Array, "mode branch"],
    shapes: Inexact[Array, "mode channel branch"],
) -> Int[Array, "mode"]:
    """Number of the branch of each measured mode, the nearest pair first.

    Natural angular frequencies [rad/s] and shapes of all branches are those seen from the frequency
    of each measured mode.
    """
    shift = jnp.log(omega / measured.omega[:, None])
    criterion, lost = jax.vmap(assurance)(measured, shapes)
    distance = (shift / FREQUENCY_TOLERANCE) ** 2
    distance += (1 - criterion) / (SHAPE_TOLERANCE + lost[:, None])
    count = omega.shape[1]

    def take(state: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], None]:
        distance, chosen = state
        mode, branch = jnp.divmod(jnp.argmin(distance), count)
        same_branch = jnp.abs(jnp.log(omega[:, branch] / omega[mode, branch])) < SAME
        distance = distance.at[:, branch].set(
            distance[:, branch] + jnp.where(same_branch, FAR, 0.0)
        )
        return (distance.at[mode].set(jnp.inf), chosen.at[mode].set(branch)), None

    start = jnp.nan_to_num(distance, nan=FAR, posinf=FAR), jnp.zeros(len(omega), int)
    (_, chosen), _ = jax.lax.scan(take, start, length=len(omega))
    return chosen


def assurance(
    measured: MeasuredShapes, shapes: Inexact[Array, "channel branch"]
) -> tuple[Float[Array, "branch"], Float[Array, ""]]:
    """Modal assurance criterion with each branch, and what noise takes from that of the right one.

    Of n errors of deviation s, n - 1 turn a shape of length L: 1 - MAC is about (n - 1) s^2 / L^2.
    """
    seen = jnp.where(measured.present[:, None], shapes, 0.0)
    product = jnp.abs(measured.shape @ seen) ** 2
    length = jnp.sum(measured.shape**2)
    sizes = length * jnp.sum(jnp.abs(seen) ** 2, axis=0)
    count = jnp.sum(measured.present)
    lost = jnp.sum(measured.deviation**2) * (count - 1) / jnp.maximum(count * length, 1e-300)
    return product / jnp.where(sizes > 0, sizes, 1.0), lost
