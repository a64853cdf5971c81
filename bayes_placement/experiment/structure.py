"""A structure: its modes, its damping and the effects added to it."""

from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping
from typing import Any, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from .._shared.arguments import check_annotated, check_kind
from .._shared.errors import InputError
from .._shared.reprs import noun_html
from .._shared.sites import Role, owners, settled
from ..effects.amplitude_attachment import AmplitudeAttachment
from ..effects.effect import Effect, GlobalChange, Hinged, Modulus, Omega, OnPorts, StructureEffect
from ..modes.hinges import with_compliance
from ..modes.modes import Modes
from ..positions.channel import checked_name
from ._value_checks import check_values
from .damping import Damping

Kind = TypeVar("Kind", bound=Effect)


class Structure(eqx.Module):
    """A vibrating structure: its modes, their damping, and effects added to it.

    Parameters
    ----------
    modes
        Natural frequencies and mode shapes, for example `beams.bar(...)`.
    damping
        Damping law, for example `damping.Modal([0.04])`. It holds for the modes of the structure
        proper: with its cracks, preload and soft supports, without attachments.
    effects
        Effects by name; placed and checked as by `structure + effect`.

    Raises
    ------
    InputError
        If an effect belongs to the measurement, is under another key than its name, or lies
        outside.

    Examples
    --------
    >>> structure
    Structure: UniformBar, Modal damping
    >>> (structure + bp.effects.point_mass(at=0.4, mass=0.1)).effects
    OrderedDict([('point_mass', PointMass(at=0.4 m, mass=0.1 kg))])
    """

    modes: Modes = eqx.field(metadata=owners(Role.PARAMETER))
    damping: Damping = eqx.field(metadata=owners(Role.PARAMETER))
    effects: OrderedDict[str, StructureEffect] = eqx.field(metadata=owners(Role.PARAMETER))

    def __init__(
        self, modes: Modes, *, damping: Damping, effects: Mapping[str, Effect] = OrderedDict()
    ):
        needed = "modes of a structure are needed, since a response is a sum over them"
        check_kind("modes", modes, Modes, needed, "Structure(beams.bar(...), damping=...)")
        needed = "a damping law is needed, since a number alone does not say which law"
        instead = "damping=damping.Modal(0.04), or damping.Modal(dist.Uniform(0.02, 0.06))"
        check_kind("damping", damping, Damping, needed, instead)
        check_annotated("effects", effects, Mapping[str, Effect])
        self.modes = modes
        self.damping = damping
        self.effects = OrderedDict()
        for name, effect in effects.items():
            _check_key(name, effect)
            self.effects = self._with(effect)
        known = settled(self)
        self.modes, self.damping, self.effects = known.modes, known.damping, known.effects
        check_values(self)

    def __add__(self, effect: Effect) -> "Structure":
        """Return the structure with one more effect.

        Raises
        ------
        InputError
            If the effect belongs to the measurement, has a name that is taken, or lies outside.
        """
        needed = "an effect is needed, since only effects are added"
        check_kind("effect", effect, Effect, needed, "structure + effects.point_mass(0.4, 0.1)")
        changed = settled(
            eqx.tree_at(lambda tree: tree.effects, self, self._with(effect), is_leaf=is_dict)
        )
        check_values(changed)
        return changed

    def _with(self, effect: Effect) -> "OrderedDict[str, StructureEffect]":
        """Effects with one more, placed on the structure."""
        if not isinstance(effect, StructureEffect):
            raise InputError(
                f'The effect "{effect.name}" was added to a structure; an experiment is needed, '
                "since it acts on the instruments, which a structure does not have. Add it to the "
                "experiment: experiment + effect."
            )
        return added(self.effects, effect.on(self.modes))

    def of_kind(self, kind: Callable[..., Kind]) -> list[Kind]:
        """Effects of one kind, sorted by name: the order of adding has no consequence."""
        base: Any = kind
        return [effect for _, effect in sorted(self.effects.items()) if isinstance(effect, base)]

    def proper_modes(self) -> Modes:
        """Modes of the structure proper, without attachments."""
        modes = self.modes.solved()
        changes = self.of_kind(GlobalChange)
        for change in sorted(changes, key=lambda change: not change.changes_size):
            modes = change.changed(modes)
        hinges = [hinge for effect in self.of_kind(Hinged) for hinge in effect.hinges(modes)]
        return with_compliance(modes, hinges) if hinges else modes

    def relative_modulus(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Modulus over the modulus as drawn [1]."""
        added = (effect.relative_modulus(omega) for effect in self.of_kind(Modulus))
        return sum(added, jnp.ones(omega.shape))

    def stiffness_factor(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Internal force over that of the modulus as drawn, with its loss [1]."""
        loss = self.damping.static_loss(omega) * self.kept_damping()
        return self.relative_modulus(omega) + loss

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping law that no effect replaces [1]."""
        shares = [effect.kept_damping() for effect in self.of_kind(Modulus)]
        return jnp.prod(jnp.array([1.0, *shares]))

    def __repr__(self) -> str:
        """Say what it is made of."""
        effects = f", with {', '.join(self.effects)}" if self.effects else ""
        modes, damping = type(self.modes).__name__, type(self.damping).__name__
        return f"Structure: {modes}, {damping} damping{effects}"

    _repr_html_ = noun_html

    @property
    def attachments(self) -> list[OnPorts]:
        """All that is attached at ports or inserted there, and linear."""
        return self.of_kind(OnPorts)

    def uncertain_ports(self) -> dict[str, int]:
        """Ports at which a model error of shapes counts, by name of what is attached."""
        counts = {item.name: item.uncertain_ports(self.modes) for item in self.attachments}
        return {name: count for name, count in counts.items() if count}

    @property
    def amplitude_attachments(self) -> list[AmplitudeAttachment]:
        """Attachments whose stiffness depends on the amplitude."""
        return self.of_kind(AmplitudeAttachment)


def is_dict(leaf: object) -> bool:
    """Tell whether a leaf of a tree is a dictionary, which changes as a whole."""
    return isinstance(leaf, dict)


def _check_key(key: str, effect: Effect) -> None:
    """Refuse a key that is not the name of the effect."""
    if key != effect.name:
        raise InputError(
            f"effects={{{key!r}: ...}} was given with an effect of the name {effect.name!r}; its "
            "name is needed as its key, since its unknowns are looked for by that: "
            f"effects={{{effect.name!r}: ...}}, or name={key!r} in the effect."
        )


def added(effects: Mapping[str, Kind], effect: Kind) -> OrderedDict[str, Kind]:
    """Effects by name with one more."""
    checked_name("An effect of the name", effect.name)
    check_free(effect, effects)
    return OrderedDict(effects) | {effect.name: effect}


def check_free(effect: Effect, names: Collection[str]) -> None:
    """Refuse an effect whose name is taken."""
    if effect.name in names:
        raise InputError(
            f'An effect "{effect.name}" was added twice; each needs a name of its own, since '
            f'unknowns are named by it: name="{effect.name}_2".'
        )
