"""Modes of uniform bars and Euler-Bernoulli beams in closed form."""

import functools
from types import ModuleType
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._shared.arguments import arguments_checked, check_count, finite_number
from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ..._shared.ranges import POSITIVE
from ..._shared.sites import check_numbers, check_scalar, is_open, is_unknown, unit
from ..modes import AxisShapes, Coordinates
from . import _beam_statics
from .waveguide import Waveguide, cosine_and_sine

__all__ = ["UniformBar", "UniformBeam", "bar", "beam"]

Numbers = Float[Array | np.ndarray, "..."]
_SYNONYMS = {"clamped": "fixed", "supported": "pinned"}


class UniformBar(Waveguide):
    """Axial modes of a uniform bar; made by `bar`.

    Examples
    --------
    >>> bar.ends, bar.bounds(), np.asarray(bar.natural_frequency[:2]).round(1)
    (('fixed', 'fixed'), (0.0, 1.0), array([166.7, 333.3]))
    """

    half_order: ClassVar[int] = 1

    @property
    def stiffness(self) -> Parameter:
        """Axial stiffness E A [N]."""
        check_numbers(self, "stiffness")
        return self.youngs_modulus * self.area

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies k sqrt(E / rho) / L [rad/s]."""
        check_numbers(self, "angular_frequency()")
        speed = jnp.sqrt(self.youngs_modulus / self.density)
        return jnp.array(self.wave_numbers) * speed / self.length

    def shapes(self, position: Coordinates, derivative: int = 0) -> AxisShapes:
        """Mass-normalised axial shapes [kg^-1/2], or their derivatives [kg^-1/2 m^-order]."""
        k = jnp.array(self.wave_numbers)
        cosine_first = derivative + (self.ends[0] == "fixed") * 3
        wave = _waves(k * position / self.length)[cosine_first % 4]
        mean_square = jnp.where(k == 0, 1.0, 0.5)
        mass = self.density * self.area * self.length
        scale = (k / self.length) ** derivative
        return (scale * wave / jnp.sqrt(mean_square * mass))[None, :]


class UniformBeam(Waveguide):
    """Bending modes of a uniform Euler-Bernoulli beam; made by `beam`.

    Examples
    --------
    >>> sizes = {"length": 1.0, "area": 1e-4, "second_moment": 1e-9}
    >>> beam = bp.beams.beam(3, **sizes, youngs_modulus=7e10, density=2700.0, ends="clamped-free")
    >>> beam.ends, beam.rigid_body_modes, beam.bounds()
    (('fixed', 'free'), 0, (0.0, 1.0))
    """

    radius_of_gyration: Parameter | None = eqx.field(metadata=unit("m", within=POSITIVE))
    second_moment: Parameter | None = eqx.field(metadata=unit("m4", within=POSITIVE))
    coefficients: tuple[tuple[float, ...], ...] = eqx.field(static=True, repr=False)
    half_order: ClassVar[int] = 2

    @property
    def stiffness(self) -> Parameter:
        """Bending stiffness E I [N m2]."""
        check_numbers(self, "stiffness")
        if self.second_moment is None:
            return self.youngs_modulus * self.area * self._radius() ** 2
        return self.youngs_modulus * self.second_moment

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies b^2 sqrt(E I / (rho A)) / L^2 [rad/s]."""
        check_numbers(self, "angular_frequency()")
        speed = jnp.sqrt(self.youngs_modulus / self.density)
        return jnp.array(self.wave_numbers) ** 2 * speed * self._radius() / self.length**2

    def _radius(self) -> Parameter:
        if self.second_moment is None:
            return self.radius_of_gyration
        return jnp.sqrt(self.second_moment / self.area)

    def shapes(self, position: Coordinates, derivative: int = 0) -> AxisShapes:
        """Mass-normalised bending shapes [kg^-1/2], or their derivatives [kg^-1/2 m^-order]."""
        terms = _terms(position / self.length, jnp.array(self.wave_numbers), derivative)
        unit_mass = jnp.sum(terms * jnp.array(self.coefficients), axis=-1)
        mass = self.density * self.area * self.length
        return unit_mass[None, :] / (jnp.sqrt(mass) * self.length**derivative)

    def slope_matrix(self) -> Float[Array, "mode mode"]:
        """Integrals of phi_n' phi_m' over the length [1/(kg m)]."""
        return self._integrals(1)

    def shear_matrix(self) -> Float[Array, "mode mode"]:
        """Integrals of phi_n''' phi_m''' over the length [1/(kg m5)]."""
        return self._integrals(3)

    def _integrals(self, derivative: int) -> Float[Array, "mode mode"]:
        unit_mass = _products(self.wave_numbers, self.coefficients, derivative)
        mass = self.density * self.area * self.length
        return self.length ** (1 - 2 * derivative) / mass * jnp.asarray(unit_mass)


@arguments_checked
def bar(
    modes: int,
    *,
    length: Parameter,
    area: Parameter,
    youngs_modulus: Parameter,
    density: Parameter,
    ends: str = "fixed-fixed",
    direction: int = 1,
    static_correction: bool = True,
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
    static_correction
        Whether the static flexibility of the modes left out is added to every receptance. False
        gives the plain modal sum (section 5.1 of the paper).

    Returns
    -------
    UniformBar
        Closed-form mass-normalised modes, sqrt(2 / (rho S L)) sin(a pi x / L) for fixed ends
        (section 5.1 of the paper, there without the mass).

    Raises
    ------
    InputError
        For an unknown end, a number of modes below one or a quantity that is not positive.

    Examples
    --------
    >>> rod = bp.beams.bar(3, length=2.0, area=1e-3, youngs_modulus=7e10, density=2700.0)
    >>> np.asarray(rod.natural_frequency).round(1)
    array([1272.9, 2545.9, 3818.8])
    """
    _check(modes, length=length, area=area, youngs_modulus=youngs_modulus, density=density)
    left, right = ("fixed" if end == "pinned" else end for end in _ends(ends))
    if "guided" in (left, right):
        raise InputError(
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
        ends=(left, right),
        rigid_body_modes=int(shift == 0.0),
        axes=_axes(direction),
        static_correction=static_correction,
    )


@arguments_checked
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
    static_correction: bool = True,
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
        area: one of the two. With the radius given, an unknown area is an unknown mass and does not
        change the natural frequencies.
    ends
        Left and right end, each `fixed` (or `clamped`), `free`, `pinned` or `guided`.
    direction
        Recorded direction of its motion, 1, 2 or 3 for x, y or z.
    static_correction
        Whether the static flexibility of the modes left out is added to every receptance. False
        gives the plain modal sum (section 5.1 of the paper).

    Returns
    -------
    UniformBeam
        Closed-form mass-normalised modes, free of overflow at any mode number.

    Raises
    ------
    InputError
        For an unknown end, a number of modes below one or a quantity that is not positive.

    Examples
    --------
    >>> sizes = {"length": 1.0, "area": 1e-4, "second_moment": 1e-9}
    >>> beam = bp.beams.beam(3, **sizes, youngs_modulus=7e10, density=2700.0, ends="clamped-free")
    >>> np.asarray(beam.natural_frequency).round(2)
    array([  9.01,  56.47, 158.11])
    """
    material = {"youngs_modulus": youngs_modulus, "density": density}
    section = {"second_moment": second_moment, "radius_of_gyration": radius_of_gyration}
    _check_section(section)
    _check(modes, length=length, area=area, **section, **material)
    left, right = _ends(ends)
    rigid = _beam_statics.rigid_shapes(left, right)[:modes]
    roots, elastic = _elastic(left, right, modes - len(rigid))
    return UniformBeam(
        length=length,
        area=area,
        **section,
        **material,
        wave_numbers=(*(0.0 for _ in rigid), *roots),
        coefficients=(*(tuple(shape.tolist()) for shape in rigid), *elastic),
        ends=(left, right),
        rigid_body_modes=len(rigid),
        axes=_axes(direction),
        static_correction=static_correction,
    )


def _waves(phase: Numbers, library: object = jnp) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Cosine and its derivatives; the last is the sine."""
    cosine, sine = (
        cosine_and_sine(jnp.asarray(phase)) if library is jnp else (np.cos(phase), np.sin(phase))
    )
    return cosine, -sine, -cosine, sine


def _terms(x: Numbers, b: Numbers, derivative: int, library: ModuleType = jnp) -> Numbers:
    """Derivative of the six terms of a beam's shape, in unit length."""
    waves = _waves(b * x, library)
    constant, growth = library.ones_like(b * x), b**derivative
    terms = [
        constant * float(derivative == 0),
        constant * (x if derivative == 0 else float(derivative == 1)),
        growth * waves[derivative % 4],
        growth * waves[(derivative + 3) % 4],
        growth * (-1) ** derivative * library.exp(-b * x),
        growth * library.exp(-b * (1 - x)),
    ]
    return library.stack(terms, axis=-1)


@functools.cache
def _elastic(
    left: str, right: str, count: int
) -> tuple[tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Wave numbers and shape coefficients of the first elastic modes, in unit length and mass."""
    roots = _beam_statics.elastic_roots(left, right, count)
    shapes = [_beam_statics.elastic_shape(left, right, root) for root in roots]
    return tuple(roots.tolist()), tuple(tuple(shape.tolist()) for shape in shapes)


@functools.cache
def _products(wave_numbers: tuple[float, ...], coefficients: object, derivative: int) -> np.ndarray:
    """Integrals of products of derivatives of the shapes, in unit length and mass."""
    # Sixteen Gauss nodes in each half wave of the steepest shape: exact to rounding.
    node, weight = np.polynomial.legendre.leggauss(16)
    panels = 1 + int(max(wave_numbers) / np.pi)
    x = ((np.arange(panels)[:, None] + (node + 1) / 2) / panels).reshape(-1, 1)
    terms = _terms(x, np.array(wave_numbers), derivative, np)
    values = np.sum(terms * np.array(coefficients), axis=-1)
    return values.T @ (np.tile(weight, panels)[:, None] / (2 * panels) * values)


def _ends(ends: str) -> tuple[str, str]:
    words = [_SYNONYMS.get(word, word) for word in ends.lower().split("-")]
    known = {"fixed", "free", "pinned", "guided"}
    if len(words) != 2 or not set(words) <= known:
        raise InputError(
            f"ends={ends!r} is not understood. Give the left and the right end, each one of "
            "fixed (or clamped), free, pinned, guided, joined by a hyphen: ends='fixed-free'."
        )
    return words[0], words[1]


def _axes(direction: int) -> tuple[int, ...]:
    if direction not in (1, 2, 3):
        raise InputError(
            f"direction={direction} was given; the motion is recorded along 1, 2 or 3 for x, y or "
            "z: direction=3."
        )
    return (direction,)


def _check_section(section: dict[str, Parameter | None]) -> None:
    present = [name for name, value in section.items() if value is not None]
    if len(present) != 1:
        raise InputError(
            f"beams.beam was given {' and '.join(present) or 'no bending stiffness'}; it needs "
            "exactly one of second_moment [m4] and radius_of_gyration [m], since one follows from "
            "the other: second_moment=width * height**3 / 12."
        )


LEAST, LARGEST = 1e-40, 1e30
"""Least and greatest number that is taken; the second moment of a beam of atoms is 1e-40 m4."""

_EITHER = ("second_moment", "radius_of_gyration")


def _check(modes: int, **quantities: Parameter | None) -> None:
    if isinstance(modes, int) and modes < 1:
        raise InputError(f"modes={modes} was given; at least one mode is needed: modes=15.")
    check_count("modes", modes, 1, "modes=15")
    for name, value in quantities.items():
        if isinstance(value, int | float) and not value > 0:
            raise InputError(
                f"{name}={value} was given; it must be positive, since it divides or scales the "
                f"natural frequencies. Give it in SI units: {name}=1.0."
            )
        if is_unknown(value):
            check_scalar(name, value)
        if isinstance(value, int | float) and not LEAST <= value <= LARGEST:
            raise InputError(
                f"{name}={value} was given; a number from {LEAST:g} to {LARGEST:g} in SI units is "
                f"needed, since no structure has another and none is computed: {name}=1.0."
            )
        present = value is not None or name not in _EITHER
        if present and not is_open(value):
            finite_number(name, value, f"{name}=1.0, or a distribution")
