"""Receptance [m/N] between points of a structure with all its effects."""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

from .._shared.dimensions import Receptance
from .._shared.errors import InputError
from ..effects.amplitude_attachment import AmplitudeAttachment
from ..effects.effect import Omega, OnPorts
from ..modes.changed import with_coupling
from ..modes.modes import Modes
from ..modes.points import Points, joined
from ..modes.ports import PortLaw
from ..modes.uneven_pieces import Excess, with_uneven_pieces
from .closure import attached, closed, reciprocal
from .structure import Structure

PerMode = Inexact[Array, "mode frequency"]
Force = Float[Array, "frequency"]

Matrix = Complex[Array, "response reference frequency"]
"""Receptance [m/N] between response and reference points."""


def receptance(
    structure: Structure,
    sensors: Points,
    actuators: Points,
    omega: Omega,
    *,
    ports: Sequence[PortLaw] = (),
    force: Force | None = None,
    mode_error: "ModeError | None" = None,
) -> Receptance:
    r"""Receptance between points of a structure with all its effects, Eqs. (6), (7) and (18).

    The modal sum with the static flexibility of the modes left out, then all that is attached or
    inserted, closed at its ports; further ones are those of the instruments. Time convention
    exp(+i omega t). Attachments that depend on amplitudes need the force [N] at each frequency.
    """
    modes = structure.proper_modes()
    if mode_error is not None:
        modes = mode_error.uneven(modes)
    linear = [*linear_laws(structure, modes, omega, mode_error), *ports]
    nonlinear = [_single(found, modes)] if (found := structure.amplitude_attachments) else []
    at_ports = [item.points(modes) for item in nonlinear] + [port.points for port in linear]
    response, reference = ShapesAtPoints.of(sensors, modes), ShapesAtPoints.of(actuators, modes)
    of_modes = modal_receptance(structure, modes, omega, mode_error)
    with_errors = mode_error is not None
    between = partial(elastic, structure, modes, of_modes, omega, with_errors=with_errors)
    matrix = between(response, reference)
    if not at_ports:
        return matrix
    inner = ShapesAtPoints.of(joined(at_ports), modes)
    # Apart, since sums of other sizes may round otherwise: what is between sensors and actuators
    # must not change by a single bit where nothing is attached to a port.
    with_ports = between(response.joined(inner), reference.joined(inner))
    matrix = with_ports.at[: matrix.shape[0], : matrix.shape[1]].set(matrix)
    for law in reversed(linear):
        matrix = closed(matrix, law)
    for item in nonlinear:
        matrix = attached(matrix, item, omega, _known(force, item))
    return matrix


def motion(
    structure: Structure, driven: Points, omega: Omega
) -> Complex[Array, "coordinate point frequency"]:
    """Motion under a unit force at each of some points, in coordinates that serve every place.

    A place reads them by what `readings` returns: the receptance to it is the product of both. They
    are those of the modes and, where it is known, of the flexibility that the modes leave out.
    """
    modes, laws = structure.proper_modes(), linear_laws(structure, structure.proper_modes(), omega)
    everywhere = _with_ports(driven, laws)
    factors = modal_receptance(structure, modes, omega)
    matrix = everywhere.exact_shapes(modes).T[..., None] * factors.modal[:, None] + 0j
    if everywhere.static_flexibility(modes, everywhere) is not None:
        static = jnp.eye(everywhere.count)[..., None] * factors.relative_compliance
        matrix = jnp.concatenate([matrix, static])
    if laws:
        ports, points = (
            ShapesAtPoints.of(each, modes)
            for each in (joined([law.points for law in laws]), everywhere)
        )
        own = elastic(structure, modes, factors, omega, ports, points, with_errors=False)
        matrix = jnp.concatenate([matrix, own])
    for law in reversed(laws):
        matrix = closed(matrix, law)
    return matrix


def readings(
    structure: Structure, place: Points, driven: Points, omega: Omega
) -> Float[Array, "port coordinate"]:
    """How a place reads the coordinates of `motion` under forces at these points."""
    modes = structure.proper_modes()
    shapes = place.exact_shapes(modes)
    everywhere = _with_ports(driven, linear_laws(structure, modes, omega))
    if everywhere.static_flexibility(modes, everywhere) is None:
        return shapes
    return jnp.concatenate([shapes, place.flexibility_left_out(modes, everywhere)], axis=1)


def _with_ports(driven: Points, laws: Sequence[PortLaw]) -> Points:
    return joined([driven, *(law.points for law in laws)])


def linear_laws(
    structure: Structure, modes: Modes, omega: Omega, mode_error: "ModeError | None" = None
) -> list[PortLaw]:
    """Ports of all that is attached or inserted, with errors of the shapes there, and the laws."""
    return [
        law if mode_error is None else law._replace(points=mode_error.at(attachment, law.points))
        for attachment in structure.attachments
        for law in attachment.port_laws(modes, structure.stiffness_factor(omega), omega)
    ]


class ShapesAtPoints(NamedTuple):
    """Points, and the mode shapes along them, which are computed once: with errors, and exact."""

    points: Points
    shapes: Float[Array, "point mode"]
    exact: Float[Array, "point mode"]

    @classmethod
    def of(cls, points: Points, modes: Modes) -> "ShapesAtPoints":
        """Read the shapes."""
        exact = points.exact_shapes(modes)
        return cls(points, points.with_error(exact), exact)

    def joined(self, other: "ShapesAtPoints") -> "ShapesAtPoints":
        """These points followed by others."""
        shapes = jnp.concatenate([self.shapes, other.shapes])
        exact = jnp.concatenate([self.exact, other.exact])
        return ShapesAtPoints(joined([self.points, other.points]), shapes, exact)


class ModeError(NamedTuple):
    """By what the first modes differ from those of the model."""

    frequency: Float[Array, "erroneous"]
    damping: Float[Array, "erroneous"]
    """Factors on natural frequencies and on what the damping law says of them [1]."""
    ports: Mapping[str, Float[Array, "port erroneous"]] = MappingProxyType({})
    """What is added to the shapes at attachments, by name [kg^-1/2]."""
    pieces: Excess | None = None
    """What uneven pieces add to the modal matrices; None where no piece is known."""

    def uneven(self, modes: Modes) -> Modes:
        """Return the modes of the structure with uneven pieces."""
        return modes if self.pieces is None else with_uneven_pieces(modes, self.pieces)

    def over(self, modes: int) -> "ModeError":
        """Return the factors of all modes, one for those that are exact."""
        ones = jnp.ones(modes)
        frequency, damping = (
            ones.at[: factor.size].set(factor) for factor in (self.frequency, self.damping)
        )
        return ModeError(frequency, damping)

    def at(self, attachment: OnPorts, points: Points) -> Points:
        """Return the points of an attachment with the errors of the shapes there."""
        error = self.ports.get(attachment.name)
        return points if error is None else dataclasses.replace(points, shape_error=error)


class ModalReceptance(NamedTuple):
    """What each mode adds to a receptance, as a factor of its shapes."""

    modal: PerMode
    """Receptance of each mode of unit shape."""
    beyond_static: PerMode
    """The same without its static part."""
    relative_compliance: Inexact[Array, "frequency"]
    """Factor on the static flexibility: one over the modulus, with its loss [1]."""


def modal_receptance(
    structure: Structure, modes: Modes, omega: Omega, mode_error: ModeError | None = None
) -> ModalReceptance:
    """Receptance of each mode of unit shape, with and without its static part.

    The static flexibility is that of the modulus as drawn; damped, it is divided by the modulus
    that modes far above the lines have.
    """
    modulus = structure.relative_modulus(omega)
    natural, rigid = modes.angular_frequency(), modes.rigid_body_modes
    structure.damping.check_modes(natural.size - rigid)
    eigenvalues = jnp.concatenate([jnp.full(rigid, jnp.inf), natural[rigid:] ** 2])
    factor = None if mode_error is None else mode_error.over(natural.size)
    natural = natural if factor is None else natural * factor.frequency
    loss = structure.damping.loss(natural, omega, rigid)
    loss = loss if factor is None else loss * factor.damping[:, None]
    stiffness_less_inertia = (natural**2)[:, None] * modulus - omega**2
    modal = reciprocal(stiffness_less_inertia + loss * structure.kept_damping())
    compliance = reciprocal(structure.stiffness_factor(omega))
    return ModalReceptance(modal, modal - compliance / eigenvalues[:, None], compliance)


def elastic(
    structure: Structure,
    modes: Modes,
    factors: ModalReceptance,
    omega: Omega,
    response: ShapesAtPoints,
    reference: ShapesAtPoints,
    *,
    with_errors: bool,
) -> Matrix:
    """Receptance [m/N] of the structure proper, static where modes are left out."""
    static = response.points.static_flexibility(modes, reference.points)
    if static is None:
        matrix = _modal_sum(response, reference, factors.modal)
    elif with_errors:
        # What the kept modes leave out is that of the exact ones.
        left_out = static - (response.exact * _flexibility(modes)) @ reference.exact.T
        dynamic = _modal_sum(response, reference, factors.modal)
        matrix = dynamic + left_out[..., None] * factors.relative_compliance
    else:
        beyond = _modal_sum(response, reference, factors.beyond_static)
        matrix = beyond + static[..., None] * factors.relative_compliance
    second = response.points.second_flexibility_left_out(modes, reference.points)
    if second is not None:
        matrix = matrix + second[..., None] * (omega * factors.relative_compliance) ** 2
    return _coupled(matrix, structure, modes, (response, reference), factors.modal, omega)


def _flexibility(modes: Modes) -> Float[Array, "mode"]:
    """Static flexibility of each mode of unit shape; none of rigid-body modes."""
    rigid = modes.rigid_body_modes
    elastic_modes = modes.angular_frequency()[rigid:]
    return jnp.concatenate([jnp.zeros(rigid), 1 / elastic_modes**2])


def _modal_sum(response: ShapesAtPoints, reference: ShapesAtPoints, modal: PerMode) -> Matrix:
    residues = response.shapes[:, None, :] * reference.shapes[None, :, :]
    # Two real products cost half of one complex product with a real factor.
    return residues @ jnp.real(modal) + 1j * (residues @ jnp.imag(modal))


def _coupled(
    matrix: Matrix,
    structure: Structure,
    modes: Modes,
    sides: tuple[ShapesAtPoints, ShapesAtPoints],
    modal: PerMode,
    omega: Omega,
) -> Matrix:
    """Receptance with the coupling of modes of one frequency: the derivative their shapes lack."""
    coupling = modes.coupling()
    if coupling is None:
        return matrix
    natural = modes.angular_frequency()

    def loss(natural: Float[Array, "mode"]) -> PerMode:
        return structure.damping.loss(natural, omega, modes.rigid_body_modes)

    # The loss rotates with the modes: l(K) changes by dl / d(omega_n^2) between equal frequencies.
    slope = jax.jvp(loss, (natural,), (jnp.ones_like(natural),))[1]
    over = 0.5 / jnp.where(natural > 0, natural, jnp.inf)[:, None]
    growth = structure.relative_modulus(omega) + slope * over * structure.kept_damping()
    response, reference = (side.shapes[:, :, None] * modal for side in sides)
    return with_coupling(matrix, coupling, response * growth, reference)


def _single(attachments: Sequence[AmplitudeAttachment], modes: Modes) -> AmplitudeAttachment:
    """Return the only attachment whose stiffness depends on the amplitude, along one direction."""
    last = attachments[-1]
    if len(attachments) > 1:
        names = " and ".join(attachment.name for attachment in attachments)
        raise InputError(
            f"The structure has {len(attachments)} attachments that depend on the amplitude, "
            f"{names}; at most one is possible, since their describing functions depend on each "
            f'other. Keep one of them: experiment.without("{last.name}").'
        )
    if last.points(modes).count > 1:
        raise InputError(
            f'Effect "{last.name}" was given without a direction; one is needed, since its '
            "stiffness depends on the amplitude, which is that along one direction: "
            "direction=(0.0, 0.0, 1.0)."
        )
    return last


def _known(force: Force | None, attachment: AmplitudeAttachment) -> Force:
    if force is None:
        raise InputError(
            f'The structure has the effect "{attachment.name}", but no force is known; its '
            "amplitude is needed, since the response depends on it: "
            "Experiment(..., force_levels=[0.1, 1.0])."
        )
    return force
