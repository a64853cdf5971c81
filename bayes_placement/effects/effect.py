"""What every effect is, by the place where it enters the response of a structure."""

import abc
import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import ClassVar, TypeAlias, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

from .._shared.arguments import check_annotated
from .._shared.dimensions import Parameter
from .._shared.reprs import with_short_repr
from .._shared.sites import check_scalar, is_unknown, unit
from ..laws.law import Law
from ..modes.flexible_parts import FlexiblePart
from ..modes.hinges import Hinge
from ..modes.modes import Modes
from ..modes.points import Points, along
from ..modes.ports import PortLaw, is_beam, rotation
from ..positions import at as _at
from ..positions.channel import printable_name
from ..positions.places import Place as InSpace
from ..positions.places import Position, Value, coordinates
from ..positions.tolerances import Tolerance
from ..positions.vectors import Recorded
from . import _setting_words
from .instruments import Instruments
from .scales import Axis, Scales

Omega: TypeAlias = Inexact[Array, "frequency"]
"""Angular frequencies [rad/s]."""

Stiffness: TypeAlias = Inexact[Array, "frequency"]
"""Dynamic stiffness [N/m] at each angular frequency."""

Place: TypeAlias = _at.At
"""A place as a user may give it."""

Direction: TypeAlias = tuple[object, object, object] | None
"""Three numbers or distributions; None for every direction in which the structure moves."""

Location: TypeAlias = Place | Recorded
"""A place [m] as numbers, or as distributions where it is unknown."""

OF_CHANNELS = "of channels"
"""Metadata of a field that holds a number for each channel; all others hold one number."""

Self = TypeVar("Self", bound="Effect")
SelfAtPlace = TypeVar("SelfAtPlace", bound="AtPlace")
Placed = TypeVar("Placed", bound="Effect")


@with_short_repr
class Effect(eqx.Module):
    """A physical effect that a structure or its instruments may have.

    With a strength of zero it is exactly the identity: the same object serves inference, where
    its strength is sampled, and ranking, where the response to a small strength is its signature.

    Attributes
    ----------
    absent
        Name of the field that is the strength, and its value without the effect, mostly zero.
    place_fields
        Names of the fields that say where the effect is; none where it has no place of its own.
    changes_modes
        Whether natural frequencies, damping ratios or real shapes show it.
    acts_on
        What it acts on, as a result says it: `displacement`, `rotation`, `body`, `relative`,
        `region`, `cut`, `channel`, `all_channels` or `structure`.
    tried_by_default
        Whether a library in which no kinds are named has it; by its name it is in any.
    tried_last
        Whether it is tried only where no other effect explains the data.
    takes_long
        Whether it takes long to evaluate, as it acts at many ports.
    in_every_structure
        Whether all structures on which it can be tried have it, be it too little to show.
    may_repeat
        Whether several of the kind can be missing, at other places or about other sensors.
    may_coincide
        Whether these may even be at one place, as modes are.
    may_be_new
        Whether it can come between two states of a structure; else it was there before.
    only_new
        Whether it is tried between two states alone: one does not tell it from a number with a
        prior.
    if_negative
        What it means that the estimate of its strength is below zero; empty where that is usual.
    name
        Name in an experiment. Its default is the kind of the effect: models of the same physics
        for different structures share a kind.

    Examples
    --------
    >>> bp.effects.point_mass.absent  # the field that is the strength, and its value at none
    ('mass', 0.0)
    """

    absent: eqx.AbstractClassVar[tuple[str, float]]
    place_fields: ClassVar[tuple[str, ...]] = ()
    changes_modes: ClassVar[bool] = True
    acts_on: ClassVar[str] = "structure"
    tried_by_default: ClassVar[bool] = True
    tried_last: ClassVar[bool] = False
    takes_long: ClassVar[bool] = False
    in_every_structure: ClassVar[bool] = False
    may_repeat: ClassVar[bool] = True
    may_coincide: ClassVar[bool] = False
    may_be_new: ClassVar[bool] = True
    only_new: ClassVar[bool] = False
    if_negative: ClassVar[str] = ""
    name: eqx.AbstractVar[str]

    @property
    def kind(self) -> str:
        """Name of its kind, whatever its name in an experiment."""
        return type(self).name  # type: ignore[return-value]

    @property
    def variant(self) -> str:
        """What it is about, where effects of its kind may stand for each other; mostly empty."""
        return ""

    @classmethod
    @abc.abstractmethod
    def suggest(cls, scales: Scales) -> Sequence["Effect"]:
        """Variants to be tried on an experiment, with priors scaled to its structure."""

    def __check_init__(self) -> None:
        printable_name("An effect of the name", self.name)
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if "unit" not in field.metadata:
                check_annotated(field.name, value, field.type)
            elif field.type == Parameter:
                if value is None:
                    check_annotated(field.name, value, Parameter)
                if not field.metadata.get(OF_CHANNELS):
                    check_scalar(field.name, value)

    def roughly(self: Self) -> Self:
        """Return the effect in a form that takes less time, to find out where it acts: itself."""
        return self

    def on(self: Self, modes: Modes) -> Self:
        """Return the effect placed on a structure, or refuse one that it does not fit."""
        return self

    def location(self, modes: Modes, instruments: Instruments) -> Location | None:
        """Where the effect is [m], known or unknown; None where it has no place.

        An effect on a part of the structure is at the centre of the part, if that is known; an
        effect on a sensor is where the sensor was recorded.
        """
        return None

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Say which place, sensor or part of the structure it acts on, as in `sensor s3`.

        Empty where there is only one. Unknown places are parameters and not part of it.
        """
        return ""

    def twin(self, values: Mapping[str, Value]) -> Mapping[str, Value]:
        """Return other values of its fields at which it acts almost alike; mostly none."""
        return {}

    def remark(self, estimates: Mapping[str, tuple[float, float]]) -> str:
        """Say what mean and deviation of its numbers mean: a strength below zero, or nothing."""
        mean, _ = estimates.get(self.absent[0], (0.0, 0.0))
        return self.if_negative if mean < 0 else ""


class StructureEffect(Effect):
    """An effect that belongs to the structure: added by `structure + effect`."""


class AtPlace(StructureEffect):
    """An effect at one place of the structure, along one direction or in every one."""

    acts_on: ClassVar[str] = "displacement"
    place_fields: ClassVar[tuple[str, ...]] = ("at",)
    at: Place = eqx.field(metadata=unit("m"))

    @property
    def direction(self) -> Direction:
        """Direction in which it acts; None for every one in which the structure moves."""
        return None

    def on(self: SelfAtPlace, modes: Modes) -> SelfAtPlace:
        """Return the effect placed on a structure, a tolerance region as the uniform prior."""
        _setting_words.check_direction(self.name, self.direction, modes.axes)
        return placed(self, modes)

    def location(self, modes: Modes, instruments: Instruments) -> Location | None:
        """The place [m]."""
        return self.at

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Piece of the structure on which it sits, and the direction in which it acts."""
        piece = _setting_words.place(self.at, modes.bounds())
        return _setting_words.joined(piece, _setting_words.along(self.direction))

    def points(self, modes: Modes) -> Points:
        """Where the structure feels it, and along which directions."""
        return along(coordinates(self.at), self.direction, modes)


class OnPorts(StructureEffect):
    """Something attached to or inserted in the structure, which feels its laws at ports.

    Examples
    --------
    >>> issubclass(bp.effects.Attachment, bp.effects.OnPorts)
    True
    """

    @abc.abstractmethod
    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """Ports that it acts on, and the law on each.

        The modulus is that of the structure with its loss, over that as drawn, at each line [1].
        """

    def uncertain_ports(self, modes: Modes) -> int:
        """Number of ports at which a model error of shapes counts; none but of displacements."""
        return 0


class Attachment(AtPlace, OnPorts):
    """Something attached to the structure, which feels its dynamic stiffness at one place.

    Examples
    --------
    >>> issubclass(bp.effects.point_mass, bp.effects.Attachment)
    True
    """

    direction: Direction = eqx.field(default=None, kw_only=True)

    @abc.abstractmethod
    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Force on the attachment per displacement of its place [N/m]."""

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The place along its directions, with the same law along each."""
        return [PortLaw(self.points(modes), self.dynamic_stiffness(omega))]

    def uncertain_ports(self, modes: Modes) -> int:
        """Number of directions of a displacement at one place, whose errors count."""
        if self.acts_on != "displacement":
            return 0
        return len(modes.axes) if self.direction is None else 1


class NetworkAttachment(Attachment):
    """An attachment whose law is a network of springs, dashpots and masses.

    Examples
    --------
    >>> bp.effects.maxwell_mount(0.4, stiffness=2e4, relaxation_time=1e-3).network().tree()
    ['-', 'k', 'c']
    """

    @abc.abstractmethod
    def network(self) -> Law:
        """Return the law of what is attached."""

    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Force on the attachment per displacement of its place [N/m]."""
        return self.network().dynamic_stiffness(omega)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The ports with the law of the network as a fraction, which may have poles."""
        return [PortLaw(self.points(modes), *self.network().fraction(omega))]


class Modulus(StructureEffect):
    """A stiffness that depends on frequency and loses energy, everywhere on the structure.

    Examples
    --------
    >>> kinds = bp.effects.EFFECTS.items()
    >>> [name for name, kind in kinds if issubclass(kind, bp.effects.Modulus)]
    ['hysteretic_damping', 'viscoelastic_modulus', 'modulus_change', 'modulus']
    """

    may_repeat: ClassVar[bool] = False

    @abc.abstractmethod
    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What is added to the modulus, over the modulus as drawn [1]."""

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping of the structure that remains in addition to it [1]."""
        return jnp.ones(())


class GlobalChange(StructureEffect):
    """An effect all along the structure proper: it changes the modes themselves.

    Attributes
    ----------
    changes_size
        Whether it makes another bar or beam, on which all other changes then act.

    Examples
    --------
    >>> kinds = bp.effects.EFFECTS.items()
    >>> [name for name, kind in kinds if issubclass(kind, bp.effects.GlobalChange)]
    ['axial_preload', 'shear_and_rotary_inertia', 'dimension_error']
    """

    may_repeat: ClassVar[bool] = False
    changes_size: ClassVar[bool] = False

    @abc.abstractmethod
    def changed(self, modes: Modes) -> Modes:
        """Modes of the changed structure."""


class Hinged(StructureEffect):
    """An effect that makes the structure proper more flexible at some places.

    Examples
    --------
    >>> kinds = bp.effects.EFFECTS.items()
    >>> [name for name, kind in kinds if issubclass(kind, bp.effects.Hinged)]
    ['local_stiffness_loss', 'region_stiffness_loss', 'compliant_support', 'soft_support',
    'loose_joint', 'member_preload']
    """

    @abc.abstractmethod
    def hinges(self, modes: Modes) -> Sequence[Hinge] | Sequence[FlexiblePart]:
        """Hinges that it adds, or parts of a finite element model that become softer."""


def take_long(effects: Iterable[Effect]) -> bool:
    """Whether one of these takes long to evaluate."""
    return any(effect.takes_long for effect in effects)


def at_each(
    kind: Callable[..., Placed], places: Sequence[tuple[object, Axis]], *numbers: object
) -> list[Placed]:
    """Effects of one kind at places and along directions, with the same priors of their numbers."""
    return [kind(place, *numbers, direction=direction) for place, direction in places]


def placed(effect: Placed, modes: Modes, field: str = "at") -> Placed:
    """Return an effect with a place as numbers or distributions on a structure."""
    place = _at.position_on(
        getattr(effect, field), modes.bounds(), f'Effect "{effect.name}"', "place"
    )
    return eqx.tree_at(lambda tree: getattr(tree, field), effect, place, is_leaf=_is_place)


def _is_place(leaf: object) -> bool:
    """Tell whether a leaf is a place that a structure makes definite."""
    return is_unknown(leaf) or isinstance(leaf, Tolerance | InSpace)


Footprint: TypeAlias = tuple[Parameter, Parameter, Parameter] | None
"""Vector between the edges of a foot in space [m]; None on a beam."""


class OnRotation(NetworkAttachment):
    """Something attached to the rotation of a beam, or of a foot on a structure in space."""

    footprint: eqx.AbstractVar[Footprint]

    acts_on = "rotation"

    def on(self, modes: Modes) -> "OnRotation":
        """Return the effect placed on a structure that rotates."""
        check_rotation(self.footprint, self.direction, modes)
        return NetworkAttachment.on(self, modes)

    def points(self, modes: Modes) -> Points:
        """The slope of a beam, or the difference over the footprint."""
        return rotation(coordinates(self.at), self.footprint, self.direction, modes)


def check_rotation(footprint: Footprint, direction: Direction, modes: Modes) -> None:
    """Refuse a rotation that the structure does not have, or without a footprint in space."""
    rotation(jnp.asarray(modes.bounds()[0], float), footprint, direction, modes)


def bending_scale(scales: Scales) -> tuple[float, float, list[Position]]:
    """Length [m], bending stiffness [N m2] and places of a uniform beam; 1 and none of others."""
    beam = scales.nominal_modes
    if not is_beam(beam):
        return 1.0, 1.0, []
    return float(beam.length), float(beam.stiffness), scales.places()
