"""Model error: each mode and channel differs from the model, by sizes that are unknown.

An embedded, hierarchical discrepancy: it enters where the physics does, so that a predicted FRF
stays one of a structure. Kennedy and O'Hagan (2001, doi:10.1111/1467-9868.00294); Soize (2005,
doi:10.1016/j.jsv.2005.07.009); Sargsyan, Huan and Najm (2019,
doi:10.1615/Int.J.UncertaintyQuantification.2019027384).
"""

import math
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import LogUniform, Normal

from .._shared.arguments import check_fields
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from .._shared.sites import Role, Unknown, is_unknown, owners
from ..effects.instruments import Instruments
from ..effects.scales import Scales
from ..modes.modes import Modes, frequencies_of
from ..modes.uneven_pieces import piece_shares
from ._errors_of_parts import (
    OF_WHAT,
    SIDES,
    ErrorsOfChannels,
    ErrorsOfModes,
    ErrorsOfPieces,
    ErrorsOfRuns,
    StandardOfChannels,
    StandardOfPieces,
)
from .frf import ModeError

MARGIN = 1.3
"""Natural frequency over the greatest line up to which a mode is erroneous: those above matter
little, and their static flexibility is that of the model."""

LEAST_MIXED = 20
"""Least number of elastic modes that uneven pieces mix: fewer hardly differ from piece to piece."""

DAMPING_MARGIN = 3.0
"""The same for damping, which modes far above the lines still show: by it alone these are lossy."""

MODAL_MARGIN = 1.05
"""The same where modal parameters are observed: of modes above those measured nothing is seen."""

PIECES_A_MODE, MOST_PIECES = 3, 36
"""Pieces of a line for each erroneous mode, where their number is not asked for, and most of them.

The energy of a mode has a period of half its wavelength. Two pieces in each period do not show what
differs in quadrature with them; three show both.
"""

Size: TypeAlias = Parameter | None
"""Common size of errors, a number or a distribution; None where there are none."""


@with_short_repr
@dataclass(frozen=True)
class Embedded:
    """Natural frequencies, damping, shapes, gains and pieces that differ from those of the model.

    The natural frequency of a mode is that of the model times exp(frequency * e), its damping that
    of the model times exp(damping * e'), its shape at a channel that of the model plus
    shape * rms * e'', rms being the root mean square of a mass-normalised shape, and a channel
    records 1 + gain * e''' times the motion. All e are standard normal and independent.

    Stiffness and mass vary along a structure: each piece of a uniform bar or beam has the
    stiffness of the model times exp(stiffness_and_mass * e), and its mass likewise. Of a finite
    element model, each region has such a stiffness, and each of 36 cells of neighbouring nodes
    such a mass; where there are no regions, each cell such a stiffness. This moves natural
    frequencies and shapes together and mixes close modes, as errors of single modes do not. Both
    have one size, since a wave hardly tells a stiffer piece from one that is lighter and as much
    longer. Of modes handed over without mass, and of fewer nodes than cells without regions, no
    piece is known.

    In a roved test a structure is not the same in all runs: it is warmer, or its joints slip more
    where a hit is harder. In the run of each actuator natural frequencies are those of the
    structure times exp(runs * e). By default there are no such errors.

    The sizes are unknown as a rule. Their joint mode with the errors lies at zero and means
    nothing; `improve` and `explain` find them with the errors integrated out.

    Parameters
    ----------
    frequency, damping
        Standard deviation of the logarithm of natural frequencies and of damping [1].
    shape
        Standard deviation of shapes over their root mean square [1].
    gain
        Relative standard deviation of the sensitivity of channels [1].
    stiffness_and_mass
        Standard deviation of the logarithms of the stiffness and of the mass of pieces [1].
    runs
        Standard deviation of the logarithm of natural frequencies from run to run [1].
    modes
        Number of elastic modes with errors; by default those up to 1.3 times the greatest line, and
        of damping those up to 3 times; where modes are observed, up to 1.05 times the last one.
    pieces
        Number of pieces of a uniform bar or beam; by default three for each of these modes, at most
        36: what strains a mode varies twice as fast as its shape.

    Raises
    ------
    InputError
        If a size is not positive or above 1, or there is no mode or piece.

    Examples
    --------
    >>> imperfect = experiment.with_model_error(bp.model_error.Embedded(frequency=0.01, runs=None))
    >>> len(imperfect.unknowns) > len(experiment.unknowns)
    True
    """

    frequency: Size = field(default_factory=lambda: LogUniform(1e-5, 0.1))
    damping: Size = field(default_factory=lambda: LogUniform(1e-3, 1.0))
    shape: Size = field(default_factory=lambda: LogUniform(1e-4, 0.3))
    gain: Size = field(default_factory=lambda: LogUniform(1e-4, 0.1))
    stiffness_and_mass: Size = field(default_factory=lambda: LogUniform(1e-4, 1.0))
    runs: Size = None
    modes: int | None = None
    pieces: int | None = None

    def __post_init__(self) -> None:
        """Check the sizes."""
        check_fields(self)
        for word in OF_WHAT:
            _check_size(word, getattr(self, word))
        _check_number("modes", self.modes, "at least one mode must have errors")
        _check_number("pieces", self.pieces, "a structure has at least one piece")

    def on(self, scales: Scales) -> "ModalErrors":
        """Return an error for each mode and channel of an experiment."""
        structure = scales.setup.nominal().structure
        modes = structure.proper_modes()
        rigid = modes.rigid_body_modes
        natural = frequencies_of(modes)[rigid:]
        margins = (MODAL_MARGIN,) * 2 if scales.modes_alone else (MARGIN, DAMPING_MARGIN)
        count, damped = (
            min(
                natural.size,
                self.modes
                or max(scales.modes_observed, int(np.sum(natural < margin * scales.band[1]))),
            )
            for margin in margins
        )
        return ModalErrors(
            frequency=_of_modes(self.frequency, count),
            damping=_of_modes(self.damping, damped),
            shape=_of_channels(self.shape, scales.instruments, count),
            gain=_of_channels(self.gain, scales.instruments),
            stiffness_and_mass=self._of_pieces(structure.modes.solved(), rigid, count),
            runs=_of_runs(self.runs, scales.instruments, count),
            ports=OrderedDict(),
            rms_shape=1 / math.sqrt(scales.mass),
            modes=count,
            rigid_body_modes=rigid,
        )

    def _of_pieces(self, modes: Modes, rigid: int, count: int) -> ErrorsOfPieces | None:
        """Errors of pieces, over the modes with errors and those that these mix with."""
        if self.stiffness_and_mass is None:
            return None
        pieces = self.pieces or min(PIECES_A_MODE * count, MOST_PIECES)
        shares = piece_shares(modes, pieces, rigid + max(2 * count, LEAST_MIXED))
        if shares is None:
            return None
        standard = (_standard_normal(len(share)) for share in shares)
        return ErrorsOfPieces(self.stiffness_and_mass, StandardOfPieces(*standard), shares)


@with_short_repr
class ModalErrors(eqx.Module):
    """Errors of the modes and channels of an experiment; made of `Embedded` by the experiment.

    Parameters
    ----------
    frequency, damping, shape, gain, stiffness_and_mass, runs
        Errors of each, None where there are none.
    ports
        Errors of the shapes over their size where something is attached to the structure, by the
        name of the attachment: what it feels differs from the model as what a sensor reads does.
    rms_shape
        Root mean square of a mass-normalised shape [kg^-1/2].
    modes
        Number of elastic modes with errors.
    rigid_body_modes
        Number of rigid-body modes before them.

    Examples
    --------
    >>> errors = experiment.with_model_error(bp.model_error.Embedded(frequency=0.01)).model_error
    >>> errors.modes, errors.rigid_body_modes
    (5, 0)
    """

    frequency: ErrorsOfModes | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    damping: ErrorsOfModes | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    shape: ErrorsOfChannels | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    gain: ErrorsOfChannels | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    stiffness_and_mass: ErrorsOfPieces | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    runs: ErrorsOfRuns | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    ports: OrderedDict[str, Parameter] = eqx.field(metadata=owners(Role.MODEL_ERROR))
    rms_shape: float
    modes: int = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def mode_error(self) -> ModeError:
        """Factors on natural frequencies and damping of rigid-body modes and those with errors."""
        factors = (
            jnp.ones(self.modes) if errors is None else jnp.exp(errors.values())
            for errors in (self.frequency, self.damping)
        )
        frequency, damping = (
            jnp.concatenate([jnp.ones(self.rigid_body_modes), factor]) for factor in factors
        )
        pieces = None if self.stiffness_and_mass is None else self.stiffness_and_mass.excess()
        return ModeError(frequency, damping, self._port_errors(), pieces)

    def run_factors(
        self, instruments: Instruments
    ) -> Float[Array, "actuator_channel erroneous"] | None:
        """Factors on natural frequencies in the run of each actuator channel; None without any."""
        if self.runs is None:
            return None
        return jnp.exp(jnp.pad(self.runs.values(instruments), [(0, 0), (self.rigid_body_modes, 0)]))

    def _port_errors(self) -> dict[str, Float[Array, "port mode"]]:
        if self.shape is None:
            return {}
        size = self.rms_shape * jnp.asarray(self.shape.size)
        padding = [(0, 0), (self.rigid_body_modes, 0)]
        return {
            name: jnp.pad(size * jnp.asarray(standard), padding)
            for name, standard in self.ports.items()
        }

    def with_ports(self, points: Mapping[str, int]) -> "ModalErrors":
        """Return the errors with those where something is attached, of so many points each."""
        counts = points if self.shape is not None else {}
        standard = OrderedDict(
            (name, self.ports.get(name, _standard_normal(count, self.modes)))
            for name, count in counts.items()
        )
        return eqx.tree_at(
            lambda tree: tree.ports, self, standard, is_leaf=lambda leaf: isinstance(leaf, dict)
        )

    def shape_error(
        self, instruments: Instruments, side: str
    ) -> Float[Array, "channel mode"] | None:
        """What is added to the shapes at the channels of a side [kg^-1/2]."""
        if self.shape is None:
            return None
        errors = self.rms_shape * self.shape.values(instruments, side)
        return jnp.pad(errors, [(0, 0), (self.rigid_body_modes, 0)])

    def gain_factors(self, instruments: Instruments, side: str) -> Float[Array, "channel"]:
        """Factor on what each channel of a side records [1]."""
        if self.gain is None:
            return jnp.ones(len(instruments.channels(side)))
        return 1 + self.gain.values(instruments, side)


def shares_size(unknown: Unknown, size: Unknown) -> bool:
    """Whether an unknown is an error of a size.

    Examples
    --------
    >>> imperfect = experiment.with_model_error(bp.model_error.Embedded())
    >>> size = imperfect.unknown["model_error.gain.size"]
    >>> [u.name for u in imperfect.unknowns if bp.model_error.shares_size(u, size)]
    ['model_error.gain.standard.sensor.s1', 'model_error.gain.standard.actuator.a1']
    """
    kinds = ("shape", "ports") if size.owner.kind == "shape" else (size.owner.kind,)
    is_error = unknown.role is Role.MODEL_ERROR and unknown.field != "size"
    return is_error and unknown.owner.kind in kinds


def _of_modes(size: Size, count: int) -> ErrorsOfModes | None:
    return None if size is None else ErrorsOfModes(size, _standard_normal(count))


def _of_channels(size: Size, instruments: Instruments, *shape: int) -> ErrorsOfChannels | None:
    if size is None:
        return None
    sides = (
        OrderedDict(
            (name, _standard_normal(len(item.channels), *shape))
            for name, item in instruments.side(side).items()
        )
        for side in SIDES
    )
    return ErrorsOfChannels(size, StandardOfChannels(*sides))


def _of_runs(size: Size, instruments: Instruments, count: int) -> ErrorsOfRuns | None:
    if size is None:
        return None
    standard = OrderedDict((name, _standard_normal(count)) for name in instruments.side("actuator"))
    return ErrorsOfRuns(size, standard)


def _standard_normal(*shape: int) -> Normal:
    return Normal(np.zeros(shape), np.ones(shape))


def _check_size(word: str, size: Size) -> None:
    if size is None or is_unknown(size):
        return
    if not (np.ndim(size) == 0 and np.isfinite(size) and size > 0):  # type: ignore[operator]
        raise InputError(
            f"model_error.Embedded({word}={size!r}) was given; a positive number, a distribution "
            f"of one, or None for no such error is needed: {word}=dist.LogUniform(1e-4, 0.1)."
        )
    if size > 1:  # type: ignore[operator]
        raise InputError(
            f"model_error.Embedded({word}={size!r}) was given; a number up to 1 is needed, since "
            f"it is a relative error and not in percent: {word}=0.01."
        )


def _check_number(word: str, number: int | None, reason: str) -> None:
    if number is not None and number < 1:
        raise InputError(
            f"model_error.Embedded({word}={number}) was given; {reason}. Without model error: "
            "model_error=None."
        )
