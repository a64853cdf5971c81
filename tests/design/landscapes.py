"""Estimators whose information is a known function of the placement.

They compile at once, so that searches are tested alone.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import bayes_placement as bp
from bayes_placement.design.information.estimator import Estimator, Gain
from models import bar

TRACED: list[str] = []
"""Grows whenever something is compiled."""


class Modal(Estimator):
    """Information about modal coordinates by sensors, all of unit variance, in closed form."""

    modes: int = eqx.field(static=True, default=3)
    strength: float = eqx.field(static=True, default=10.0)
    replicates: int = eqx.field(static=True, default=2)

    def typical(self):
        return {}

    def plan(self, experiment, seed, moved=()):
        def plan(at, values):
            TRACED.append("Modal")
            force = sum(jnp.sin(np.pi * values[f"actuator.{a}.position"]) for a in at.actuator)
            places = jnp.stack([values[f"sensor.{s}.position"] for s in at.sensor])
            return _gain(_log_det(places, self.modes, self.strength * force))

        return plan


class Hills(Estimator):
    """A broad low hill of s1 and a1 in the middle, and a narrow high one at (0.8, 0.15)."""

    replicates: int = eqx.field(static=True, default=2)

    def typical(self):
        return {}

    def plan(self, experiment, seed, moved=()):
        def plan(at, values):
            TRACED.append("Hills")
            places = jnp.stack([values["sensor.s1.position"], values["actuator.a1.position"]])
            low = 0.8 * jnp.exp(-jnp.sum((places - jnp.array([0.45, 0.55])) ** 2) / 0.3**2)
            high = jnp.exp(-jnp.sum((places - jnp.array([0.8, 0.15])) ** 2) / 0.12**2)
            return _gain(low + high)

        return plan


class Nearness(Estimator):
    """Gain that grows towards a place of s1 in space."""

    to: tuple[float, float, float] = eqx.field(static=True)
    replicates: int = eqx.field(static=True, default=2)

    def typical(self):
        return {}

    def plan(self, experiment, seed, moved=()):
        def plan(at, values):
            place = at.fix(values).sensor["s1"].points(at.structure.modes.axes).position[0]
            return _gain(-jnp.linalg.norm(place - jnp.array(self.to)))

        return plan


def learnt(places, modes=3, strength=10.0, force=1.0):
    """Information gain of `Modal`, by NumPy."""
    rows = np.sin(np.pi * np.outer(places, np.arange(1, modes + 1)))
    return 0.5 * np.linalg.slogdet(np.eye(modes) + strength * force * rows.T @ rows)[1]


def experiment(sensors, actuators=("a1",), *, noise=None, within=0.04):
    """The bar, with sensors at 0.3, 0.4, ... and actuators at 0.5."""

    def at(place):
        return bp.positions.Segment(place, within=within)

    return bp.Experiment(
        bar.bar(),
        sensors=[bp.Sensor(name, at=at(0.3 + 0.1 * i)) for i, name in enumerate(sensors)],
        actuators=[bp.Actuator(name, at=at(0.5)) for name in actuators],
        frequency=bar.PAPER_LINES,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=noise,
    )


def _gain(kl):
    return Gain(kl, jnp.stack([kl, kl]))


def _log_det(places, modes, strength):
    rows = jnp.sin(np.pi * places[:, None] * np.arange(1, modes + 1))
    return 0.5 * jnp.linalg.slogdet(jnp.eye(modes) + strength * rows.T @ rows)[1]
