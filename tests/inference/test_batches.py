"""Hypotheses of one form share one compiled response, which is that of the experiment itself."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled
from bayes_placement.effects.scales import Scales
from bayes_placement.experiment.with_effects_applied import (
    AppliedLaw,
    AppliedModulus,
    AppliedRecord,
)
from bayes_placement.inference.batches import batch, without_priors
from bayes_placement.inference.residuals import Problem
from tests.criticism.small import experiment, measured

ENDS = ("left", "right")
ANYWHERE, STRENGTH = dist.Uniform(0.1, 0.9), dist.LogUniform(1e-3, 1.0)

ATTACHED = [
    effects.point_mass(ANYWHERE, STRENGTH),
    effects.ground_spring(ANYWHERE, dist.Normal(0.0, 1e3)),
    effects.ground_dashpot(ANYWHERE, STRENGTH),
    effects.tuned_absorber(ANYWHERE, STRENGTH, 200.0, 0.1),
]
OF_CHANNELS = [
    effects.gain_error("s1", dist.Normal(0.0, 0.1)),
    effects.time_delay(dist.Uniform(0.0, 1e-4)),
    effects.misplaced_sensor("s2", dist.Uniform(-0.1, 0.1)),
    effects.reversed_channel("a1", dist.Uniform(0.0, 1.0)),
]
ALIKE = [
    [effects.actuator_mass(STRENGTH), effects.stinger(STRENGTH, 300.0, 0.1)],
    [effects.frequency_scale(dist.Normal(0.0, 0.01)), effects.exponential_window(STRENGTH)],
    [effects.dimension_error(STRENGTH, dimension=word) for word in ("length", "section")],
    [effects.compliant_support(STRENGTH, end=end, motion="translation") for end in ENDS],
]


def outcome(*added):
    base = experiment()
    for effect in added:
        base = base + effect
    points = np.zeros((2, len(base.unknowns)))
    return compiled(batch).bound(base).outcome(points)


def form(*added):
    return outcome(*added).form.apart_from_declared()


@pytest.fixture(scope="module")
def without():
    return form()


def test_all_that_is_attached_to_a_place_has_one_form(without):
    outcomes = [outcome(effect) for effect in ATTACHED]
    assert {found.form.apart_from_declared() for found in outcomes} == {form(ATTACHED[0])}
    assert form(ATTACHED[0]) != without
    # And numbers of one type, or the compiler would begin anew.
    types = {tuple((n.shape, n.dtype, n.weak_type) for n in found.numbers) for found in outcomes}
    assert len(types) == 1


def test_all_that_acts_on_channels_has_the_form_of_no_effect(without):
    assert {form(effect) for effect in OF_CHANNELS} == {without}
    assert form(ATTACHED[0], OF_CHANNELS[0]) == form(ATTACHED[1])
    assert form(effects.residual_modes(dist.Normal(0.0, 1e-8))) == without


@pytest.mark.parametrize("alike", ALIKE, ids=lambda alike: alike[0].name)
def test_effects_that_enter_in_one_way_have_one_form(without, alike):
    assert len({form(effect) for effect in alike} | {without}) == 2


def test_what_differs_in_its_priors_alone_is_one_batch():
    signs = (effects.point_mass(ANYWHERE, prior) for prior in (STRENGTH, dist.Normal(0.0, 0.1)))
    bound = [compiled(batch).bound(without_priors(experiment() + effect)) for effect in signs]
    assert len({one._parts.key for one in bound}) == 1


def test_a_value_beyond_its_prior_has_the_form_of_no_effect(without):
    (ratio, *_) = [name for name in experiment().unknown if name.startswith("structure.")]
    end = float(experiment().unknown[ratio].distribution.support.upper_bound)
    assert form(effects.beyond_prior(ratio, dist.Uniform(end, 2 * end), end=end)) == without


def test_what_mixes_channels_or_frequencies_has_a_form_of_its_own(without):
    swapped = form(effects.swapped_sensors("s1", "s2"))
    window = form(effects.exponential_window(dist.Uniform(0.0, 1.0)))
    assert len({without, swapped, window}) == 3


def test_what_is_known_is_the_same_for_all_points(without):
    known = experiment().fix({"sensor.s1.position": 0.24})
    points = np.zeros((2, len(known.unknowns)))
    at_known_place = compiled(batch).bound(known).outcome(points)
    assert len(at_known_place.form.shared(known)) == 1 + sum(s is not None for s in without.sources)


def test_residuals_are_those_of_the_experiment_at_its_values():
    hypothesis = experiment() + ATTACHED[0] + OF_CHANNELS[0] + OF_CHANNELS[2]
    hypothesis = hypothesis + effects.hysteretic_damping(dist.LogUniform(1e-3, 0.3))
    data = hypothesis.data(measured(seed=1))
    problem = Problem(hypothesis, data)
    point = np.random.default_rng(0).normal(size=(1, problem.dimension))
    values = {name: value[0] for name, value in problem.coordinates.named(point).items()}
    predicted = compiled(bp.Experiment.predict)(hypothesis.fix(values))
    deviation = hypothesis.noise.deviation(data)
    expected = (np.asarray(data.z) - np.asarray(predicted)) / np.asarray(deviation)
    (residual,), _ = problem.squares.residuals(point)
    np.testing.assert_allclose(residual, expected.ravel(), rtol=1e-9, atol=1e-9)


def test_applied_effects_are_no_candidates():
    kinds = (AppliedRecord, AppliedModulus, AppliedLaw)
    scales = Scales(experiment())
    assert [kind.suggest(scales) for kind in kinds] == [[], [], []]
