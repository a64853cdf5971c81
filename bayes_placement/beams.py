"""beams: in, length, section and material of a uniform line structure; out, its closed-form modes.

Not known here: damping, sensors, probability.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from . import _beam_roots
from ._sites import is_unknown, unit
from ._types import Parameter
from .modes import Modes

_SYNONYMS = {"clamped": "fixed", "supported": "pinned"}


class UniformBar(Modes):
    """Axial modes of a uniform bar; made by `bar`."""

    length: Parameter = eqx.field(metadata=unit("m"))
    area: Parameter = eqx.field(metadata=unit("m2"))
    youngs_modulus: Parameter = eqx.field(metadata=unit("Pa"))
    density: Parameter = eqx.field(metadata=unit("kg/m3"))
    wave_numbers: tuple[float, ...] = eqx.field(static=True)
    left_end_is_free: bool = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True)

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies k sqrt(E / rho) / L [rad/s]."""
        speed = jnp.sqrt(self.youngs_modulus / self.density)
        return jnp.array(self.wave_numbers) * speed / self.length

    def shapes(self, position: Float[Array, "*coordinate"]) -> Float[Array, "axis mode"]:
        """Mass-normalised axial shapes [kg^-1/2]."""
        k = jnp.array(self.wave_numbers)
        phase = k * position / self.length
        wave = jnp.cos(phase) if self.left_end_is_free else jnp.sin(phase)
        mean_square = jnp.where(k == 0, 1.0, 0.5)
        mass = self.density * self.area * self.length
        return (wave / jnp.sqrt(mean_square * mass))[None, :]

    def bounds(self) -> tuple[float, float]:
        """Return the two ends of the bar [m]."""
        return 0.0, _least(self.length)


class UniformBeam(Modes):
    """Bending modes of a uniform Euler-Bernoulli beam; made by `beam`."""

    length: Parameter = eqx.field(metadata=unit("m"))
    area: Parameter = eqx.field(metadata=unit("m2"))
    radius_of_gyration: Parameter | None = eqx.field(metadata=unit("m"))
    second_moment: Parameter | None = eqx.field(metadata=unit("m4"))
    youngs_modulus: Parameter = eqx.field(metadata=unit("Pa"))
    density: Parameter = eqx.field(metadata=unit("kg/m3"))
    wave_numbers: tuple[float, ...] = eqx.field(static=True)
    coefficients: tuple[tuple[float, ...], ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True)

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies b^2 sqrt(E I / (rho A)) / L^2 [rad/s]."""
        speed = jnp.sqrt(self.youngs_modulus / self.density)
        return jnp.array(self.wave_numbers) ** 2 * speed * self._radius() / self.length**2

    def _radius(self) -> Parameter:
        if self.second_moment is None:
            return self.radius_of_gyration
        return jnp.sqrt(self.second_moment / self.area)

    def shapes(self, position: Float[Array, "*coordinate"]) -> Float[Array, "axis mode"]:
        """Mass-normalised bending shapes [kg^-1/2], smooth in position."""
        b = jnp.array(self.wave_numbers)
        x = position / self.length
        one = jnp.ones_like(b)
        waves = [jnp.cos(b * x), jnp.sin(b * x), jnp.exp(-b * x), jnp.exp(-b * (1 - x))]
        terms = jnp.stack([one, x * one, *waves], axis=-1)
        mass = self.density * self.area * self.length
        return jnp.sum(terms * jnp.array(self.coefficients), axis=-1)[None, :] / jnp.sqrt(mass)

    def bounds(self) -> tuple[float, float]:
        """Return the two ends of the beam [m]."""
        return 0.0, _least(self.length)


def bar(
    modes: int,
    *,
    length: Parameter,
    area: Parameter,
    youngs_modulus: Parameter,
    density: Parameter,
    ends: str = "fixed-fixed",
    direction: int = 1,
) -> UniformBar:
    """Uniform bar in axial motion.

    Parameters
    ----------
    modes
        Number of modes kept, rigid-body modes included.
    length, area, youngs_modulus, density
        Length [m], section [m2], Young's modulus [Pa], density [kg/m3]: numbers or distributions.
    ends
        Left and right end, each `fixed` (or `clamped`, `pinned`: the same for axial motion) or
        `free`.
    direction
        Recorded direction of its motion, 1, 2 or 3 for x, y or z.

    Returns
    -------
    UniformBar
        Closed-form mass-normalised modes, sqrt(2 / (rho S L)) sin(a pi x / L) for fixed ends
        (section 5.1 of the paper, there without the mass).

    Raises
    ------
    ValueError
        For an unknown end, a number of modes below one or a quantity that is not positive.
    """
    _check(modes, length=length, area=area, youngs_modulus=youngs_modulus, density=density)
    left, right = ("fixed" if end == "pinned" else end for end in _ends(ends))
    if "guided" in (left, right):
        raise ValueError(
            f"ends={ends!r} has a guided end, but a bar moves along its axis only, where an end "
            "is either fixed or free. Use beams.beam for bending, or ends='fixed-free'."
        )
    shift = {("fixed", "fixed"): 1.0, ("free", "free"): 0.0}.get((left, right), 0.5)
    wave_numbers = np.pi * (np.arange(modes) + shift)
    return UniformBar(
        length=length,
        area=area,
        youngs_modulus=youngs_modulus,
        density=density,
        wave_numbers=tuple(wave_numbers.tolist()),
        left_end_is_free=left == "free",
        rigid_body_modes=int(shift == 0.0),
        axes=_axes(direction),
    )


def beam(
    modes: int,
    *,
    length: Parameter,
    area: Parameter,
    second_moment: Parameter | None = None,
    radius_of_gyration: Parameter | None = None,
    youngs_modulus: Parameter,
    density: Parameter,
    ends: str = "fixed-free",
    direction: int = 3,
) -> UniformBeam:
    """Uniform Euler-Bernoulli beam in bending.

    Parameters
    ----------
    modes
        Number of modes kept, rigid-body modes included (two for a free beam).
    length, area, youngs_modulus, density
        Length [m], section [m2], Young's modulus [Pa], density [kg/m3]: numbers or distributions.
    second_moment, radius_of_gyration
        Second moment of area [m4], or its radius of gyration [m], the root of second moment over
        area: one of the two. With the radius given, an unknown area is an unknown mass and leaves
        the natural frequencies alone.
    ends
        Left and right end, each `fixed` (or `clamped`), `free`, `pinned` or `guided`.
    direction
        Recorded direction of its motion, 1, 2 or 3 for x, y or z.

    Returns
    -------
    UniformBeam
        Closed-form mass-normalised modes, free of overflow at any mode number.

    Raises
    ------
    ValueError
        For an unknown end, a number of modes below one or a quantity that is not positive.
    """
    material = {"youngs_modulus": youngs_modulus, "density": density}
    section = {"second_moment": second_moment, "radius_of_gyration": radius_of_gyration}
    _check_section(section)
    _check(modes, length=length, area=area, **section, **material)
    left, right = _ends(ends)
    rigid = _beam_roots.rigid_shapes(left, right)[:modes]
    roots = _beam_roots.elastic_roots(left, right, modes - len(rigid))
    elastic = [_beam_roots.elastic_shape(left, right, root) for root in roots]
    return UniformBeam(
        length=length,
        area=area,
        **section,
        **material,
        wave_numbers=(*(0.0 for _ in rigid), *roots.tolist()),
        coefficients=tuple(tuple(shape.tolist()) for shape in [*rigid, *elastic]),
        rigid_body_modes=len(rigid),
        axes=_axes(direction),
    )


def _ends(ends: str) -> tuple[str, str]:
    words = [_SYNONYMS.get(word, word) for word in ends.lower().split("-")]
    known = {"fixed", "free", "pinned", "guided"}
    if len(words) != 2 or not set(words) <= known:
        raise ValueError(
            f"ends={ends!r} is not understood. Give the left and the right end, each one of "
            "fixed (or clamped), free, pinned, guided, joined by a hyphen: ends='fixed-free'."
        )
    return words[0], words[1]


def _axes(direction: int) -> tuple[int, ...]:
    if direction not in (1, 2, 3):
        raise ValueError(
            f"direction={direction} was given; the motion is recorded along 1, 2 or 3 for x, y or "
            "z: direction=3."
        )
    return (direction,)


def _check_section(section: dict[str, Parameter | None]) -> None:
    given = [name for name, value in section.items() if value is not None]
    if len(given) != 1:
        raise ValueError(
            f"beams.beam was given {' and '.join(given) or 'no bending stiffness'}; it needs "
            "exactly one of second_moment [m4] and radius_of_gyration [m], since one follows from "
            "the other: second_moment=width * height**3 / 12."
        )


def _check(modes: int, **quantities: Parameter | None) -> None:
    if modes < 1:
        raise ValueError(f"modes={modes} was given; at least one mode is needed: modes=15.")
    for name, value in quantities.items():
        if isinstance(value, int | float) and not value > 0:
            raise ValueError(
                f"{name}={value} was given; it must be positive, since it divides or scales the "
                f"natural frequencies. Give it in SI units: {name}=1.0."
            )


def _least(length: Parameter) -> float:
    """Give the least length that a number or a prior allows: what fits there always fits."""
    if is_unknown(length):
        return float(length.support.lower_bound)  # type: ignore[union-attr]
    return float(length)  # type: ignore[arg-type]
