"""Damping laws: the loss that each adds to the stiffness of every mode."""

import abc
import dataclasses
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Inexact
from numpyro.distributions import Delta, Distribution, constraints

from .._shared.arguments import check_annotated, shown
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import LOSS_FACTOR, SHARE_OF_CRITICAL
from .._shared.reprs import with_short_repr
from .._shared.sites import is_unknown, unit
from ..effects.effect import Omega

Loss = Complex[Array, "mode frequency"]
Natural = Float[Array, "mode"]

OVERDAMPED = 1.0
"""Share of the stiffness matrix [s] with which all modes above 1 / (pi s) are overdamped."""


@with_short_repr
class Damping(eqx.Module):
    """A damping law: what it adds to omega_n^2 - omega^2 in every mode.

    Its fields are numbers, or distributions without negative values.

    Examples
    --------
    >>> issubclass(bp.damping.Rayleigh, bp.damping.Damping)
    True
    """

    @abc.abstractmethod
    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss [(rad/s)^2].

        Parameters
        ----------
        natural
            Natural angular frequencies [rad/s], rigid-body modes first.
        omega
            Angular frequencies [rad/s]; the loss at -omega is the conjugate of that at omega.
        rigid_body_modes
            Number of rigid-body modes.
        """

    @abc.abstractmethod
    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Loss over omega_n^2 [1] in modes far above the frequencies: those left out."""

    def check_modes(self, elastic: int) -> None:
        """Refuse a number of elastic modes for which a law does not hold."""

    def __check_init__(self) -> None:
        """Refuse negative numbers, and distributions with negative values."""
        for entry in dataclasses.fields(self):
            parameter = getattr(self, entry.name)
            if parameter is None or (entry.type == Parameter and np.ndim(parameter)):
                check_annotated(entry.name, parameter, float | Distribution)
        for field, value in _values(self):
            if _least(value) < 0:
                raise InputError(
                    f"damping.{type(self).__name__}: {field}={_words(value)} was given; no number "
                    "below zero is possible, since a mode must not gain energy: give a positive "
                    f"number, or a distribution above zero such as dist.LogUniform(1e-3, 1e-1)."
                )


class Modal(Damping):
    """Viscous modal damping with a ratio for each mode, 2 i ratio omega_n omega.

    Parameters
    ----------
    ratio
        Damping ratios [1] of the elastic modes in order; the last one holds for all further
        modes. One number serves every mode. Rigid-body modes are not damped and not counted.

    Examples
    --------
    >>> bp.damping.Modal([dist.Uniform(0.02, 0.06), 0.04]).ratio[1]  # of all further modes
    0.04
    """

    ratio: tuple[Parameter, ...] | Parameter = eqx.field(
        metadata=unit("1", within=SHARE_OF_CRITICAL)
    )

    def __init__(self, ratio: list[Parameter] | tuple[Parameter, ...] | Parameter):
        if isinstance(ratio, tuple) and len(ratio) == 2 and all(map(_is_number, ratio)):
            raise InputError(
                f"damping.Modal({ratio}) was given, two numbers, which are the ratios of two modes "
                "or a range; say which of the two is meant: damping.Modal([0.02, 0.08]) for two "
                "modes, damping.Modal(dist.Uniform(0.02, 0.08)) for a range."
            )
        for entry in ratio if isinstance(ratio, list | tuple) else ():
            if entry is None or _is_several(entry):
                raise _no_damping(entry)
        if isinstance(ratio, dict):
            raise _no_damping(ratio)
        self.ratio = tuple(ratio) if isinstance(ratio, list) else ratio
        if isinstance(ratio, list | tuple) and not ratio:
            raise InputError(
                "damping.Modal got no ratio; at least one is needed, since the last one holds for "
                "all further modes: damping.Modal([0.04])."
            )

    def __check_init__(self) -> None:
        """Refuse a mode without damping."""
        if any(_is_zero(value) for _, value in _values(self)):
            _refuse_zero("Modal", "ratio", "damping.Modal(0.01)")

    def check_modes(self, elastic: int) -> None:
        """Refuse more ratios than there are elastic modes.

        Raises
        ------
        InputError
            If there are.
        """
        count = len(self.ratio) if isinstance(self.ratio, tuple) else np.size(self.ratio)
        if count > max(elastic, 1):
            raise InputError(
                f"damping.Modal was given {count} ratios, and the structure has {elastic} elastic "
                "modes; at most one for each is needed, since the others would act on nothing. "
                f"Leave them out, damping.Modal(ratios[:{elastic}]), or give the structure more "
                "modes."
            )

    def ratios(self, modes: int, rigid_body_modes: int) -> Float[Array, "mode"]:
        """Damping ratio of each mode [1], rigid-body modes included."""
        ratios = jnp.atleast_1d(jnp.asarray(self.ratio, dtype=float))
        elastic = jnp.clip(jnp.arange(modes) - rigid_body_modes, 0, ratios.size - 1)
        return ratios[elastic]

    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss 2 i ratio omega_n omega [(rad/s)^2]."""
        ratio = self.ratios(natural.size, rigid_body_modes)
        return 2j * (ratio * natural)[:, None] * omega

    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Zero: 2 ratio omega / omega_n vanishes far above."""
        return jnp.zeros(omega.shape)


class Rayleigh(Damping):
    """Damping proportional to mass and stiffness, i omega (mass + stiffness omega_n^2).

    Parameters
    ----------
    mass
        Share of the mass matrix [1/s].
    stiffness
        Share of the stiffness matrix [s].

    Examples
    --------
    >>> law, omega = bp.damping.Rayleigh(mass=10.0, stiffness=1e-5), jnp.array([1000.0])
    >>> float(law.loss(omega, omega, 0)[0, 0].imag / (2 * omega[0] ** 2))  # damping ratio
    0.01
    """

    mass: Parameter = eqx.field(metadata=unit("1/s"))
    stiffness: Parameter = eqx.field(metadata=unit("s"))

    def __check_init__(self) -> None:
        """Refuse two zeros, with which no mode is damped, and a stiffness that is a mass."""
        if all(_is_zero(value) for _, value in _values(self)):
            _refuse_zero("Rayleigh", "mass and stiffness", "damping.Rayleigh(0.0, 1e-5)")
        if OVERDAMPED <= _least(self.stiffness) < np.inf:  # infinite while it is traced
            raise InputError(
                f"damping.Rayleigh: a stiffness of {_least(self.stiffness):.6g} s or more was "
                f"given; less than {OVERDAMPED:g} s is needed, since no mode above 0.3 Hz would "
                "vibrate. The share of the mass [1/s] comes first: "
                "damping.Rayleigh(mass=10.0, stiffness=1e-5)."
            )

    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss i omega (mass + stiffness omega_n^2) [(rad/s)^2]."""
        return 1j * (self.mass + self.stiffness * natural**2)[:, None] * omega

    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Loss i omega stiffness [1], in any mode."""
        return 1j * self.stiffness * omega


class Structural(Damping):
    """Structural damping, a complex stiffness K (1 + i loss_factor).

    Parameters
    ----------
    loss_factor
        Loss factor [1].

    Examples
    --------
    >>> complex(bp.damping.Structural(0.02).static_loss(jnp.array([1000.0]))[0])
    0.02j
    """

    loss_factor: Parameter = eqx.field(metadata=unit("1", within=LOSS_FACTOR))

    def __check_init__(self) -> None:
        """Refuse a structure without damping."""
        if _is_zero(self.loss_factor):
            _refuse_zero("Structural", "loss_factor", "damping.Structural(0.02)")

    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss i loss_factor omega_n^2 [(rad/s)^2], conjugate at negative frequencies."""
        return (natural**2)[:, None] * self.static_loss(omega)

    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Loss i loss_factor [1], in any mode, conjugate at negative frequencies."""
        return 1j * self.loss_factor * jnp.sign(jnp.real(omega))


LAWS: tuple[type[Damping], ...] = (
    Modal,
    Rayleigh,
    Structural,
)
"""Every damping law of the package."""


def _values(damping: Damping) -> Iterator[tuple[str, object]]:
    """Each number or distribution of a damping law, with the name of its field."""
    for field in dataclasses.fields(damping):
        for value in jax.tree.leaves(getattr(damping, field.name), is_leaf=is_unknown):
            yield field.name, value


def _is_number(value: object) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def _is_several(value: Any) -> bool:
    """Whether it is a list, an array or a distribution of several numbers."""
    return isinstance(value, dict) or bool(value.shape() if is_unknown(value) else np.ndim(value))


def _no_damping(value: object) -> InputError:
    return InputError(
        f"A damping of {shown(value)} was given; a finite number or a distribution is needed, "
        "since every mode has one: damping.Modal(0.04)."
    )


def _least(value: object) -> float:
    """Least possible number of a value or a distribution, by the bounds of its support."""
    if isinstance(value, jax.core.Tracer):
        return np.inf
    if isinstance(value, Delta):
        return _least(value.v)  # its support has no bounds
    if not is_unknown(value):
        numbers = np.asarray(value)
        if numbers.dtype.kind not in "iuf" or not np.isfinite(numbers).all():
            raise _no_damping(value)
        return float(np.min(numbers))
    support = value.support
    if isinstance(support, constraints.independent):
        support = support.base_constraint
    if support is constraints.real:
        return -np.inf
    return float(np.min(getattr(support, "lower_bound", np.inf)))


def _is_zero(value: object) -> bool:
    return not is_unknown(value) and _least(value) == 0


def _words(value: object) -> str:
    return type(value).__name__ if is_unknown(value) else f"{_least(value):.6g}"


def _refuse_zero(kind: str, field: str, instead: str) -> None:
    raise InputError(
        f"damping.{kind}: {field} of zero was given; damping is needed, since an undamped mode has "
        f"no finite response at its natural frequency: {instead}."
    )
