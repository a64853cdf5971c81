"""Alternative explanations: which are kept, with what odds, and their draws."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from bayes_placement import effects
from bayes_placement.criticism.missing._alternatives import alternatives
from bayes_placement.criticism.missing._hypotheses import Hypothesis
from bayes_placement.criticism.missing._posterior_odds import STRONG, Comparison
from bayes_placement.inference.engines.about_mode import SampledPosterior
from bayes_placement.inference.engines.levenberg_marquardt import Fit, laplace
from bayes_placement.inference.residuals import Problem
from tests.criticism.small import experiment, measured

MASS, SPRING = effects.point_mass(0.3, 0.1), effects.ground_spring(0.3, 1e5)
NAME = "structure.damping.ratio"
DATA = experiment().data(measured())


def hypothesis(log_evidence, squares, *added):
    """A fit of so many squares over 100 data, of one unknown."""
    problem = Mock(
        spec=Problem,
        experiment=experiment(),
        at_fixed_sizes=experiment(),
        data=DATA,
        dimension=1,
        count=100,
        baseline=None,
        coordinates=SimpleNamespace(named=lambda points: {NAME: points[:, 0]}),
    )
    gaussian = laplace(np.zeros(1), 100.0 * np.eye(1))
    fit = Fit(np.zeros(1), 0.0, squares, gaussian, log_evidence, 1)
    return Hypothesis(added, problem, fit)


def explanations(*hypotheses):
    pool = Comparison(list(hypotheses), {"point_mass": 1, "ground_spring": 1})
    return alternatives(pool, hypotheses, {})


def test_nearly_as_probable_explanations_survive():
    mass, spring = explanations(hypothesis(-50.0, 400.0, MASS), hypothesis(-51.0, 400.0, SPRING))
    assert (mass.name, spring.name) == ("point_mass", "ground_spring")
    assert (mass.probability, spring.probability) == pytest.approx((1.0, np.exp(-1.0)))


def test_what_is_improbable_and_misfits_does_not_survive():
    (mass,) = explanations(hypothesis(-50.0, 100.0, MASS), hypothesis(-55.0, 300.0, SPRING))
    assert mass.name == "point_mass"


def test_what_explains_the_data_down_to_the_noise_survives_with_the_least_odds():
    survivors = explanations(hypothesis(-50.0, 100.0, MASS), hypothesis(-70.0, 101.0, SPRING))
    assert [explanation.name for explanation in survivors] == ["point_mass", "ground_spring"]
    assert survivors[1].probability == pytest.approx(np.exp(-STRONG))


def test_one_effect_more_than_needed_is_no_explanation_besides():
    assert len(explanations(hypothesis(-50.0, 100.0), hypothesis(-70.0, 99.0, MASS))) == 1
    assert explanations(hypothesis(-50.0, 100.0))[0].name == "nothing_missing"


def test_draws_are_those_that_were_sampled_or_of_the_gaussian():
    mass, spring = hypothesis(-50.0, 100.0, MASS), hypothesis(-50.1, 100.0, SPRING)
    sampled = {id(mass): SampledPosterior(np.full((7, 1), 3.0), -50.0, 0.1)}
    first, second = alternatives(Comparison([mass, spring], {}), [mass, spring], sampled)
    np.testing.assert_array_equal(first.draws[NAME], np.full(7, 3.0))
    assert second.draws[NAME].std() == pytest.approx(0.1, rel=0.1)
