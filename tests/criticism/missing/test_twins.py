"""A fit that ends where an effect acts almost as it does elsewhere."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing._descents import fit_grown
from bayes_placement.criticism.missing._hypotheses import Hypothesis, null_hypothesis
from bayes_placement.criticism.missing._scanned_candidates import _or_its_twin
from tests.criticism.small import recorded

FOOT, OFFSET = 0.46, -0.03
BODY = "structure.effects.eccentric_mass"


def beam():
    modes = bp.beams.beam(
        10,
        length=1.0,
        area=1e-4,
        youngs_modulus=2e11,
        density=7800.0,
        second_moment=1e-9,
        ends="free-free",
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.01)),
        sensors=[
            bp.Sensor(name, at=place) for name, place in (("s1", 0.1), ("s2", 0.55), ("s3", 0.8))
        ],
        actuators=[bp.Actuator("a1", at=0.25)],
        frequency=np.linspace(30.0, 700.0, 60),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def body(*values):
    return bp.effects.eccentric_mass(*values)


@pytest.fixture(scope="module")
def null():
    true = beam() + body(FOOT, 0.1, 0.02, OFFSET)
    return null_hypothesis(beam(), beam().data(recorded(true, seed=3)))


def fitted(null, candidate, *, foot, offset):
    """The fit that begins at a foot and an offset."""
    problem = null.problem.with_effect(candidate)
    values = {"mass": 0.1, "radius_of_gyration": 0.02, "at": foot, "offset": offset}
    unknown = {f"{BODY}.{word}": value for word, value in values.items()}
    start = np.asarray(problem.coordinates.vector(unknown))[None]
    return Hypothesis((candidate,), problem, *fit_grown(problem, start, start))


def candidate(offsets):
    sizes = dist.LogUniform(1e-3, 1.0), dist.LogUniform(1e-3, 0.2)
    return body(dist.Uniform(0.0, 1.0), *sizes, offsets)


def test_a_body_held_from_the_other_side_of_its_centre_is_tried(null):
    effect = candidate(dist.Uniform(-0.1, 0.1))
    stuck = fitted(null, effect, foot=FOOT + 2 * OFFSET, offset=-OFFSET)
    found = _or_its_twin(stuck, effect)
    at = found.problem.coordinates.named(found.fit.point[None])
    assert float(at[f"{BODY}.offset"][0]) == pytest.approx(OFFSET, abs=0.005)
    assert float(at[f"{BODY}.at"][0]) == pytest.approx(FOOT, abs=0.005)
    assert found.fit.log_evidence > stuck.fit.log_evidence + 3


def test_none_is_tried_outside_a_prior(null):
    effect = candidate(dist.Uniform(0.01, 0.1))
    stuck = fitted(null, effect, foot=FOOT + 2 * OFFSET, offset=-OFFSET)
    assert _or_its_twin(stuck, effect) is stuck


def test_a_twin_of_a_twin_is_the_same():
    effect = body(FOOT, 0.1, 0.02, OFFSET)
    values = {"at": FOOT, "offset": OFFSET}
    assert effect.twin(effect.twin(values)) == pytest.approx(values)
    assert effect.twin({"offset": OFFSET}) == {}
    assert bp.effects.point_mass(0.4, 0.1).twin({"at": 0.4}) == {}
