"""Effects are checked and placed before they act, whichever way they come to a structure."""

from typing import Any, ClassVar

import equinox as eqx
import jax
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.ranges import POSITIVE
from bayes_placement._shared.sites import unit
from bayes_placement.positions.tolerances import Segment

BAR = {"length": 1.0, "area": 1e-3, "youngs_modulus": 1e9, "density": 9000.0}
DAMPING = bp.damping.Modal(0.02)
DIRECTED = {
    "point_mass": (0.1,),
    "ground_spring": (1e4,),
    "ground_dashpot": (10.0,),
    "tuned_absorber": (0.1, 100.0, 0.1),
    "cubic_stiffness": (1e8,),
    "coulomb_friction": (10.0, 1e6),
    "gap": (1e6, 1e-5),
}


def refused(message):
    return pytest.raises(ValueError, match=message)


def bar(**changes):
    return bp.beams.bar(3, **(BAR | changes), ends="fixed-free")


def structure(*of, **named):
    return bp.Structure(bar(), damping=DAMPING, effects={e.name: e for e in of} | named)


def directed(kind, direction):
    return getattr(effects, kind)(0.5, *DIRECTED[kind], direction=direction)


def test_a_structure_takes_effects_as_its_sum_does():
    """Placed, checked, and placed once more without harm."""
    mass = effects.point_mass(Segment(0.4, within=0.1), 0.1)
    whole = structure(mass)
    np.testing.assert_allclose(float(whole.effects["point_mass"].at.low), 0.3, rtol=1e-6)
    assert repr(whole.effects) == repr((structure() + mass).effects)
    again = bp.Structure(whole.modes, damping=DAMPING, effects=whole.effects)
    assert repr(again.effects) == repr(whole.effects)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"point_mass": effects.point_mass(5.0, 0.1)}, "place 5 m lies outside the structure"),
        ({"sensor_mass": effects.sensor_mass(0.1)}, '"sensor_mass" was added to a structure'),
        ({"m": effects.point_mass(0.5, 0.1)}, "given with an effect of the name 'point_mass'"),
    ],
)
def test_effects_of_a_structure_that_cannot_act_are_refused(given, message):
    with refused(message):
        structure(**given)


def test_traced_numbers_pass():
    def lowest(mass, stiffness):
        placed = effects.ground_spring(0.5, stiffness, direction=(stiffness, 0.0, stiffness))
        whole = structure(effects.point_mass(0.5, mass), placed)
        return whole.effects["point_mass"].mass + whole.effects["ground_spring"].stiffness

    assert float(jax.jit(lowest)(1.0, 2.0)) == 3.0


def test_a_name_is_taken_by_structure_and_instruments_alike():
    experiment = bp.Experiment(
        structure(),
        sensors=[bp.Sensor("s1", at=0.9)],
        actuators=[bp.Actuator("a1", at=0.5)],
        frequency=[5.0, 20.0],
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )
    on_structure = effects.point_mass(0.5, 0.1, name="extra")
    on_instruments = effects.sensor_mass(0.1, name="extra")
    for first, second in [(on_structure, on_instruments), (on_instruments, on_structure)]:
        with refused('"extra" was added twice; each needs a name of its own.*name="extra_2"'):
            experiment + first + second


@pytest.mark.parametrize("kind", DIRECTED)
@pytest.mark.parametrize(
    ("direction", "message"),
    [
        ((0.0, 0.0, 0.0), r"direction=\(0, 0, 0\) was given; a vector of a length above zero"),
        ((np.nan, 0.0, 0.0), "three finite numbers along x, y and z are needed"),
        (("x", 0.0, 0.0), "three finite numbers along x, y and z are needed"),
        ((0.0, 1.0, 0.0), r"with a component along x is needed.*direction=\(1.0, 0.0, 0.0\)"),
    ],
)
def test_directions_along_which_nothing_moves_are_refused(kind, direction, message):
    effect = directed(kind, direction)
    with refused(f'Effect "{kind}".*{message}'):
        structure() + effect
    with refused(f'Effect "{kind}".*{message}'):
        structure(effect)


@pytest.mark.parametrize(
    "direction",
    [None, (0.6, 0.0, 0.8), (-1, 0, 0), (dist.Uniform(-1.0, 1.0), 0.0, 1.0)],
)
def test_directions_partly_along_the_motions_stay(direction):
    for kind in DIRECTED:
        placed = structure(directed(kind, direction)).effects[kind]
        assert (placed.direction or ())[1:] == (direction or ())[1:]  # the first may be unknown


class Lamp(effects.Attachment):
    """An attachment of a user with a field that has a range of its own."""

    absent: ClassVar[tuple[str, float]] = ("mass", 0.0)
    at: Any = eqx.field(metadata=unit("m"))
    mass: Any = eqx.field(metadata=unit("kg", within=POSITIVE))
    name: str = eqx.field(static=True, default="lamp", kw_only=True)

    def dynamic_stiffness(self, omega):
        return -(omega**2) * self.mass

    @classmethod
    def suggest(cls, scales):
        return []


def test_a_field_states_its_own_range():
    with refused(r"effects.lamp.mass=-1 was given; it must be above zero \[kg\]"):
        structure(Lamp(0.5, -1.0))
    with refused(r"effects.lamp.mass=Uniform\(-1, 1\), from -1 to 1, was given; it must be above"):
        structure(Lamp(0.5, dist.Uniform(-1.0, 1.0)))
    assert structure(Lamp(0.5, 1.0)).effects["lamp"].mass == 1.0
