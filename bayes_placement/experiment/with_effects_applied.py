"""An experiment whose effects are applied as far as they are plain numbers at its lines.

A mass, a spring and an absorber are a dynamic stiffness at a place; a sensor and an exciter are a
load where they sit; a gain, a delay and a mount are a factor on channels; a window and a rate are
other lines; a misplaced sensor is a sensor at another place, a longer bar is a bar. Experiments
with one or another of them then have one form, and share one compiled response.
"""

from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

from ..effects.beyond_prior import BeyondPrior
from ..effects.effect import Effect, GlobalChange, Hinged, Modulus, Omega, OnPorts, Stiffness
from ..effects.instrument_effect import InstrumentEffect
from ..effects.instruments import Instruments
from ..effects.scales import Scales
from ..modes.beams.waveguide import Waveguide
from ..modes.hinges import Hinge
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import PortLaw
from .experiment import Experiment
from .recording import recorded_frequency
from .structure import is_dict


class Applied(Effect):
    """What effects are at the lines of an experiment; no candidate, so that none is absent."""

    absent: ClassVar[tuple[str, float]] = ("", 0.0)

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["Applied"]:
        """Return none."""
        return []


class AppliedLaw(Applied, OnPorts):
    """A law of which the ports and the dynamic stiffness at each line are known."""

    points: Points
    numerator: Complex[Array, "*port frequency"] = eqx.field(metadata={"unit": "N/m"})
    denominator: Complex[Array, "*port frequency"] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, kw_only=True)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The ports and the law on each, as they were applied."""
        return [PortLaw(self.points, self.numerator, self.denominator)]


class AppliedModulus(Applied, Modulus):
    """A modulus that is known at each line."""

    excess: Complex[Array, "frequency"] = eqx.field(metadata={"unit": "1"})
    kept: Float[Array, ""] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, default="applied.modulus", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What is added at the lines [1]."""
        return self.excess

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping law that remains [1]."""
        return self.kept


class AppliedHinges(Applied, Hinged):
    """Hinges of which the places and the compliances are known."""

    at: Float[Array, "hinge"] = eqx.field(metadata={"unit": "m"})
    compliance: Float[Array, "hinge"] = eqx.field(metadata={"unit": "m/N"})
    orders: tuple[int, ...] = eqx.field(static=True)
    name: str = eqx.field(static=True, default="applied.hinges", kw_only=True)

    def hinges(self, modes: Modes) -> list[Hinge]:
        """The hinges, as they were applied."""
        return [Hinge(*hinge) for hinge in zip(self.at, self.orders, self.compliance, strict=True)]


class AppliedLines(Applied, InstrumentEffect):
    """A record of which it is known at what s / i each line is."""

    known: Complex[Array, "frequency"] = eqx.field(metadata={"unit": "rad/s"})
    name: str = eqx.field(static=True, default="applied.lines", kw_only=True)

    def laplace(self, omega: Omega) -> Complex[Array, "frequency"]:
        """Variable s / i at the lines [rad/s]."""
        return self.known


class AppliedLoads(Applied, InstrumentEffect):
    """The dynamic stiffness of each transducer at each line, of those sides that load."""

    known: OrderedDict[str, Complex[Array, "transducer frequency"]] = eqx.field(
        metadata={"unit": "N/m"}
    )
    name: str = eqx.field(static=True, default="applied.loads", kw_only=True)

    @property
    def loads(self) -> tuple[str, ...]:  # type: ignore[override]
        """Sides that load the structure where they sit."""
        return tuple(self.known)

    def load(self, side: str, number: int, omega: Omega) -> Stiffness:
        """Dynamic stiffness of a transducer at the lines [N/m]."""
        return self.known[side][number]


class AppliedRecord(Applied, InstrumentEffect):
    """What is added to each FRF, and a factor on it that is known at each line."""

    factor: Complex[Array, "sensor actuator frequency"] = eqx.field(metadata={"unit": "1"})
    flexibility: Inexact[Array, "sensor actuator #frequency"] = eqx.field(metadata={"unit": "m/N"})
    name: str = eqx.field(static=True, default="applied.record", kw_only=True)

    def added(self, omega: Omega) -> Inexact[Array, "sensor actuator #frequency"]:
        """Receptance that is added [m/N]."""
        return self.flexibility

    def channel_factor(
        self, omega: Omega, instruments: Instruments
    ) -> Complex[Array, "sensor actuator frequency"]:
        """Factor at the lines [1]."""
        return self.factor


HOOKS = ("moved", "load", "laplace", "evaluated", "added", "channel_factor", "recorded")
"""Methods by which an effect acts on the instruments."""


def with_effects_applied(known: Experiment) -> Experiment:
    """Return an experiment of the same response, its effects applied where they are plain numbers.

    A value beyond its prior is applied already: it stands in the place of the unknown.

    Where modes are observed, or an effect needs the response at other frequencies than the lines,
    the experiment stays as it is.
    """
    if known.observe.is_modal or _acts_by(known, "evaluated"):
        return known
    beyond = known.structure.of_kind(BeyondPrior)
    known = _with_structure_effects(known, _without(known.structure.effects, beyond))
    for step in (
        _moved,
        _with_changed_modes,
        _at_lines,
        _loaded,
        _recorded,
        _with_stiffness,
        _with_modulus,
    ):
        known = step(known)
    return known


def needs_other_lines(experiment: Experiment) -> bool:
    """Whether an effect needs the response at other frequencies than the lines."""
    return bool(_acts_by(experiment, "laplace") or _acts_by(experiment, "evaluated"))


def _acting(experiment: Experiment) -> list[InstrumentEffect]:
    """Effects on the instruments, in the order in which they act."""
    return [effect for _, effect in sorted(experiment.instrument_effects.items())]


def _hooks(effect: InstrumentEffect) -> set[str]:
    """Methods that an effect overrides."""
    kind = type(effect)
    return {name for name in HOOKS if getattr(kind, name) is not getattr(InstrumentEffect, name)}


def _acts_by(known: Experiment, hook: str) -> list[InstrumentEffect]:
    """Effects that override a method."""
    return [effect for effect in _acting(known) if hook in _hooks(effect)]


def _acts_alone_by(known: Experiment, hook: str) -> list[InstrumentEffect]:
    """Effects that override a method, unless one of them does something else as well."""
    found = _acts_by(known, hook)
    return found if all(_hooks(effect) == {hook} for effect in found) else []


def _moved(known: Experiment) -> Experiment:
    """Instruments where they truly sat."""
    instruments, movers = known.instruments, _acts_alone_by(known, "moved")
    for effect in movers:
        instruments = effect.moved(instruments, known.structure.modes)
    moved = eqx.tree_at(
        lambda tree: (tree.sensor, tree.actuator),
        known,
        (OrderedDict(instruments.sensors), OrderedDict(instruments.actuators)),
        is_leaf=is_dict,
    )
    return _in_place_of(movers, moved)


def _with_changed_modes(known: Experiment) -> Experiment:
    """A uniform line of its true size, with its hinges as numbers.

    Effects that move instruments see the line as drawn, and a preload sees it before its hinges.
    """
    structure, modes = known.structure, known.structure.modes
    if not isinstance(modes, Waveguide) or _acts_by(known, "moved"):
        return known
    changes = structure.of_kind(GlobalChange)
    sizes = [change for change in changes if change.changes_size]
    for change in sizes:
        modes = change.changed(modes)
    if sizes:  # all numbers differ within a batch then, whichever dimension it is
        modes = jax.tree.map(lambda number: 1.0 * number, modes)
    hinged = structure.of_kind(Hinged) if len(changes) == len(sizes) else []
    effects = _without(structure.effects, [*sizes, *hinged])
    if hinged:
        hinges = _merged([hinge for effect in hinged for hinge in effect.hinges(modes)])
        effects[hinges.name] = hinges
    of_true_size = eqx.tree_at(lambda tree: tree.structure.modes, known, modes)
    return _with_structure_effects(of_true_size, effects)


def _merged(hinges: Sequence[object]) -> AppliedHinges:
    places, orders, compliances = zip(*hinges, strict=True)
    at, compliance = (jnp.stack([*map(jnp.asarray, values)]) for values in (places, compliances))
    return AppliedHinges(at, compliance, orders)


def _at_lines(known: Experiment) -> Experiment:
    """All that says at what s / i the lines are in one."""
    changes = _acts_alone_by(known, "laplace")
    return _in_place_of(changes, known, AppliedLines(_omega(known) + 0j)) if changes else known


def _loaded(known: Experiment) -> Experiment:
    """All loads in one."""
    loads, omega = _acts_alone_by(known, "load"), _omega(known)
    sides = {side for effect in loads for side in effect.loads}
    stiffness = OrderedDict(
        (side, jnp.stack([_load(loads, side, number, omega) for number, _ in enumerate(channels)]))
        for side in sorted(sides)
        for channels in [known.instruments.side(side)]
    )
    return _in_place_of(loads, known, AppliedLoads(stiffness)) if loads else known


def _load(
    effects: Sequence[InstrumentEffect], side: str, number: int, omega: Omega
) -> Complex[Array, "frequency"]:
    """Dynamic stiffness of a transducer at the lines [N/m]."""
    loads = (effect.load(side, number, omega) for effect in effects if side in effect.loads)
    return sum(loads, jnp.zeros(omega.shape, complex))


def _recorded(known: Experiment) -> Experiment:
    """All that is added to FRFs and all factors on them in one, unless an effect mixes channels."""
    if _acts_by(known, "recorded"):
        return known
    additions = _acts_alone_by(known, "added")
    plain = [effect for effect in _acting(known) if _hooks(effect) == {"channel_factor"}]
    omega = _omega(known)
    channels = (len(known.sensor_channels), len(known.actuator_channels))
    factor = jnp.ones((*channels, omega.size), complex)
    for effect in plain:
        of_effect = effect.channel_factor(omega, known.instruments)
        factor = factor if of_effect is None else factor * of_effect
    added = sum((effect.added(omega) for effect in additions), jnp.zeros((*channels, 1)))
    return _in_place_of([*additions, *plain], known, AppliedRecord(factor, added))


def _in_place_of(
    effects: Sequence[Effect], known: Experiment, *merged: InstrumentEffect
) -> Experiment:
    """An experiment with others in the place of effects on its instruments."""
    remaining = _without(known.instrument_effects, effects)
    remaining |= {effect.name: effect for effect in merged}
    return eqx.tree_at(lambda tree: tree.instrument_effects, known, remaining, is_leaf=is_dict)


def _with_stiffness(known: Experiment) -> Experiment:
    """Laws on ports at each line, and the errors of the shapes there under the new names."""
    structure, omega = known.structure, _omega(known)
    modulus, modes = structure.stiffness_factor(omega), structure.modes
    # Ports at ends and sections are those of the true size, which is not known before the modes.
    of_true_size = any(change.changes_size for change in structure.of_kind(GlobalChange))
    chosen = [] if of_true_size else structure.of_kind(OnPorts)
    laws = [(item, law) for item in chosen for law in item.port_laws(modes, modulus, omega)]
    by_line = [
        AppliedLaw(law.points, *_of_lines(law, omega), name=f"applied.{number}")
        for number, (_, law) in enumerate(laws)
    ]
    names = {item.name: law.name for (item, _), law in zip(laws, by_line, strict=True)}
    remaining = _without(structure.effects, chosen) | {law.name: law for law in by_line}
    renamed = _with_structure_effects(known, OrderedDict(remaining))
    if known.model_error is None:
        return renamed
    ports = {names.get(name, name): error for name, error in known.model_error.ports.items()}
    return eqx.tree_at(
        lambda tree: tree.model_error.ports, renamed, OrderedDict(ports), is_leaf=is_dict
    )


def _of_lines(law: PortLaw, omega: Omega) -> Iterator[Complex[Array, "*port frequency"]]:
    """Numerator and denominator as complex arrays, whatever the law."""
    for part in (law.numerator, law.denominator):
        shape = jnp.broadcast_shapes(jnp.shape(part), omega.shape)
        yield jnp.broadcast_to(jnp.asarray(part), shape) + 0j


def _with_modulus(known: Experiment) -> Experiment:
    """All that changes the modulus in one."""
    structure, omega = known.structure, _omega(known)
    moduli = structure.of_kind(Modulus)
    if not moduli:
        return known  # a complex modulus would double the time of a response
    added = (effect.relative_modulus(omega) for effect in moduli)
    excess = sum(added, jnp.zeros(omega.shape, complex))
    modulus = AppliedModulus(excess, structure.kept_damping())
    remaining = _without(structure.effects, moduli) | {modulus.name: modulus}
    return _with_structure_effects(known, remaining)


def _with_structure_effects(known: Experiment, effects: Mapping[str, Effect]) -> Experiment:
    return eqx.tree_at(lambda tree: tree.structure.effects, known, effects, is_leaf=is_dict)


def _omega(known: Experiment) -> Omega:
    """Variable s / i at each line [rad/s]."""
    effects = known.instrument_effects.values()
    return recorded_frequency(effects, 2 * jnp.pi * jnp.asarray(known.frequency))


def _without(effects: Mapping[str, Effect], dropped: Sequence[Effect]) -> OrderedDict[str, Effect]:
    names = {effect.name for effect in dropped}
    return OrderedDict((name, effect) for name, effect in effects.items() if name not in names)
