"""A free beam on two springs: each alone explains little, so that both are tried at once."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._more_effects import single_effects
from bayes_placement.criticism.missing._suspension import with_suspended
from bayes_placement.effects import LossySpring
from tests.criticism.small import LINES, recorded

pytestmark = pytest.mark.long

SPRINGS = {0.27: 8.1e4, 0.81: 6.4e4}
"""Places [m] and stiffnesses [N/m]."""


def experiment(ends="free-free"):
    modes = bp.beams.beam(
        8,
        length=1.0,
        area=6e-4,
        second_moment=1e-8,
        youngs_modulus=dist.Uniform(6.5e10, 7.5e10),
        density=2700.0,
        ends=ends,
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor(f"s{number}", at=at) for number, at in enumerate((0.1, 0.44, 0.93), 1)],
        actuators=[bp.Actuator("a1", at=0.62)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def hung():
    """Measurement of the beam on lossy springs."""
    true = experiment().fix({"structure.modes.youngs_modulus": 6.9e10})
    for number, (place, stiffness) in enumerate(SPRINGS.items()):
        law = LossySpring(stiffness, 0.03)
        true = true + bp.effects.attached(place, law, name=f"spring {number}")
    return recorded(true, seed=0)


def singles(setup, kinds):
    data = setup.data(hung())
    effects = bp.effects.library(setup, kinds).effects
    return single_effects(null_hypothesis(setup, data), effects, lambda: None)


def places_and_stiffnesses(found):
    values = found.problem.coordinates.named(found.fit.point[None])
    numbers = {
        field: [float(np.squeeze(value)) for name, value in values.items() if name.endswith(field)]
        for field in (".at", ".stiffness")
    }
    return dict(zip(*numbers.values(), strict=True))


def test_two_springs_with_a_loss_are_found_at_once_with_place_and_stiffness():
    alone = singles(experiment(), ["ground_spring"])
    assert alone.best().chi2_per_datum > 100
    best = with_suspended(alone, alone, True).best()
    assert best.kinds == ("attached: lossy spring",) * 2
    assert best.chi2_per_datum == pytest.approx(1.0, abs=4 * np.sqrt(2 / best.problem.count))
    found = places_and_stiffnesses(best)
    listed = with_suspended(alone, alone, False)
    assert listed.best().kinds == ("ground_spring",) * 2
    for place, stiffness in SPRINGS.items():
        (near,) = (each for each in found if abs(each - place) < 0.01)
        assert found[near] == pytest.approx(stiffness, rel=0.03)


@pytest.mark.parametrize(
    ("ends", "kind"), [("fixed-free", "ground_spring"), ("free-free", "point_mass")]
)
def test_a_beam_that_is_held_and_a_library_without_springs_stay_as_they_are(ends, kind):
    alone = singles(experiment(ends), [kind])
    assert with_suspended(alone, alone, True) is alone


def test_a_spring_whose_place_is_known_is_no_candidate_for_two():
    setup = experiment()
    spring = bp.effects.ground_spring(0.27, dist.LogUniform(1e3, 1e6))
    null = null_hypothesis(setup, setup.data(hung()))
    alone = single_effects(null, [spring], lambda: None)
    assert with_suspended(alone, alone, True) is alone
