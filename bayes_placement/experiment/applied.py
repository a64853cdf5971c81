"""An experiment whose effects are applied as far as they are plain numbers at its lines.

A mass, a spring and an absorber are a dynamic stiffness at a place; a gain, a delay and a mount are
a factor on channels; a misplaced sensor is a sensor at another place. Experiments with one or
another of them then have one form, and share one compiled response.
"""

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ..effects.beyond_prior import BeyondPrior
from ..effects.effect import (
    Effect,
    GlobalChange,
    Modulus,
    Omega,
    OnPorts,
    Stiffness,
)
from ..effects.instrument_effect import InstrumentEffect
from ..effects.instruments import Instruments
from ..effects.scales import Scales
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import PortLaw
from .experiment import Experiment

HOOKS = ("moved", "load", "laplace", "evaluated", "added", "channel_factor", "recorded")
"""Methods by which an effect acts on the instruments."""


class Applied(Effect):
    """What effects are at the lines of an experiment; no candidate."""

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["Applied"]:
        """Return none."""
        return []


class AppliedLaw(Applied, OnPorts):
    """A law of which the ports and the dynamic stiffness at each line are known."""

    absent: ClassVar[tuple[str, float]] = ("numerator", 0.0)
    points: Points
    numerator: Complex[Array, "*port frequency"] = eqx.field(metadata={"unit": "N/m"})
    denominator: Complex[Array, "*port frequency"] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, kw_only=True)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The ports and the law on each, as they were applied."""
        return [PortLaw(self.points, self.numerator, self.denominator)]


class AppliedModulus(Applied, Modulus):
    """A modulus that is known at each line."""

    absent: ClassVar[tuple[str, float]] = ("excess", 0.0)
    excess: Complex[Array, "frequency"] = eqx.field(metadata={"unit": "1"})
    kept: Float[Array, ""] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, default="applied.modulus", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What is added at the lines [1]."""
        return self.excess

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping law that remains [1]."""
        return self.kept


class AppliedFactor(Applied, InstrumentEffect):
    """A factor on each FRF that is known at each line."""

    absent: ClassVar[tuple[str, float]] = ("known", 1.0)
    known: Complex[Array, "sensor actuator frequency"] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, default="applied.factor", kw_only=True)

    def channel_factor(
        self, omega: Omega, instruments: Instruments
    ) -> Complex[Array, "sensor actuator frequency"]:
        """Factor at the lines [1]."""
        return self.known


def applied(known: Experiment) -> Experiment:
    """Return an experiment of the same response, its effects applied where they are plain numbers.

    A value beyond its prior is applied already: it stands in the place of the unknown.

    Where modes are observed, or an effect needs the response at other frequencies than the lines,
    the experiment stays as it is.
    """
    if known.observe.is_modal or needs_other_lines(known):
        return known
    beyond = known.structure.of_kind(BeyondPrior)
    known = _with_structure_effects(known, _without(known.structure.effects, beyond))
    return _with_modulus(_with_stiffness(_with_factor(_with_instruments_moved(known))))


def needs_other_lines(experiment: Experiment) -> bool:
    """Whether an effect needs the response at other frequencies than the lines."""
    elsewhere = {"laplace", "evaluated"}
    return any(_hooks(effect) & elsewhere for effect in _acting(experiment))


def _acting(experiment: Experiment) -> list[InstrumentEffect]:
    """Effects on the instruments, in the order in which they act."""
    return [effect for _, effect in sorted(experiment.instrument_effects.items())]


def _hooks(effect: InstrumentEffect) -> set[str]:
    """Methods that an effect overrides."""
    kind = type(effect)
    return {name for name in HOOKS if getattr(kind, name) is not getattr(InstrumentEffect, name)}


def _with_instruments_moved(known: Experiment) -> Experiment:
    """Instruments where they truly sat, unless what moves them does something else as well."""
    movers = [effect for effect in _acting(known) if "moved" in _hooks(effect)]
    if any(_hooks(effect) != {"moved"} for effect in movers):
        return known
    instruments = known.instruments
    for effect in movers:
        instruments = effect.moved(instruments, known.structure.modes)
    remaining = _without(known.instrument_effects, movers)
    return eqx.tree_at(
        lambda tree: (tree.sensor, tree.actuator, tree.instrument_effects),
        known,
        (OrderedDict(instruments.sensors), OrderedDict(instruments.actuators), remaining),
        is_leaf=_is_dict,
    )


def _with_factor(known: Experiment) -> Experiment:
    """All factors on channels in one, unless another effect mixes channels."""
    effects = _acting(known)
    if any("recorded" in _hooks(effect) for effect in effects):
        return known
    plain = [effect for effect in effects if _hooks(effect) == {"channel_factor"}]
    omega = _omega(known)
    channels = (len(known.sensor_channels), len(known.actuator_channels), omega.size)
    factor = jnp.ones(channels, complex)
    for effect in plain:
        of_effect = effect.channel_factor(omega, known.instruments)
        factor = factor if of_effect is None else factor * of_effect
    merged = AppliedFactor(factor)
    remaining = _without(known.instrument_effects, plain) | {merged.name: merged}
    return eqx.tree_at(lambda tree: tree.instrument_effects, known, remaining, is_leaf=_is_dict)


def _with_stiffness(known: Experiment) -> Experiment:
    """Laws on ports at each line, and the errors of the shapes there under the new names."""
    structure, omega = known.structure, _omega(known)
    modulus, modes = structure.stiffness_factor(omega), structure.modes
    # Ports at ends and sections are those of the true size, which is not known before the modes.
    resized = any(change.changes_size for change in structure.of_kind(GlobalChange))
    chosen = [] if resized else structure.of_kind(OnPorts)
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
        lambda tree: tree.model_error.ports, renamed, OrderedDict(ports), is_leaf=_is_dict
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


def _with_structure_effects(known: Experiment, effects: OrderedDict[str, Any]) -> Experiment:
    return eqx.tree_at(lambda tree: tree.structure.effects, known, effects, is_leaf=_is_dict)


def _omega(known: Experiment) -> Omega:
    """Angular frequency of each line [rad/s]."""
    return 2 * jnp.pi * jnp.asarray(known.frequency)


def _without(effects: Any, dropped: Sequence[Effect]) -> OrderedDict[str, Any]:
    names = {effect.name for effect in dropped}
    return OrderedDict((name, effect) for name, effect in effects.items() if name not in names)


def _is_dict(leaf: Any) -> bool:
    return isinstance(leaf, dict)
